#include "tests/bench/dds/vehicle.h"

#include <algorithm>
#include <cstdio>

#include "common/geometry/gate.h"
#include "common/vehicle/quadrotor.h"
#include "tests/support/messages.h"

namespace gatefield::bench {
namespace {

/// A gate 3 m before the vehicle, before a wall at 8 m.
void draw_gate(const CameraModel& camera, protocol::DepthFrame* frame) {
  frame->width_px = static_cast<std::uint32_t>(camera.width_px);
  frame->height_px = static_cast<std::uint32_t>(camera.height_px);
  frame->encoding = protocol::DepthEncoding::kCounts16;
  frame->pixels.clear();
  const GateShape shape;
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const Eigen::Vector3d origin_B = camera.X_BC.translation(), ray_B = camera.X_BC.linear() * camera.ray_C(u, v);
      const double t = (3.0 - origin_B.x()) / ray_B.x(), wall = (8.0 - origin_B.x()) / ray_B.x();
      const double r = transverse_distance(shape, origin_B + t * ray_B);
      const auto mm = static_cast<std::uint16_t>(
          1e3 * (r >= shape.inner_half_m && r <= shape.outer_half_m ? t : std::min(wall, 9.9)));
      frame->pixels.push_back(static_cast<std::uint8_t>(mm & 0xff));
      frame->pixels.push_back(static_cast<std::uint8_t>(mm >> 8));
    }
  }
}

}  // namespace

Vehicle::Vehicle(std::string name) : name_(std::move(name)), sent_(kUnderWay) {
  state_ = test::good_state(name_, 0);
  state_.state = QuadrotorState{};
  state_.state.p_WB = {0, 0, 1.5};
  state_.state.v_WB = {1, 0, 0};
  state_.thrust_known = true;
  state_.round_trip = Stamp(0);
  state_.heard_waypoint = state_.heard_lap = 0;
  state_.depth_sequence = 0;
  frame_ = test::good_frame(name_, 0);
  draw_gate(default_camera(), &frame_);
}

Vehicle::~Vehicle() = default;

bool Vehicle::ask(const Wire& wire, protocol::Timing timing, const std::string& profile) {
  endpoint_ = open<dds::ClientEndpoint>(wire, name_, static_cast<dds::ClientHandler*>(this));
  if (!endpoint_) return false;
  auto request = test::good_request(name_);
  request.timing = timing;
  request.profile = profile;
  request.course.waypoints = {{{3, 0, 1.5}, {1, 0, 0}}, {{8, 0, 1.5}, {1, 0, 0}}};
  state_.state.thrust_n = state_.state.thrust_command_n = hover_thrust_n(request.quadrotor);
  const Status asked = endpoint_->publish(request);
  if (!asked) std::fprintf(stderr, "gatefield-dds-bench: %s\n", asked.error().c_str());
  return asked.ok();
}

bool Vehicle::joined(std::chrono::nanoseconds timeout) {
  std::unique_lock lock(mutex_);
  replied_.wait_for(lock, timeout, [this] { return reply_.has_value(); });
  if (!reply_) {
    std::fprintf(stderr, "gatefield-dds-bench: %s got no answer\n", name_.c_str());
    return false;
  }
  if (!reply_->accepted || reply_->server != kServer) {
    std::fprintf(stderr, "gatefield-dds-bench: server \"%s\" answered %s (\"%s\"), expected \"%s\" to accept\n",
                 reply_->server.c_str(), name_.c_str(), reply_->reason.c_str(), kServer);
    return false;
  }
  state_.session = frame_.session = reply_->session;
  return true;
}

std::uint64_t Vehicle::send_state(Stamp stamp) {
  state_.stamp = stamp;
  ++state_.sequence;
  sent_[state_.sequence % kUnderWay] = now().count();
  endpoint_->publish(state_);
  return state_.sequence;
}

void Vehicle::send_frame(Stamp stamp) {
  frame_.stamp = stamp;
  state_.depth_sequence = ++frame_.sequence;
  endpoint_->publish(frame_);
}

std::vector<Vehicle::Answer> Vehicle::answers(std::uint64_t first) const {
  std::vector<Answer> answers;
  const std::lock_guard lock(mutex_);
  for (const Heard& heard : heard_)
    if (heard.state >= first) answers.push_back(heard.answer);
  return answers;
}

std::optional<protocol::Telemetry> Vehicle::told() const {
  const std::lock_guard lock(mutex_);
  return told_;
}

void Vehicle::on_reply(const protocol::SessionReply& reply, const dds::ParticipantId&) {
  const std::lock_guard lock(mutex_);
  reply_ = reply;
  replied_.notify_all();
}

void Vehicle::on_command(const protocol::ThrustRateCommand& command, const dds::ParticipantId&) {
  const Stamp came = now();
  const Stamp left(sent_[command.answers_sequence % kUnderWay]);
  const std::lock_guard lock(mutex_);
  heard_.push_back({command.answers_sequence, {seconds(came - left), command.health.solve_time_s}});
}

void Vehicle::on_telemetry(const protocol::Telemetry& telemetry) {
  const std::lock_guard lock(mutex_);
  told_ = telemetry;
}

void Vehicle::on_rejected(dds::Topic topic, const std::string& reason) {
  std::fprintf(stderr, "gatefield-dds-bench: %s: %s\n", dds::topic_name(topic), reason.c_str());
}

}  // namespace gatefield::bench
