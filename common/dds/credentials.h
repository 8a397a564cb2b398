#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "common/dds/participant_id.h"

/// Who takes part in a domain that is closed to strangers (docs/security.md): what `gatefield-keys` makes.
namespace gatefield::dds {

/// What a certificate makes of its owner; in words "server", "vehicle", "tool".
enum class Role : std::uint8_t {
  kServer,   ///< answers requests, commands every vehicle
  kVehicle,  ///< asks, says its states and depth, and hears its own commands
  kTool,     ///< hears everything and says nothing
};
const char* role_name(Role role) noexcept;

/// The subject of a certificate: O=Gatefield, OU=role, CN=name.
struct Identity {
  Role role = Role::kVehicle;
  std::string name;
};

/// The first bytes of a participant's id. DDS security makes them of the certificate's subject (9.3.3: 47 bits of its
/// SHA-256), and whoever is authenticated was held to that. So they say whose a sample is, without asking the library.
using IdentityMark = std::array<std::uint8_t, 6>;
IdentityMark mark_of(const Identity& identity);
inline bool bears(const ParticipantId& participant, const IdentityMark& mark) noexcept {
  for (std::size_t i = 0; i < mark.size(); ++i)
    if (participant.bytes[i] != mark[i]) return false;
  return true;
}

/// The files of a participant, all of them there, readable and in order when read_credentials() gave them out.
struct Credentials {
  Identity identity;
  std::filesystem::path identity_authority, permissions_authority, certificate, key, governance, permissions, revoked;
};

/// Reads a folder that `gatefield-keys` made, and checks what the library would accept or ignore, or refuse without
/// saying why: that every file is there, that nobody else may read the key, that key, certificate and permissions
/// belong together, that the authorities (two different ones) signed them and nobody revoked them, that they hold now,
/// that the domain's rules ask for no less than ours do, and that it is this identity's folder.
/// @param wanted  who the program says it is; an empty name: whoever the certificate says, of that role
/// Errors: field "security", the file in the sentence, and what to do.   Thread-safe: yes.   Real-time safe: no.
Result<Credentials> read_credentials(const std::filesystem::path& folder, const Identity& wanted);

}  // namespace gatefield::dds
