#pragma once

#include <memory>
#include <span>

#include "common/vehicle/actuation.h"
#include "server/planner/planner.h"

namespace gatefield::planner {

/// A body and what is asked of it.
struct DrivenState {
  QuadrotorState body;
  RateCommand asked;  ///< Actuation::Kind::kBodyRates: what is asked for; else not used
};

/// How a vehicle is driven, as MPPI sees it: what its four inputs are, how they are sampled, and which states follow
/// from them. One implementation for each Actuation::Kind:
///   rotor_drive.cpp  inputs are the rates of the rotors' commanded thrusts
///   rate_drive.cpp   inputs are what a flight controller is asked for, collective thrust and body rates, or how fast
///                    that changes
/// Thread-safe: roll_out() and move() are const; one thread for the others.   Real-time safe: all but make().
class Drive {
 public:
  /// @param profile, model, actuation  valid
  static std::unique_ptr<Drive> make(const Profile& profile, const QuadrotorModel& model, const Actuation& actuation);
  virtual ~Drive() = default;

  virtual kernels::NoiseShape noise() const noexcept = 0;
  /// Between neighbouring steps of a rollout, 0: white.
  virtual double noise_correlation() const noexcept = 0;
  /// The input that changes nothing: a plan's before anything was planned.
  virtual PlainVector4 still() const noexcept = 0;

  /// The previous plan's inputs seen from where the new one starts, and what is asked for there.
  virtual void begin(const PlanInput& input, std::span<PlainVector4> mean) noexcept = 0;
  /// States of a block of samples; `inputs` become what was applied within the limits. @pre begin(input)
  virtual void roll_out(const kernels::Backend& backend, const PlanInput& input, kernels::SampleBlock inputs,
                        kernels::SampleBlock states) const noexcept = 0;
  /// Where a plan begins. @pre begin(input)
  virtual DrivenState start(const PlanInput& input) const noexcept = 0;
  /// One step of a plan in double precision: moves the state on and notes in step k of the plan what is sent.
  virtual void move(const PlanInput& input, const PlainVector4& mean, std::size_t k, DrivenState* state,
                    Plan* plan) const noexcept = 0;

  /// What begin() goes on from, beside the mean: to be written down, and set to what was. All zero where a drive has
  /// nothing of the kind.
  virtual RateCommand asked() const noexcept { return RateCommand::Zero(); }
  virtual void restore(const RateCommand& /*asked*/) noexcept {}
};

/// Most that a plan of body rates asks for, about each axis of B, rad/s: the profile's limits, and the vehicle's own
/// where those are lower.
Eigen::Vector3d body_rate_limits_rad_s(const Profile& profile, const QuadrotorModel& model) noexcept;

/// The two there are, for make().
std::unique_ptr<Drive> make_rotor_drive(const Profile& profile, const QuadrotorModel& model);
std::unique_ptr<Drive> make_rate_drive(const Profile& profile, const QuadrotorModel& model, const Actuation& actuation);

}  // namespace gatefield::planner
