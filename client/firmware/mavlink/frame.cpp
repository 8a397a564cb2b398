#include "client/firmware/mavlink/frame.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <utility>

#include "client/firmware/mavlink/frame_format.h"

namespace gatefield::firmware::mavlink {
namespace {

template <typename Kind>
void write_payload(const Kind& message, std::uint8_t* to) noexcept {
  for_each_field<Kind>([&]<typename Value>(const Field<Kind, Value>& field) {
    std::memcpy(to, &(message.*field.member), sizeof(Value));
    to += sizeof(Value);
  });
}

template <typename Kind>
Message read_payload(const std::uint8_t* from) noexcept {
  Kind message;
  for_each_field<Kind>([&]<typename Value>(const Field<Kind, Value>& field) {
    std::memcpy(&(message.*field.member), from, sizeof(Value));
    from += sizeof(Value);
  });
  return message;
}

using Reader = Message (*)(const std::uint8_t*) noexcept;

template <std::size_t... kIndex>
constexpr auto all_readers(std::index_sequence<kIndex...>) {
  return std::array<Reader, sizeof...(kIndex)>{&read_payload<std::variant_alternative_t<kIndex, Message>>...};
}
/// In the order of definitions().
constexpr auto kReaders = all_readers(std::make_index_sequence<std::variant_size_v<Message>>());

std::size_t without_trailing_zeros(std::span<const std::uint8_t> payload) noexcept {
  std::size_t length = payload.size();
  while (length > 1 && payload[length - 1] == 0) --length;
  return length;
}

}  // namespace

Packet pack(const Message& message, Address from, std::uint8_t sequence, std::uint8_t version) noexcept {
  assert(version == 1 || version == 2);
  const Definition& definition = definitions()[message.index()];
  const std::size_t header = version == 1 ? kHeader1 : kHeader2;
  Packet packet;
  std::uint8_t* const bytes = packet.bytes_.data();
  std::uint8_t* const payload = bytes + header;
  std::visit([payload](const auto& content) { write_payload(content, payload); }, message);
  const std::size_t length =
      version == 1 ? definition.base_length : without_trailing_zeros({payload, std::size_t{definition.payload_length}});
  if (version == 1) {
    assert(definition.id <= 255);
    const std::array<std::uint8_t, kHeader1> begin{kMarker1,       static_cast<std::uint8_t>(length),
                                                   sequence,       from.system,
                                                   from.component, static_cast<std::uint8_t>(definition.id)};
    std::ranges::copy(begin, bytes);
  } else {
    const std::array<std::uint8_t, kHeader2> begin{kMarker2,
                                                   static_cast<std::uint8_t>(length),
                                                   0,
                                                   0,
                                                   sequence,
                                                   from.system,
                                                   from.component,
                                                   static_cast<std::uint8_t>(definition.id),
                                                   static_cast<std::uint8_t>(definition.id >> 8),
                                                   static_cast<std::uint8_t>(definition.id >> 16)};
    std::ranges::copy(begin, bytes);
  }
  const std::uint16_t checksum = frame_checksum({bytes, header + length}, definition.crc_extra);
  payload[length] = static_cast<std::uint8_t>(checksum);
  payload[length + 1] = static_cast<std::uint8_t>(checksum >> 8);
  packet.size_ = header + length + kChecksum;
  return packet;
}

std::optional<Message> unpack(const Frame& frame) noexcept {
  const Definition* const definition = find_definition(frame.id);
  if (definition == nullptr) return std::nullopt;
  return kReaders[static_cast<std::size_t>(definition - definitions().data())](frame.payload.data());
}

}  // namespace gatefield::firmware::mavlink
