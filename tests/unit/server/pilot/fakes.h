#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/protocol/messages.h"
#include "server/perception/gate_sensor.h"
#include "server/pilot/pilot.h"
#include "server/planner/planner.h"
#include "tests/support/analytic_field.h"

/// Stand-ins for what a pilot is made of, and messages to feed it with.
namespace gatefield::pilot::testing {

using namespace std::chrono_literals;

/// Plans a constant thrust rate, the same on all rotors, and a constant command for a vehicle of body rates, and
/// remembers what it was asked.
class FakePlanner final : public planner::Planner {
 public:
  /// What the test sees of it and may change while the session owns the planner.
  struct Script {
    double rate_n_s = 1.0;
    RateCommand rate_command = RateCommand::Zero();
    bool ok = true;
    bool not_finite = false;
    int resets = 0;
    planner::PlanInput last;
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
      plan->rate_command[at] = script_->rate_command;
    }
    if (script_->not_finite) plan->thrust_rate_n_s[3][1] = std::nan("");
  }
  void reset() noexcept override { ++script_->resets; }
  planner::WarmStart warm_start() const override {
    return {std::vector<ThrustRates>(mean_size(), ThrustRates::Zero())};
  }
  bool restore(const planner::WarmStart& start) override { return start.mean.size() == mean_size(); }
  const planner::Profile& profile() const noexcept override { return profile_; }

 private:
  std::size_t mean_size() const { return static_cast<std::size_t>(profile_.steps); }

  planner::Profile profile_;
  QuadrotorModel model_;
  std::shared_ptr<Script> script_;
};

/// Sees a gate that faces along x at `center_C`, whatever the image shows.
class FakeSensor final : public perception::GateSensor {
 public:
  /// What the test sees of it and may change while the pilot owns the sensor.
  struct Script {
    int calls = 0;
    std::vector<std::optional<Eigen::Vector3d>> priors;  // where it was told to look, camera frame
    std::size_t pixels = 0;
    std::optional<Eigen::Vector3d> center_C;  // empty: where it is told to look
    float validity = 0.9f;
    float validity_anywhere = 0.9f;
    bool throws = false;
    bool steerable = true;
  };
  explicit FakeSensor(std::shared_ptr<Script> script = std::make_shared<Script>()) : script_(std::move(script)) {}

  bool steerable() const noexcept override { return script_->steerable; }
  std::optional<perception::Observation> look(const perception::View& view, const gates::Expectation& gate,
                                              perception::Where where) override {
    std::optional<Eigen::Vector3d> prior_C;
    if (where == perception::Where::kExpected) prior_C = view.X_WC.inverse() * gate.center_W;
    ++script_->calls;
    script_->priors.push_back(prior_C);
    script_->pixels = view.depth_m.size();
    if (script_->throws) throw std::runtime_error("tensor of the wrong size");
    if ((prior_C ? script_->validity : script_->validity_anywhere) < 0.5f) return std::nullopt;
    const Eigen::Vector3d center_C = script_->center_C.value_or(prior_C.value_or(Eigen::Vector3d(0, 0, 3)));
    perception::Observation seen;
    seen.gate.X_WG.translation() = seen.glimpse_W = view.X_WC * center_C;
    seen.gate.center_sigma_m = 0.05;
    return seen;
  }
  std::shared_ptr<const gates::Field> field(const Eigen::Isometry3d&, const Eigen::Isometry3d& X_WG,
                                            const GateShape& shape) override {
    return std::make_shared<Field>(X_WG, shape);
  }
  perception::FieldSource source_of(const gates::Field& field) const override {
    return {static_cast<const Field&>(field).X_WG, {}};
  }
  Result<std::shared_ptr<const gates::Field>> restore(const perception::FieldSource& source,
                                                      const GateShape& shape) override {
    return std::shared_ptr<const gates::Field>(std::make_shared<Field>(source.X_WF, shape));
  }

 private:
  struct Field final : gates::Field {
    Field(const Eigen::Isometry3d& X_WG_in, const GateShape& shape) : X_WG(X_WG_in), field(X_WG_in, shape) {}
    void evaluate(std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
                  std::span<float> sdf_m) const noexcept override {
      field.evaluate(x_W, y_W, z_W, sdf_m);
    }
    Eigen::Isometry3d X_WG;
    test::AnalyticField field;
  };
  std::shared_ptr<Script> script_;
};

