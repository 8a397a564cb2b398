#include "tests/unit/server/pilot/flight.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>

#include "common/config/course.h"
#include "common/config/locate.h"
#include "common/course/course.h"
#include "server/kernels/backend.h"
#include "server/perception/learned/learned_sensor.h"
#include "server/planner/profile_file.h"
#include "tests/support/drawn_gates.h"

namespace gatefield::pilot::testing {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kSession = 0x9e3779b97f4a7c15;
constexpr Stamp kStart = 50s;
constexpr Stamp kServerAhead = 1000s;  ///< server's clock less the vehicle's
constexpr Stamp kUp = 4ms;             ///< from the vehicle to the server, in real time
constexpr int kSamples = 192;

template <typename T>
T value_of(Result<T> result) {
  if (result) return std::move(result).value();
  std::cerr << result.error() << "\n";
  std::exit(2);
}

void add(std::string* text, double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, " %a", value);
  *text += buffer;
}

}  // namespace

const Shipped& shipped() {
  static const Shipped made = [] {
    auto bundle = value_of(model::Bundle::read(GATEFIELD_SOURCE_DIR "/deploy/models/race"));
    auto encoders = value_of(perception::EncoderPool::create(bundle, 1));
    const config::Track track = value_of(config::load_track(value_of(config::find_config("courses", "circle"))));
    Shipped out{std::move(bundle),
                std::move(encoders),
                value_of(planner::load_profile(GATEFIELD_SOURCE_DIR "/deploy/config/profiles/race.txt")),
                {},
                track.start_p_WB,
                track.start_yaw_rad};
    out.profile.samples = kSamples;
    out.request.vehicle = "drone";
    out.request.request = 7;
    out.request.profile = "race";
    out.request.camera = default_camera();
    out.request.course = track.course;
    return out;
  }();
  return made;
}

Flight::Flight(protocol::Timing timing, const Conditions& conditions, int laps)
    : request_(shipped().request), conditions_(conditions), now_(kStart) {
  request_.timing = timing;
  if (laps > 0) request_.course.laps = laps;
  request_.actuation = conditions.actuation;
  for (std::size_t i = 0; i < request_.course.waypoints.size(); ++i) {
    Eigen::Isometry3d X_WG = gate_pose(request_.course.waypoints[i].p_W, passing_direction(request_.course, i));
    X_WG.translation() += Eigen::Vector3d(0.15, i % 2 == 0 ? -0.2 : 0.1, 0.1);
    X_WG.linear() = X_WG.linear() * Eigen::AngleAxisd(i % 2 == 0 ? 0.2 : -0.15, Eigen::Vector3d::UnitZ());
    gates_.push_back(X_WG);
  }
  state_.p_WB = shipped().start_p_WB;
  state_.q_WB = Eigen::AngleAxisd(shipped().start_yaw_rad, Eigen::Vector3d::UnitZ());
  state_.thrust_n = state_.thrust_command_n = hover_thrust_n(request_.quadrotor);
}

std::unique_ptr<Pilot> Flight::make_pilot() const {
  PilotParts parts;
  parts.request = request_;
  parts.session = kSession;
  parts.planner = value_of(planner::Planner::create(shipped().profile, request_.quadrotor, request_.course,
                                                    shipped().bundle.manifest().cone_angle_rad, request_.seed,
                                                    {.actuation = request_.actuation}));
  parts.sensor = std::make_unique<perception::LearnedSensor>(
      &shipped().bundle, kernels::best_backend().prepare(shipped().bundle.decoder()), shipped().encoders.get());
  parts.isa = "any";
  parts.model_hash = shipped().bundle.hash();
  parts.now = kStart + kServerAhead;
  return std::make_unique<Pilot>(std::move(parts));
}

const Stepping::Answer& Flight::feed(Pilot* pilot, Event event) {
  events_.push_back(std::move(event));
  return answer_ = pilot->feed(events_.back());
}

void Flight::simulate(Stamp until) {
  for (; now_ < until; now_ += 1ms) {
    // The newest plan that has begun.
    while (plans_.size() > 1 && plans_[1].plan_start <= now_) plans_.pop_front();
    const protocol::ThrustRateCommand* plan = plans_.empty() ? nullptr : &plans_[0];
    if (plan != nullptr && (now_ < plan->plan_start || now_ >= plan->plan_start + plan->validity)) plan = nullptr;
    const auto k = plan == nullptr ? 0 : static_cast<std::size_t>((now_ - plan->plan_start) / plan->plan_step);
    // In the air's own frame.
    state_.v_WB -= conditions_.wind_W_m_s;
    if (request_.actuation.kind == Actuation::Kind::kBodyRates) {
      RateCommand asked = hover_command(request_.quadrotor);
      if (plan != nullptr) asked << plan->collective_thrust_n[k], plan->body_rates_rad_s[k];
      state_ = step_body_rates(conditions_.plant, request_.actuation, state_, asked, asked, 1e-3);
    } else {
      const ThrustRates rates = plan == nullptr ? ThrustRates(ThrustRates::Zero()) : plan->thrust_rate_n_s[k];
      state_ = step_reference(conditions_.plant, state_, rates, 1e-3);
    }
    state_.v_WB += conditions_.wind_W_m_s;
    state_.p_WB += 1e-3 * conditions_.wind_W_m_s;
  }
}

