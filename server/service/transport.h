#pragma once

#include <string>

#include "common/protocol/messages.h"
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
};

}  // namespace gatefield::service
