#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "common/dds/endpoint.h"
#include "common/protocol/messages.h"

namespace gatefield::dds {

/// What a client hears, for its own vehicle only. Every sample was converted and validated before it gets here.
/// Calls come from threads of the middleware: store and return, never block, never call the endpoint from inside.
/// Calls for one topic never overlap; calls for different topics may.
class ClientHandler {
 public:
  virtual ~ClientHandler() = default;
  /// @param from  the participant that sent it
  virtual void on_reply(const protocol::SessionReply& reply, const ParticipantId& from) = 0;
  /// Whether commands and telemetry of this participant are wanted. What others send is dropped before it can displace
  /// anything, whatever its ownership strength. Called with the middleware's locks held: no waiting, no allocation.
  virtual bool hears(const ParticipantId& from) noexcept {
    static_cast<void>(from);
    return true;
  }
  /// @param from  the participant that sent it
  virtual void on_command(const protocol::ThrustRateCommand& command, const ParticipantId& from) = 0;
  virtual void on_telemetry(const protocol::Telemetry& telemetry) = 0;
  virtual void on_rejected(Topic topic, const std::string& reason) = 0;
};

/// A vehicle's end of the wire.
/// Thread-safe: yes.   Real-time safe: no (system calls); states and depth frames of a size seen before do not allocate
/// here.
class ClientEndpoint {
 public:
  /// Joins the domain. Fails with a sentence when the name or the domain is out of range or the middleware refuses.
  /// @param handler  must outlive the endpoint; may be called before create() returns.
  static Result<std::unique_ptr<ClientEndpoint>> create(std::uint32_t domain, const std::string& vehicle,
                                                        ClientHandler* handler, const TransportOptions& transport = {});
  virtual ~ClientEndpoint() = default;  ///< withdraws the request: the server then sees the vehicle go

  /// The request stays with the writer: a server that starts later gets it by itself.
  virtual Status publish(const protocol::SessionRequest& request) = 0;
  virtual bool publish(const protocol::VehicleState& state) = 0;
  /// Hands the image to the sender's thread and returns within 5 ms. `frame.pixels` is lent during the call and comes
  /// back as it was.
  virtual bool publish(protocol::DepthFrame& frame) = 0;
};

}  // namespace gatefield::dds
