#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace gatefield::dds {

/// A participant of the domain: the prefix of its GUIDs, drawn anew at each start of a program. Without DDS security it
/// is what a packet claims: nobody takes another's through a DDS library, but whoever forges packets byte by byte does.
struct ParticipantId {
  std::array<std::uint8_t, 12> bytes{};
  friend bool operator==(const ParticipantId&, const ParticipantId&) = default;
  friend bool operator<(const ParticipantId& a, const ParticipantId& b) noexcept { return a.bytes < b.bytes; }
};

/// For people, as DDS tools write it: "01.0f.4c.2b.9d.5e.0a.01.00.00.00.00".
std::string in_words(const ParticipantId& participant);

}  // namespace gatefield::dds
