#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

/// What DDS security sends before anybody is authenticated. The library makes room for as many elements as such a
/// message says (CVE-2025-62599 to -62603), so their counts and lengths are read before.
namespace gatefield::dds {

/// Whether a token (DDS security 1.1, 7.2.3.1 DataHolder) stays within its bytes.
/// Thread-safe: yes.   Real-time safe: yes.
bool check_token(std::span<const std::uint8_t> token, bool little_endian) noexcept;

/// Whether a message of the handshake (7.4.3.5 ParticipantGenericMessage, with its encapsulation) stays within its
/// bytes. Thread-safe: yes.   Real-time safe: yes.
bool check_handshake(std::span<const std::uint8_t> message) noexcept;

}  // namespace gatefield::dds
