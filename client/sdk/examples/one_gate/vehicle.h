#pragma once

#include <gatefield/sdk/client.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

/// A simulated quadrotor in front of one gate, with what a real one has: a clock, a depth camera, a state estimate and
/// motors that hold the thrusts they were given last. It knows where the gate stands; nobody tells the server.
class SimulatedVehicle {
 public:
  /// @param real_time  its clock is the machine's; else time passes in sleep_until() only
  SimulatedVehicle(const gatefield::QuadrotorModel& model, const gatefield::CameraModel& camera,
                   const gatefield::GateShape& shape, const Eigen::Vector3d& p_WG, bool real_time)
      : model_(model), camera_(camera), shape_(shape), p_WG_(p_WG), real_time_(real_time) {
    state_.p_WB = {0, 0, 1.5};
    state_.thrust_n = state_.thrust_command_n = gatefield::hover_thrust_n(model);
    depth_m_.resize(static_cast<std::size_t>(camera.width_px * camera.height_px));
    began_ = at_ = now();
  }

  gatefield::Stamp now() const { return real_time_ ? gatefield::MonotonicClock().now() : simulated_; }
  gatefield::QuadrotorState state() {
    advance(now());
    return state_;
  }
  void apply(const gatefield::PlainVector4& rotor_thrust_n) {
    advance(now());
    ask(rotor_thrust_n);
  }
  void sleep_until(gatefield::Stamp stamp) {
    if (!real_time_) {
      simulated_ = stamp;
      return;
    }
    std::this_thread::sleep_for(stamp - now());
    latest_ = std::max(latest_, now() - stamp);
  }

  /// A new frame at the camera's rate.
  bool has_frame() {
    advance(now());
    if (at_ < next_frame_) return false;
    next_frame_ = at_ + gatefield::from_seconds(1 / camera_.rate_hz);
    frame_stamp_ = at_;
    render();
    return true;
  }
  gatefield::Stamp frame_stamp() const { return frame_stamp_; }
  const std::vector<float>& depth_m() const { return depth_m_; }

  /// Until the gate is 1 m behind, something was touched, or 20 s are over.
  bool flying() {
    advance(now());
    return !crashed_ && state_.p_WB.x() < p_WG_.x() + 1 && at_ - began_ < std::chrono::seconds(20);
  }
  /// It flew through the opening and touched nothing.
  bool passed() const { return passed_ && !crashed_; }
  const gatefield::QuadrotorState& truth() const { return state_; }
  double flown_s() const { return gatefield::seconds(at_ - began_); }
  /// How much later than asked sleep_until() came back, at most.
  double latest_s() const { return gatefield::seconds(latest_); }

 protected:
  using RotorLaw = std::function<gatefield::PlainVector4(const gatefield::QuadrotorState&)>;
  /// What the rotors are asked for, anew every millisecond; apply() has no effect then.
  void rotors_follow(RotorLaw law) { law_ = std::move(law); }

 private:
  static constexpr std::chrono::milliseconds kStep{1};

  void ask(const gatefield::PlainVector4& rotor_thrust_n) {
    state_.thrust_command_n = rotor_thrust_n.cwiseMax(model_.thrust_min_n).cwiseMin(model_.thrust_max_n);
  }

  void render() {
    const Eigen::Isometry3d X_WC = Eigen::Translation3d(state_.p_WB) * Eigen::Quaterniond(state_.q_WB) * camera_.X_BC;
    for (int v = 0; v < camera_.height_px; ++v)
      for (int u = 0; u < camera_.width_px; ++u) {
        const double z_m = depth_along(X_WC.translation(), X_WC.linear() * camera_.ray_C(u, v));
        depth_m_[static_cast<std::size_t>(v * camera_.width_px + u)] =
            z_m >= camera_.min_depth_m && z_m <= camera_.max_depth_m ? static_cast<float>(z_m) : 0.0f;
      }
  }

  // The commanded thrusts stay what they are (rates of 0), the rotors follow them with their lag.
  void advance(gatefield::Stamp stamp) {
    while (at_ + kStep <= stamp) {
      const double before_m = state_.p_WB.x() - p_WG_.x();
      if (law_) ask(law_(state_));
      state_ = gatefield::step_reference(model_, state_, gatefield::ThrustRates::Zero(), gatefield::seconds(kStep));
      at_ += kStep;
      const Eigen::Vector3d p_G = state_.p_WB - p_WG_;
      const double radius_m = model_.collision_radius_m;
      const double offset_m = gatefield::transverse_distance(shape_, p_G);
      if (std::abs(p_G.x()) < radius_m && offset_m > shape_.inner_half_m - radius_m &&
          offset_m < shape_.outer_half_m + radius_m)
        crashed_ = true;
      if (state_.p_WB.z() < radius_m) crashed_ = true;
      if (before_m < 0 && p_G.x() >= 0 && offset_m < shape_.inner_half_m) passed_ = true;
    }
  }

  // Depth along a ray of unit depth: the gate's four bars, then the floor at z = 0; 0 = nothing.
  double depth_along(const Eigen::Vector3d& from_W, const Eigen::Vector3d& ray_W) const {
    const double middle_m = (shape_.inner_half_m + shape_.outer_half_m) / 2;
    const double half_m = (shape_.outer_half_m - shape_.inner_half_m) / 2;
    const double x_m = shape_.thickness_m / 2;
    double nearest_m = ray_W.z() < 0 ? -from_W.z() / ray_W.z() : 0.0;
    for (const double side : {-1.0, 1.0}) {
      for (const auto& [middle, half] :
           {std::pair(Eigen::Vector3d(0, side * middle_m, 0), Eigen::Vector3d(x_m, half_m, shape_.outer_half_m)),
            std::pair(Eigen::Vector3d(0, 0, side * middle_m), Eigen::Vector3d(x_m, shape_.outer_half_m, half_m))}) {
        const Eigen::Array3d a = (p_WG_ + middle - half - from_W).array() / ray_W.array();
        const Eigen::Array3d b = (p_WG_ + middle + half - from_W).array() / ray_W.array();
        const double enters_m = a.min(b).maxCoeff(), leaves_m = a.max(b).minCoeff();
        if (enters_m > 0 && enters_m <= leaves_m && (nearest_m == 0 || enters_m < nearest_m)) nearest_m = enters_m;
      }
    }
    return nearest_m;
  }

  const gatefield::QuadrotorModel model_;
  const gatefield::CameraModel camera_;
  const gatefield::GateShape shape_;
  const Eigen::Vector3d p_WG_;
  const bool real_time_;
  RotorLaw law_;                     // none: the thrusts that were applied last are held
  gatefield::QuadrotorState state_;  // at at_
  gatefield::Stamp simulated_{std::chrono::seconds(1)}, began_{0}, at_{0}, next_frame_{0}, frame_stamp_{0}, latest_{0};
  std::vector<float> depth_m_;
  bool passed_ = false, crashed_ = false;
};
