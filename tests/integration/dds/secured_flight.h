#pragma once

#include <filesystem>
#include <string>

#include "tests/integration/dds/attacked_flight.h"
#include "tests/support/keys.h"

/// A vehicle that flies in a domain that is closed to strangers.
namespace gatefield::dds {

/// Everybody's keys, made once.
inline test::Keys& keys() {
  static test::Keys made("attacks");
  return made;
}
/// Authorities of the same names that nobody here knows.
inline test::Keys& other_keys() {
  static test::Keys made("others");
  return made;
}

inline std::string words_of(Role role) { return role_name(role); }

inline Credentials credentials_of(test::Keys& of, Role role, const std::string& name) {
  return must(read_credentials(of.make(words_of(role), name), {role, name}));
}

class SecuredFlight : public AttackedFlight {
 protected:
  std::string security(Role role, const std::string& name) const override { return keys().make(words_of(role), name); }
};

}  // namespace gatefield::dds
