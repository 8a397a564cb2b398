#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/dds/endpoint.h"
#include "common/dds/pairing.h"
#include "common/protocol/messages.h"
#include "common/protocol/pilot_record.h"
#include "common/protocol/server_status.h"

namespace gatefield::dds {

/// What the planning server hears. Every sample was converted and validated before it gets here, except where said.
/// Calls come from threads of the middleware: store and return, never block, never call the endpoint from inside.
/// Calls for one topic never overlap; calls for different topics may.
class ServerHandler {
 public:
  virtual ~ServerHandler() = default;

  /// A client wants to join or leave. Its name is good; anything else that is wrong with the request stands in
  /// `verdict` (conversion, then protocol::validate), and the server refuses with that sentence. The same request comes
  /// again when the client hears no answer for a while (same number): answer it again in the same way.
  virtual void on_session_request(const protocol::SessionRequest& request, const Status& verdict) = 0;

  virtual void on_state(const protocol::VehicleState& state) = 0;

  /// Name, sequence, stamp, encoding and byte count are consistent in themselves; that the size is the session's
  /// camera's is for protocol::validate(frame, camera). The frame is the handler's for the call: swap `frame.pixels`
  /// with a buffer of your own to take the image without a copy (the buffer given in return is filled next time).
  virtual void on_depth(protocol::DepthFrame& frame) = 0;

  /// The client that sent `request` went away: it disposed of its request, or its participant's lease (3 s) ran out.
  /// When the vehicle's session belongs to another request by now, this is old news.
  virtual void on_vehicle_gone(const std::string& vehicle, std::uint64_t request) = 0;

  /// Another server of this name is in the domain: somebody should give it another one, or stop it. Once for each.
  virtual void on_namesake(const ParticipantId& participant) { static_cast<void>(participant); }

  /// Another server says how it is, a few times a second. Anybody can say so.
  virtual void on_server_status(const ParticipantId& from, const protocol::ServerStatus& status) {
    static_cast<void>(from);
    static_cast<void>(status);
  }

  // ---- from the servers that this one was told of (PartnerNames)
  /// Another participant is our heir, or our leader, from now on; empty: none is.
  virtual void on_heir(const std::optional<ParticipantId>& heir) { static_cast<void>(heir); }
  /// @param ours_first  it stands by for us, too, and newcomers are ours
  virtual void on_leader(const std::optional<ParticipantId>& leader, bool ours_first) {
    static_cast<void>(leader), static_cast<void>(ours_first);
  }
  /// Kinds that a leader says are from our leader, those that an heir says from our heir.
  virtual void on_record(const protocol::PilotRecord& record) { static_cast<void>(record); }
  /// What our leader tells a vehicle, any of its vehicles.
  virtual void on_leader_command(const protocol::ThrustRateCommand& command) { static_cast<void>(command); }

  /// A sample was dropped; `vehicle` is empty when the name itself was bad. Called once per dropped sample: rate-limit
  /// logs.
  virtual void on_rejected(Topic topic, const std::string& vehicle, const Error& why) = 0;
};

/// The planning server's end of the wire: one participant, readers for what clients say, writers for what they are
/// told, one command writer per vehicle in a partition of its own, so that no client gets another vehicle's commands.
///
/// A session belongs to the participant that asked for it (Speakers): states, depth and goodbyes of any other never get
/// to the handler, nor do requests beyond what one participant may ask. Both are told by
/// TransportOptions::on_samples_dropped.
///
/// Thread-safe: yes.   Real-time safe: publish(ThrustRateCommand) does not allocate in this layer after the first call
/// per vehicle, but makes system calls; the others no.
class ServerEndpoint {
 public:
  /// Joins the domain. Fails with a sentence when the name or the domain is out of range, or when the middleware
  /// refuses (no network).
  /// @param handler  must outlive the endpoint; may be called before create() returns.
  /// @param partners  names as protocol::validate_name() has them, or none
  static Result<std::unique_ptr<ServerEndpoint>> create(std::uint32_t domain, const std::string& server_name,
                                                        ServerHandler* handler, const TransportOptions& transport = {},
                                                        const PartnerNames& partners = {});
  virtual ~ServerEndpoint() = default;

  /// Answers a request. An accepted reply names our heir, if there is one. It opens the vehicle's command writer before
  /// it goes out, and states and depth of whoever sent that request are heard from then on. Takes up to half a second
  /// when hundreds of vehicles came and went just before.
  virtual Status publish(const protocol::SessionReply& reply) = 0;
  /// @return false when the vehicle has no command writer (not accepted, or dropped), the command fails validation, or
  /// the middleware refuses it.
  virtual bool publish(const protocol::ThrustRateCommand& command) noexcept = 0;
  virtual bool publish(const protocol::Telemetry& telemetry) noexcept = 0;
  /// To the other servers of the domain.
  virtual bool publish(const protocol::ServerStatus& status) noexcept = 0;

  /// Opens a vehicle's command writer before anything is said on it, and hears states and depth of whoever sent that
  /// request, as an accepted reply does: for an heir, who has no time for it later.
  /// @param take_overs  the writer's commands outweigh those of a server with fewer
  virtual Status follow(const std::string& vehicle, std::uint64_t request, std::uint32_t take_overs) = 0;
  /// To our heir or our leader, as the record's kind says. @return false: there is none, or the middleware refuses
  virtual bool publish(const protocol::PilotRecord& record) = 0;

  /// The session is over: closes the vehicle's command writer and withdraws its reply. Nothing happens for unknown
  /// names.
  virtual void drop_vehicle(const std::string& vehicle) = 0;
};

}  // namespace gatefield::dds
