#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"
#include "common/protocol/messages.h"

namespace gatefield::protocol {

/// What a server tells the others of its domain, a few times a second: who has most room answers a newcomer first.
/// Nothing on the control path depends on it, and who lies in it gains no more than a moment's wait of the others.
struct ServerStatus {
  std::uint32_t version = kVersion;
  std::string name;
  double room_cores = 0.0;  ///< what newcomers may take, 0 to kMaxRoom_cores
  std::uint32_t sessions = 0;
  bool accepts = false;  ///< takes newcomers at all
  std::string isa;       ///< instruction set of the kernels
  std::uint64_t model_hash = 0;
};
inline constexpr double kMaxRoom_cores = 1024.0;
inline constexpr std::uint32_t kMaxSessions = 65'536;

/// As validate() of the other messages (validate.h): run on every sample before anything uses it.
Status validate(const ServerStatus& status);

}  // namespace gatefield::protocol
