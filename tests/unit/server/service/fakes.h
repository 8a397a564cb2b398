#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/protocol/messages.h"
#include "server/perception/depth_encoder.h"
#include "server/planner/planner.h"
#include "server/service/service.h"
#include "server/service/session.h"
#include "server/service/sight.h"
#include "server/service/transport.h"

/// Stand-ins for what a session is made of, and messages to feed it with.
namespace gatefield::service::testing {

using namespace std::chrono_literals;

/// Keeps what was sent. Thread-safe.
class FakeTransport final : public Transport {
 public:
  void send(const protocol::SessionReply& reply) override {
    const std::lock_guard lock(mutex_);
    replies_.push_back(reply);
  }
  bool send(const protocol::ThrustRateCommand& command) noexcept override {
    const std::lock_guard lock(mutex_);
    commands_.push_back(command);
    return true;
  }
  bool send(const protocol::Telemetry& telemetry) noexcept override {
    const std::lock_guard lock(mutex_);
    telemetries_.push_back(telemetry);
    return true;
  }
  void forget(const std::string& vehicle) override {
    const std::lock_guard lock(mutex_);
    forgotten_.push_back(vehicle);
  }

  std::vector<protocol::SessionReply> replies() const { return copy(replies_); }
  std::vector<protocol::ThrustRateCommand> commands() const { return copy(commands_); }
  std::vector<protocol::Telemetry> telemetries() const { return copy(telemetries_); }
  std::vector<std::string> forgotten() const { return copy(forgotten_); }
  std::size_t commands_of(std::uint64_t session) const {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(
        std::count_if(commands_.begin(), commands_.end(), [&](const auto& c) { return c.session == session; }));
  }
  std::size_t command_count() const {
    const std::lock_guard lock(mutex_);
    return commands_.size();
  }

 private:
  template <typename T>
  T copy(const T& value) const {
    const std::lock_guard lock(mutex_);
    return value;
  }
  mutable std::mutex mutex_;
  std::vector<protocol::SessionReply> replies_;
  std::vector<protocol::ThrustRateCommand> commands_;
  std::vector<protocol::Telemetry> telemetries_;
  std::vector<std::string> forgotten_;
};

/// Plans a constant thrust rate, the same on all rotors, and remembers what it was asked.
class FakePlanner final : public planner::Planner {
 public:
  /// What the test sees of it and may change while the session owns the planner.
  struct Script {
    double rate_n_s = 1.0;
    bool ok = true;
    bool not_finite = false;
    int resets = 0;
    planner::PlanInput last;
    std::array<const void*, 2> fields{};  // addresses of the fields in the last input
    std::uint64_t plans = 0;
    std::function<void()> during;  // runs inside plan(): time passes, samples come in
  };

  FakePlanner(planner::Profile profile, const QuadrotorModel& model, std::shared_ptr<Script> script)
      : profile_(std::move(profile)), model_(model), script_(std::move(script)) {}

  void plan(const planner::PlanInput& input, planner::Plan* plan) noexcept override {
    script_->last = input;
    ++script_->plans;
    if (script_->during) script_->during();
    plan->steps = profile_.steps;
    plan->ok = script_->ok;
    plan->effective_samples = 12.5;
    plan->lowest_field_m = 0.25;
    QuadrotorState state = input.start;
    for (int k = 0; k < profile_.steps; ++k) {
      const auto at = static_cast<std::size_t>(k);
      plan->thrust_rate_n_s[at] = ThrustRates::Constant(script_->rate_n_s);
      state = step_planner(model_, state, plan->thrust_rate_n_s[at], profile_.step_s);
      plan->state[at] = state;
    }
    if (script_->not_finite) plan->thrust_rate_n_s[3][1] = std::nan("");
  }
  void reset() noexcept override { ++script_->resets; }
  const planner::Profile& profile() const noexcept override { return profile_; }

