#include "common/protocol/server_status.h"

#include "common/base/text.h"
#include "common/protocol/validate.h"

namespace gatefield::protocol {

Status validate(const ServerStatus& status) {
  if (status.version != kVersion)
    return Error::invalid("version", text(status.version), text(kVersion) + " (the protocol version of this program)",
                          ErrorCode::kVersion);
  if (auto s = validate_name("name", status.name); !s) return s;
  if (!(status.room_cores >= 0.0 && status.room_cores <= kMaxRoom_cores))
    return Error::invalid("room_cores", text(status.room_cores), "0 to " + text(kMaxRoom_cores) + " cores");
  if (status.sessions > kMaxSessions)
    return Error::invalid("sessions", text(status.sessions), "at most " + text(kMaxSessions));
  if (status.isa.size() > 15 || !printable(status.isa))
    return Error::invalid("isa", "a text of " + text(status.isa.size()) + " characters", "at most 15 printable ones");
  return {};
}

}  // namespace gatefield::protocol
