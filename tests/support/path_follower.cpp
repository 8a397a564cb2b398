#include "tests/support/path_follower.h"

#include <algorithm>
#include <cmath>
#include <thread>

namespace gatefield::test {
namespace {

constexpr double kSpacing_m = 0.05;
constexpr Stamp kControlPeriod = std::chrono::milliseconds(20);

}  // namespace

PathFollower::PathFollower(const scene::World& gates, const QuadrotorModel& model, const Options& options)
    : model_(model), options_(options) {
  // A cubic Hermite leg from each gate to the next, leaving and arriving along the gates' axes, resampled to even
  // spacing.
  std::vector<Eigen::Vector3d> fine;
  for (std::size_t i = 0; i < gates.gates.size(); ++i) {
    const auto& X_WA = gates.gates[i].X_WG;
    const auto& X_WB = gates.gates[(i + 1) % gates.gates.size()].X_WG;
    const Eigen::Vector3d a = X_WA.translation(), b = X_WB.translation();
    const double pull_m = 1.1 * (b - a).norm();
    const Eigen::Vector3d da = pull_m * X_WA.linear().col(0), db = pull_m * X_WB.linear().col(0);
    for (int k = 0; k < 1000; ++k) {
      const double t = k / 1000.0, t2 = t * t, t3 = t2 * t;
      fine.emplace_back((2 * t3 - 3 * t2 + 1) * a + (t3 - 2 * t2 + t) * da + (-2 * t3 + 3 * t2) * b + (t3 - t2) * db);
    }
  }
  double travelled_m = 0, next_m = 0;
  for (std::size_t i = 0; i < fine.size(); ++i) {
    if (travelled_m >= next_m) {
      path_W_.push_back(fine[i]);
      next_m += kSpacing_m;
    }
    travelled_m += (fine[(i + 1) % fine.size()] - fine[i]).norm();
  }
}

protocol::SessionReply PathFollower::session() const {
  protocol::SessionReply reply;
  reply.accepted = true;
  reply.session = 1;
  reply.control_period_s = seconds(kControlPeriod);
  reply.plan_step_s = 0.03;
  reply.plan_steps = 20;
  return reply;
}

void PathFollower::take_frame(Stamp stamp, std::size_t valid_pixels) {
  const std::lock_guard lock(mutex_);
  received_.frames.push_back(stamp);
  received_.valid_pixels += valid_pixels;
}

std::uint64_t PathFollower::send_depth(Stamp stamp, std::span<const float> depth_m) {
  take_frame(stamp,
             static_cast<std::size_t>(std::count_if(depth_m.begin(), depth_m.end(), [](float d) { return d > 0; })));
  return received().frames.size();
}

std::uint64_t PathFollower::send_depth_counts(Stamp stamp, std::span<const std::uint16_t> counts) {
  take_frame(stamp, static_cast<std::size_t>(
                        std::count_if(counts.begin(), counts.end(), [](std::uint16_t d) { return d > 0; })));
  return received().frames.size();
}

std::uint64_t PathFollower::send_state(Stamp stamp, const QuadrotorState& state, bool thrust_known) {
  const std::lock_guard lock(mutex_);
  if (received_.states.empty()) received_.first = state;
  received_.thrust_known = thrust_known;
  received_.states.push_back(stamp);
  if (received_.states.size() < options_.silent_from && stamp >= last_answered_ + kControlPeriod) {
    last_answered_ = stamp;
    ++fresh_;
  }
  return received_.states.size();
}

protocol::ThrustRateCommand PathFollower::command() const {
  protocol::ThrustRateCommand command;
  command.sequence = fresh_;
  command.health.solve_time_s = 0.001;
  command.health.effective_samples = 20;
  return command;
}

std::optional<protocol::ThrustRateCommand> PathFollower::newest() {
  const std::lock_guard lock(mutex_);
  if (taken_ == fresh_) return std::nullopt;
  taken_ = fresh_;
  return command();
}

std::optional<protocol::ThrustRateCommand> PathFollower::wait_for_answer(std::uint64_t state_sequence,
                                                                         std::chrono::milliseconds timeout) {
  if (state_sequence >= options_.silent_from) {
    std::this_thread::sleep_for(timeout);
    return std::nullopt;
  }
  std::this_thread::sleep_for(options_.answer_delay);
  return command();
}

sdk::Setpoint PathFollower::play(Stamp, const QuadrotorState& state, std::chrono::nanoseconds) {
  Eigen::Vector3d p_ref = state.p_WB, v_ref = Eigen::Vector3d::Zero(), a_ref = Eigen::Vector3d::Zero();
  Eigen::Vector3d ahead_W = state.q_WB * Eigen::Vector3d::UnitX();
  if (options_.stand_still) {
    if (!hold_W_) hold_W_ = state.p_WB;
    p_ref = *hold_W_;
  } else {
    const std::size_t count = path_W_.size();
    const auto distance = [&](std::size_t i) { return (path_W_[i % count] - state.p_WB).squaredNorm(); };
    if (!located_) {
      for (std::size_t i = 0; i < count; ++i)
        if (distance(i) < distance(nearest_)) nearest_ = i;
      located_ = true;
    }
    while (distance(nearest_ + 1) < distance(nearest_)) ++nearest_;
    nearest_ %= count;
    const auto at = [&](std::size_t i) { return path_W_[i % count]; };
    constexpr std::size_t kReach = 6;  // points of the path that its derivatives are taken over
    const double h = kReach * kSpacing_m;
    const Eigen::Vector3d back = at(nearest_ + count - kReach), here = at(nearest_), front = at(nearest_ + kReach);
    const Eigen::Vector3d tangent = (front - back).normalized();
    p_ref = here + tangent * tangent.dot(state.p_WB - here);  // no error along the path: speed alone decides that
    v_ref = options_.speed_m_s * tangent;
    a_ref = (front - 2 * here + back) / (h * h) * state.v_WB.squaredNorm();
    ahead_W = tangent;
  }
  const Eigen::Vector3d a_W =
      (8.0 * (p_ref - state.p_WB) + 4.5 * (v_ref - state.v_WB) + a_ref).cwiseMax(-12.0).cwiseMin(12.0) +
      Eigen::Vector3d(0, 0, kGravity_m_s2);

  const Eigen::Vector3d z = a_W.normalized();
  const Eigen::Vector3d y = z.cross(ahead_W).normalized();
  Eigen::Matrix3d R_want;
  R_want << y.cross(z), y, z;
  const Eigen::AngleAxisd error(state.q_WB.toRotationMatrix().transpose() * R_want);
  const Eigen::Vector3d w_want = (9.0 * error.angle() * error.axis()).cwiseMax(-8.0).cwiseMin(8.0);
  const Eigen::Vector3d torque = model_.inertia_kg_m2.cwiseProduct(18.0 * (w_want - state.w_WB_B));
  const double collective_n = model_.mass_kg * std::max(0.0, a_W.dot(state.q_WB * Eigen::Vector3d::UnitZ()));

  Eigen::Matrix4d mixer;
  for (int i = 0; i < kRotors; ++i) {
    const auto& arm = model_.rotor_position_B_m[static_cast<std::size_t>(i)];
    mixer.col(i) << 1.0, arm.y(), -arm.x(), model_.rotor_spin[static_cast<std::size_t>(i)] * model_.torque_per_thrust_m;
  }
  const Eigen::Vector4d thrust_n =
      mixer.inverse() * Eigen::Vector4d(collective_n, torque.x(), torque.y(), std::clamp(torque.z(), -0.05, 0.05));

  sdk::Setpoint setpoint;
  const std::lock_guard lock(mutex_);
  setpoint.source =
      received_.states.size() < options_.silent_from ? sdk::Setpoint::Source::kPlan : sdk::Setpoint::Source::kFallback;
  // the rates that bring the commanded thrusts there within 10 ms, as far as the vehicle's limit lets them
  setpoint.thrust_rate_n_s = ((thrust_n - state.thrust_command_n) / 0.01)
                                 .cwiseMax(-model_.thrust_rate_max_n_s)
                                 .cwiseMin(model_.thrust_rate_max_n_s);
  setpoint.rotor_thrust_n = thrust_n;
  setpoint.collective_thrust_n = collective_n;
  setpoint.body_rates_rad_s = w_want;
  return setpoint;
}

std::optional<sdk::ProblemChange> PathFollower::problem_change() {
  const std::lock_guard lock(mutex_);
  if (told_ >= std::min<std::uint64_t>(fresh_, options_.problems.size())) return std::nullopt;
  return options_.problems[told_++];
}

std::optional<sdk::SessionChange> PathFollower::session_change() {
  const std::lock_guard lock(mutex_);
  if (told_sessions_ >= std::min<std::uint64_t>(fresh_, options_.sessions.size())) return std::nullopt;
  return options_.sessions[told_sessions_++];
}

sdk::LinkStatistics PathFollower::statistics() const {
  const std::lock_guard lock(mutex_);
  sdk::LinkStatistics statistics;
  statistics.commands = fresh_;
  statistics.solve_p50_s = statistics.solve_p99_s = 0.001;
  return statistics;
}

PathFollower::Received PathFollower::received() const {
  const std::lock_guard lock(mutex_);
  return received_;
}

}  // namespace gatefield::test
