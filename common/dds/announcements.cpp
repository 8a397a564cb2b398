#include "common/dds/announcements.h"

namespace gatefield::dds {

Data read_data(const Submessage& submessage) noexcept {
  Data data;
  Fields fields = submessage.fields();
  fields.skip(2);
  const std::uint16_t to_inline_qos = fields.u16();
  data.writer = entity_at(submessage.body, 8);
  fields.skip(to_inline_qos);
  if ((submessage.flags & kInlineQos) != 0)
    skip_parameters(&fields, [&](std::uint16_t id, std::span<const std::uint8_t> value) {
      data.ends |= id == kStatusInfo && value.size() >= 4 && (value[3] & kDisposedOrUnregistered) != 0;
    });
  data.ends |= (submessage.flags & kDataFlag) == 0;
  data.payload = fields.rest();
  return data;
}

bool says_goodbye(std::span<const std::uint8_t> datagram) noexcept {
  std::size_t at = kHeader_bytes;
  Submessage next;
  while (at < datagram.size() && read_submessage(datagram, &at, &next)) {
    if (next.id != kData) continue;
    const Data data = read_data(next);
    if (data.writer == kAnnouncements && data.ends) return true;
  }
  return false;
}

}  // namespace gatefield::dds
