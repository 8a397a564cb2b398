#include "common/dds/token_check.h"

#include "common/dds/packet_fields.h"

namespace gatefield::dds {
namespace {

// Of a message: its identity and that of the one it answers (a GUID and a number each), and three GUIDs.
constexpr std::size_t kBeforeClass_bytes = 2 * 24 + 3 * 16;

/// Bytes with their length before them, a text or not, and what aligns the next field.
void skip_bytes(Fields* fields) noexcept {
  const std::uint32_t length = fields->u32();
  fields->skip(length);
  const std::size_t aligned = (fields->position() + 3) & ~std::size_t{3};
  fields->skip(std::min(aligned - fields->position(), fields->left()));  // the last may end unaligned
}

/// A count, then as many pairs of bytes. Each pair takes 8 bytes at least, so a count that lies is found at once.
void skip_pairs(Fields* fields) noexcept {
  for (std::uint32_t left = fields->u32(); left > 0 && fields->ok(); --left) {
    skip_bytes(fields);
    skip_bytes(fields);
  }
}

void skip_token(Fields* fields) noexcept {
  skip_bytes(fields);  // its class
  skip_pairs(fields);  // properties
  skip_pairs(fields);  // binary properties
}

}  // namespace

bool check_token(Bytes token, bool little_endian) noexcept {
  Fields fields(token, little_endian);
  skip_token(&fields);
  return fields.ok();
}

bool check_handshake(Bytes message) noexcept {
  if (message.size() < 4 || message[0] != 0 || message[1] > 3) return false;
  Fields fields(message.subspan(4), (message[1] & 1) != 0);
  fields.skip(kBeforeClass_bytes);
  skip_bytes(&fields);
  for (std::uint32_t left = fields.u32(); left > 0 && fields.ok(); --left) skip_token(&fields);
  return fields.ok();
}

}  // namespace gatefield::dds
