#pragma once

#include "common/base/clock.h"
#include "common/base/logging.h"
#include "common/base/rate_limiter.h"
#include "common/dds/server_endpoint.h"
#include "server/service/service.h"
#include "server/service/transport.h"

namespace gatefield::app {

/// Joins the service to the wire: the one place where both are known.
/// Thread-safe: as ServerEndpoint and Service are, once attach() was called.
class DdsTransport final : public service::Transport, public dds::ServerHandler {
 public:
  /// Both before the first sample can be sent; the service before the endpoint is created, because that begins to hear
  /// at once.
  void attach(service::Service* service) noexcept { service_ = service; }
  void attach(dds::ServerEndpoint* endpoint) noexcept { endpoint_ = endpoint; }

  // What the service says.
  void send(const protocol::SessionReply& reply) override {
    if (const Status status = endpoint_->publish(reply); !status) log::error(status.error());
  }
  bool send(const protocol::ThrustRateCommand& command) noexcept override { return endpoint_->publish(command); }
  bool send(const protocol::Telemetry& telemetry) noexcept override { return endpoint_->publish(telemetry); }
  void tell_servers(const protocol::ServerStatus& status) override { endpoint_->publish(status); }
  void forget(const std::string& vehicle) override { endpoint_->drop_vehicle(vehicle); }
  bool tell(const protocol::PilotRecord& record) override { return endpoint_->publish(record); }
  Status follow(const std::string& vehicle, std::uint64_t request, std::uint32_t take_overs) override {
    return endpoint_->follow(vehicle, request, take_overs);
  }

  // What vehicles say.
  void on_session_request(const protocol::SessionRequest& request, const Status& verdict) override {
    service_->on_request(request, verdict);
  }
  void on_state(const protocol::VehicleState& state) override { service_->on_state(state); }
  void on_depth(protocol::DepthFrame& frame) override { service_->on_depth(frame); }
  void on_vehicle_gone(const std::string& vehicle, std::uint64_t request) override {
    service_->on_gone(vehicle, request);
  }
  void on_server_status(const dds::ParticipantId& from, const protocol::ServerStatus& status) override {
    service_->on_server_status(from.bytes, status);
  }
  void on_namesake(const dds::ParticipantId& participant) override {
    unsigned held = 0;
    if (!namesakes_.admit(MonotonicClock().now(), &held)) return;
    log::warn("another server of this name is in the domain, participant " + in_words(participant) +
              (held > 0 ? " (and " + std::to_string(held) + " others)" : "") +
              ": vehicles tell them apart, people don't; expected a name of its own for each (--name)");
  }

  // What other servers say.
  void on_heir(const std::optional<dds::ParticipantId>& heir) override {
    log::info(heir ? "the stand-by is there, participant " + in_words(*heir) : std::string("the stand-by is gone"));
    service_->on_heir(heir.has_value());
  }
  void on_leader(const std::optional<dds::ParticipantId>& leader, bool ours_first) override {
    log::info(leader ? "the leader is there, participant " + in_words(*leader) : std::string("the leader is gone"));
    service_->on_leader(leader.has_value(), ours_first);
  }
  void on_record(const protocol::PilotRecord& record) override { service_->on_record(record); }
  void on_leader_command(const protocol::ThrustRateCommand& command) override { service_->on_leader_command(command); }

  void on_rejected(dds::Topic topic, const std::string& vehicle, const Error& why) override {
    using Kind = service::Service::Kind;
    const Kind kind = topic == dds::Topic::kVehicleState ? Kind::kState
                      : topic == dds::Topic::kDepthFrame ? Kind::kDepth
                                                         : Kind::kOther;
    service_->on_rejected(kind, vehicle, why);
  }

 private:
  service::Service* service_ = nullptr;
  dds::ServerEndpoint* endpoint_ = nullptr;
  RateLimiter namesakes_;
};

}  // namespace gatefield::app
