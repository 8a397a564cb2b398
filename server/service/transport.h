#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"
#include "common/protocol/messages.h"
#include "common/protocol/pilot_record.h"
#include "common/protocol/server_status.h"

namespace gatefield::service {

/// Where the service's words go. The program puts DDS behind it (server/app/dds_transport.h), tests put a list behind
/// it.
/// Thread-safe: implementations must be; commands of different vehicles come from several control threads at once.
class Transport {
 public:
  virtual ~Transport() = default;

  virtual void send(const protocol::SessionReply& reply) = 0;
  /// @return false when the command could not be handed over; the next one is only a control period away.
  virtual bool send(const protocol::ThrustRateCommand& command) noexcept = 0;
  virtual bool send(const protocol::Telemetry& telemetry) noexcept = 0;
  /// To the other servers of the domain, if there is a way to them.
  virtual void tell_servers(const protocol::ServerStatus& status) { static_cast<void>(status); }
  /// The vehicle's session is over: what was held open for it may be closed. Unknown names are no error.
  virtual void forget(const std::string& vehicle) = 0;

  // ---- servers that have an heir or a leader; the others need none of it
  /// To the heir or to the leader, as the record's kind says. @return false when there is none, or it could not be sent
  virtual bool tell(const protocol::PilotRecord& record) {
    static_cast<void>(record);
    return false;
  }
  /// Whoever sent this request is heard from now on, and a command can go out at once when it has to.
  /// @param take_overs  of the vehicle's session when this server comes to fly it
  virtual Status follow(const std::string& vehicle, std::uint64_t request, std::uint32_t take_overs) {
    static_cast<void>(vehicle), static_cast<void>(request), static_cast<void>(take_overs);
    return Error("this transport follows nobody", ErrorCode::kUnsupported);
  }
};

}  // namespace gatefield::service