QuadrotorState Flight::estimate() {
  const auto error = [this](double sigma) {
    const double x = noise_.normal(), y = noise_.normal(), z = noise_.normal();
    return Eigen::Vector3d(sigma * Eigen::Vector3d(x, y, z));
  };
  QuadrotorState state = state_;
  state.p_WB += error(conditions_.position_sigma_m);
  state.v_WB += error(conditions_.velocity_sigma_m_s);
  state.w_WB_B += error(conditions_.rate_sigma_rad_s);
  if (const Eigen::Vector3d turn = error(conditions_.attitude_sigma_rad); turn.norm() > 0.0)
    state.q_WB = Eigen::Quaterniond(state.q_WB) * Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  return state;
}

void Flight::send_frame(Pilot* pilot, Stamp at) {
  const Eigen::Isometry3d X_WC = Eigen::Translation3d(state_.p_WB) * state_.q_WB * request_.camera.X_BC;
  const std::vector<float> depth_m = test::draw_gates(request_.camera, X_WC, gates_, request_.course.waypoints[0].gate);
  protocol::DepthFrame frame;
  frame.vehicle = request_.vehicle;
  frame.session = kSession;
  frame.sequence = ++frames_;
  frame.stamp = now_;
  frame.width_px = static_cast<std::uint32_t>(request_.camera.width_px);
  frame.height_px = static_cast<std::uint32_t>(request_.camera.height_px);
  frame.encoding = protocol::DepthEncoding::kMetres32;
  frame.pixels.resize(depth_m.size() * sizeof(float));
  std::memcpy(frame.pixels.data(), depth_m.data(), frame.pixels.size());
  feed(pilot, FrameArrived{at, std::move(frame)});
}

void Flight::send_state(Pilot* pilot, Stamp at, bool with_frame) {
  protocol::VehicleState state;
  state.vehicle = request_.vehicle;
  state.session = kSession;
  state.sequence = ++states_;
  state.stamp = now_;
  state.state = estimate();
  state.thrust_known = false;
  state.round_trip = step_ > 2 ? 20ms + 2 * conditions_.each_way + (step_ % 3) * 1ms : 0ms;
  state.depth_sequence = with_frame ? frames_ : 0;
  feed(pilot, StateArrived{at, std::move(state)});
}

void Flight::tick(Pilot* pilot, Stamp at, std::vector<std::string>* commands) {
  const Stepping::Answer answer = feed(pilot, Ticked{at});
  if (!answer.command) return;
  const Stamp took = 3ms + (step_ * 7 % 5) * 400us;
  feed(pilot, Solved{took});
  feed(pilot, Sent{at + took, true});
  command_ = *answer.command;
  plans_.push_back(command_);
  problems_ |= command_.health.problems;
  commands->push_back(text_of(command_));
}

std::vector<std::string> Flight::fly(Pilot* pilot, int steps) {
  std::vector<std::string> commands;
  const bool lockstep = request_.timing == protocol::Timing::kLockstep;
  for (int i = 0; i < steps; ++i, ++step_) {
    const bool with_frame = step_ % 2 == 0;
    const Stamp at = now_ + kServerAhead + kUp;
    if (with_frame) send_frame(pilot, at);
    if (lockstep || step_ % 11 != 10) send_state(pilot, at, with_frame);  // some states are lost
    // In real time a frame is looked at after the tick that follows it, on two occasions of three.
    const bool late = !lockstep && step_ % 3 != 0;
    if (!late) feed(pilot, Looked{5ms});
    tick(pilot, at + (lockstep ? 0ms : 2ms), &commands);
    if (late) feed(pilot, Looked{5ms});
    simulate(now_ + 20ms);
  }
  return commands;
}

std::string text_of(const protocol::ThrustRateCommand& command) {
  std::string text = std::to_string(command.sequence) + " " + std::to_string(command.answers_sequence) + " " +
                     std::to_string(command.answers_stamp.count()) + " " + std::to_string(command.plan_start.count()) +
                     " " + std::to_string(command.validity.count());
  for (std::size_t k = 0; k < static_cast<std::size_t>(command.steps); ++k) {
    for (int i = 0; i < kRotors; ++i) add(&text, command.thrust_rate_n_s[k][i]);
    for (int i = 0; i < kRotors; ++i) add(&text, command.rotor_thrust_n[k][i]);
    add(&text, command.collective_thrust_n[k]);
    for (int i = 0; i < 3; ++i) add(&text, command.body_rates_rad_s[k][i]);
  }
  const protocol::PlannerHealth& health = command.health;
  for (const double value :
       {health.solve_time_s, health.effective_samples, health.lowest_field_m, health.latent_age_s, health.state_age_s})
    add(&text, value);
  return text + " " + std::to_string(health.target_waypoint) + " " + std::to_string(health.lap) +
         (health.course_done ? " done" : "") + (health.degraded ? " degraded" : "");
}

}  // namespace gatefield::pilot::testing