/// Keeps what the newest step believed.
class FakeObserver final : public StepObserver {
 public:
  struct Script {
    int steps = 0;
    Stamp stamp{0};
    std::uint32_t waypoint = 0;
    gates::GateBelief target;
  };
  explicit FakeObserver(std::shared_ptr<Script> script) : script_(std::move(script)) {}
  planner::RolloutObserver* rollouts(std::uint64_t) noexcept override { return nullptr; }
  void made(const StepRecord& record) noexcept override {
    *script_ = {script_->steps + 1, record.stamp, record.waypoint, record.target};
  }

 private:
  std::shared_ptr<Script> script_;
};

/// Four gates along x, 6 m apart, flown twice.
inline Course straight_course() {
  Course course;
  for (int i = 0; i < 4; ++i)
    course.waypoints.push_back({Eigen::Vector3d(5.0 + 6.0 * i, 0, 1.5), Eigen::Vector3d::UnitX(), {}});
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
  frame.encoding = protocol::DepthEncoding::kCounts16;
  for (std::uint32_t i = 0; i < frame.width_px * frame.height_px; ++i) {
    frame.pixels.push_back(static_cast<std::uint8_t>(mm & 0xff));
    frame.pixels.push_back(static_cast<std::uint8_t>(mm >> 8));
  }
  return frame;
}

/// One pilot on fakes, and the client's side of it.
struct Bench {
  explicit Bench(protocol::Timing timing = protocol::Timing::kRealTime,
                 const planner::Profile& profile = small_profile(), const Actuation& actuation = {}) {
    clock.set(1000s);
    PilotParts parts;
    request = join_request("drone", 7, timing);
    request.actuation = actuation;
    parts.request = request;
    parts.session = kId;
    parts.planner = std::make_unique<FakePlanner>(profile, request.quadrotor, planner);
    parts.sensor = std::make_unique<FakeSensor>(sensor);
    parts.observer = std::make_unique<FakeObserver>(observer);
    parts.isa = "avx2";
    parts.now = clock.now();
    pilot = std::make_unique<Pilot>(std::move(parts));
  }
  protocol::VehicleState state(Stamp stamp, const Eigen::Vector3d& p_WB = {0, 0, 1.5}) {
    return hover_state("drone", kId, ++state_sequence, stamp, p_WB);
  }
  protocol::DepthFrame frame(Stamp stamp, std::uint16_t mm = 4000) {
    return depth_frame(request, kId, ++frame_sequence, stamp, mm);
  }
  Intake::Outcome take(const protocol::VehicleState& sample) const {
    return pilot->intake().take_state(sample, clock.now());
  }
  Intake::Outcome take(protocol::DepthFrame& sample) const { return pilot->intake().take_depth(sample, clock.now()); }
  bool look() const { return pilot->looking().look(); }
  bool saw(std::uint32_t waypoint) const { return pilot->looking().sight().records().seen(waypoint); }
  protocol::Telemetry telemetry() const {
    protocol::Telemetry result;
    pilot->fill(clock.now(), &result);
    return result;
  }
  /// A control step whose command is "sent".
  const protocol::ThrustRateCommand* step() {
    const Stamp begin = clock.now();
    const Stepping::Answer answer = pilot->stepping().step(begin);
    wake_at = answer.wake_at;
    if (answer.command) {
      pilot->stepping().solved(clock.now() - begin);
      pilot->stepping().sent(clock.now(), true);
    }
    return answer.command;
  }

  static constexpr std::uint64_t kId = 4711;
  ManualClock clock;
  protocol::SessionRequest request;
  std::shared_ptr<FakePlanner::Script> planner = std::make_shared<FakePlanner::Script>();
  std::shared_ptr<FakeSensor::Script> sensor = std::make_shared<FakeSensor::Script>();
  std::shared_ptr<FakeObserver::Script> observer = std::make_shared<FakeObserver::Script>();
  std::unique_ptr<Pilot> pilot;
  std::uint64_t state_sequence = 0;
  std::uint64_t frame_sequence = 0;
  Stamp wake_at{0};
};

}  // namespace gatefield::pilot::testing