 private:
  planner::Profile profile_;
  QuadrotorModel model_;
  std::shared_ptr<Script> script_;
};

/// Remembers what it was shown; believes centres at once.
class FakeMemory final : public Memory {
 public:
  struct Script {
    std::map<std::uint32_t, planner::GateBelief> known;  // by waypoint, as the planner would see them
    std::map<std::uint32_t, Stamp> stamps;
    std::map<std::uint32_t, int> observations;
    double threshold = 0.5;
  };
  FakeMemory(Course course, std::shared_ptr<Script> script) : course_(std::move(course)), script_(std::move(script)) {}

  Eigen::Vector3d expected_center_W(std::uint32_t waypoint) const noexcept override {
    const auto found = script_->known.find(waypoint);
    return found == script_->known.end() ? course_.waypoints[waypoint].p_W : found->second.center_W;
  }
  bool seen(std::uint32_t waypoint) const noexcept override { return script_->known.count(waypoint) > 0; }
  perception::GateMemory::Outcome observe(std::uint32_t waypoint, const perception::Encoding& encoding,
                                          const Eigen::Isometry3d& X_WC, Stamp capture) override {
    ++script_->observations[waypoint];
    if (encoding.validity < script_->threshold) return perception::GateMemory::Outcome::kNotValid;
    planner::GateBelief& belief = script_->known[waypoint];
    belief.center_W = X_WC * encoding.center_C.cast<double>();
    belief.axis_W = Eigen::Vector3d::UnitX();
    belief.seen = true;
    belief.center_sigma_m = 0.05;
    script_->stamps[waypoint] = capture;
    return perception::GateMemory::Outcome::kTaken;
  }
  void snapshot(std::uint32_t target, std::uint32_t next, perception::MemorySnapshot* out) const override {
    const std::array<std::uint32_t, 2> waypoints{target, next};
    for (std::size_t i = 0; i < 2; ++i) {
      const auto found = script_->known.find(waypoints[i]);
      out->gates[i].seen = found != script_->known.end();
      if (!out->gates[i].seen) continue;
      out->gates[i].center_W = found->second.center_W;
      out->gates[i].axis_W = found->second.axis_W;
      out->gates[i].center_sigma_m = found->second.center_sigma_m;
      out->gates[i].stamp = script_->stamps[waypoints[i]];
    }
  }

 private:
  Course course_;
  std::shared_ptr<Script> script_;
};

/// Sees a gate at `center_C`, whatever the image shows.
class FakeEncoder final : public perception::DepthEncoder {
 public:
  std::optional<perception::Encoding> encode(std::span<const float> depth_m, const CameraModel&,
                                             const std::optional<Eigen::Vector3d>& prior_C) override {
    ++calls;
    priors.push_back(prior_C);
    pixels = depth_m.size();
    if (throws) throw std::runtime_error("tensor of the wrong size");
    if (prior_C ? nothing_at_prior : nothing_without_prior) return std::nullopt;
    perception::Encoding encoding;
    encoding.center_C = center_C ? center_C->cast<float>() : prior_C.value_or(Eigen::Vector3d(0, 0, 3)).cast<float>();
    encoding.validity = prior_C ? validity : validity_without_prior;
    return encoding;
  }
  int calls = 0;
  std::vector<std::optional<Eigen::Vector3d>> priors;
  std::size_t pixels = 0;
  std::optional<Eigen::Vector3d> center_C;  // empty: where the prior says
  float validity = 0.9f;
  float validity_without_prior = 0.9f;
  bool nothing_at_prior = false;
  bool nothing_without_prior = false;
  bool throws = false;
};

/// Four gates along x, 6 m apart, flown twice.
inline Course straight_course() {
  Course course;
  for (int i = 0; i < 4; ++i)
    course.waypoints.push_back({Eigen::Vector3d(5.0 + 6.0 * i, 0, 1.5), Eigen::Vector3d::UnitX()});
  course.laps = 2;
  return course;
}

inline protocol::SessionRequest join_request(const std::string& vehicle = "drone", std::uint64_t number = 7,
                                             protocol::Timing timing = protocol::Timing::kRealTime) {
  protocol::SessionRequest request;
  request.vehicle = vehicle;
  request.request = number;
  request.timing = timing;
  request.profile = "race";
  request.camera = default_camera();
  request.camera.width_px = 32;  // small images keep the tests fast
  request.camera.height_px = 18;
  request.camera.fx_px /= 5.0;
  request.camera.fy_px /= 5.0;
  request.camera.cx_px = 16.0;
  request.camera.cy_px = 9.0;
  request.course = straight_course();
  return request;
}

inline planner::Profile small_profile() {
  planner::Profile profile;
  profile.name = "race";
  profile.control_rate_hz = 100.0;
  return profile;
}

/// Hovering at the start, level, looking along x.
inline protocol::VehicleState hover_state(const std::string& vehicle, std::uint64_t session, std::uint64_t sequence,
                                          Stamp stamp, const Eigen::Vector3d& p_WB = {0, 0, 1.5}) {
  protocol::VehicleState state;
  state.vehicle = vehicle;
  state.session = session;
  state.sequence = sequence;
  state.stamp = stamp;
  state.state.p_WB = p_WB;
  state.state.thrust_n = state.state.thrust_command_n = hover_thrust_n(QuadrotorModel{});
  return state;
}

inline protocol::DepthFrame depth_frame(const protocol::SessionRequest& request, std::uint64_t session,
                                        std::uint64_t sequence, Stamp stamp, std::uint16_t mm = 4000) {
  protocol::DepthFrame frame;
  frame.vehicle = request.vehicle;
  frame.session = session;
  frame.sequence = sequence;
  frame.stamp = stamp;
  frame.width_px = static_cast<std::uint32_t>(request.camera.width_px);
  frame.height_px = static_cast<std::uint32_t>(request.camera.height_px);
  frame.encoding = protocol::DepthEncoding::kMillimetres16;
  for (std::uint32_t i = 0; i < frame.width_px * frame.height_px; ++i) {
    frame.pixels.push_back(static_cast<std::uint8_t>(mm & 0xff));
    frame.pixels.push_back(static_cast<std::uint8_t>(mm >> 8));
  }
  return frame;
}

/// One session on fakes, and the client's side of it.
struct Bench {
  explicit Bench(protocol::Timing timing = protocol::Timing::kRealTime, planner::Profile profile = small_profile()) {
    clock.set(1000s);
    SessionParts parts;
    parts.request = request = join_request("drone", 7, timing);
    parts.id = kId;
    parts.planner = std::make_unique<FakePlanner>(profile, request.quadrotor, planner);
    parts.memory = std::make_unique<FakeMemory>(request.course, memory);
    parts.isa = "avx2";
    parts.clock = &clock;
    session = std::make_unique<Session>(std::move(parts));
  }
  protocol::VehicleState state(Stamp stamp, const Eigen::Vector3d& p_WB = {0, 0, 1.5}) {
    return hover_state("drone", kId, ++state_sequence, stamp, p_WB);
  }
  protocol::DepthFrame frame(Stamp stamp, std::uint16_t mm = 4000) {
    return depth_frame(request, kId, ++frame_sequence, stamp, mm);
  }
  protocol::Telemetry telemetry() {
    protocol::Telemetry result;
    session->fill(clock.now(), &result);
    return result;
  }
  /// A control step whose command is "sent".
  const protocol::ThrustRateCommand* step() {
    const Session::Answer answer = session->step(clock.now());
    wake_at = answer.wake_at;
    if (answer.command) session->sent(clock.now(), true);
    return answer.command;
  }

  static constexpr std::uint64_t kId = 4711;
  ManualClock clock;
  protocol::SessionRequest request;
  std::shared_ptr<FakePlanner::Script> planner = std::make_shared<FakePlanner::Script>();
  std::shared_ptr<FakeMemory::Script> memory = std::make_shared<FakeMemory::Script>();
  FakeEncoder encoder;
  std::unique_ptr<Session> session;
  std::uint64_t state_sequence = 0;
  std::uint64_t frame_sequence = 0;
  Stamp wake_at{0};
};

}  // namespace gatefield::service::testing
