#pragma once

#include <optional>
#include <vector>

#include "server/planner/drive/drive.h"
#include "server/planner/planner.h"
#include "server/planner/race_guidance.h"
#include "server/planner/rollout_costs.h"
#include "server/planner/short_list.h"

namespace gatefield::planner {

/// Model predictive path integral control (paper, "Vision Guided Racing Controller via MPPI") over the inputs that the
/// vehicle's drive has (drive/drive.h): thrust rates, as in the paper, or what a flight controller is asked for.
/// A step:
///   1. U, the previous plan, is shifted by the time that has passed (warm_start.h).
///   2. U_m = U + noise, the first of the M samples without (kernels/noise/noise.h); where the drive wants it, noise is
///      correlated over the steps: e_k = rho e_{k-1} + sqrt(1 - rho^2) n_k.
///   3. States X_m follow by rolling U_m out (kernels/rollout) and from what disturbs them (applied_disturbance.h); U_m
///      becomes what was applied within the limits.
///   4. J_m is the sum of the cost terms (rollout_costs.h), measured by where the gates are (race_guidance.h), with the
///      field only for those that may get weight (short_list.h).
///   5. w_m = softmax(-J_m / lambda),  U = sum_m w_m U_m (kernels/average/average.h).
/// The plan is U with the states that follow from it. Steps 2 to 4 run in blocks of kBlock samples, which a crew
/// shares; every block writes its own results, and sums over blocks are made in their order.
/// See Planner for threads and real time.
class Mppi final : public Planner {
 public:
  /// @pre profile, model and course are valid (Planner::create() asks)
  Mppi(const Profile& profile, const QuadrotorModel& model, const Course& course, double cone_angle_rad,
       std::uint64_t seed, const PlannerOptions& options);

  void plan(const PlanInput& input, Plan* plan) noexcept override;
  void reset() noexcept override;
  WarmStart warm_start() const override { return {mean_, drive_->asked(), guidance_.detour_side()}; }
  bool restore(const WarmStart& start) override;
  const Profile& profile() const noexcept override { return profile_; }
  void watch(RolloutObserver* observer) noexcept override { observer_ = observer; }

 private:
  RolloutBatch roll_out(const PlanInput& input, int block, Workspace& work) noexcept;
  std::span<const float> weigh_whole(const PlanInput& input, const PlanContext& context, int block, RolloutBatch batch,
                                     Workspace& work) noexcept;
  std::span<const float> weigh_all(const PlanInput& input, const PlanContext& context) noexcept;
  std::span<const float> weigh_hopeful(const PlanInput& input, const PlanContext& context) noexcept;
  void average() noexcept;
  void predict(const PlanInput& input, Plan* plan) const noexcept;

  int samples_in(int block) const noexcept { return std::min(kBlock, profile_.samples - block * kBlock); }
  kernels::SampleBlock inputs_of(int block) noexcept;

  Profile profile_;
  std::uint64_t key_;  ///< of the rollouts' noise
  kernels::Crew* crew_;
  const kernels::Backend* backend_;
  std::unique_ptr<Drive> drive_;
  kernels::NoiseShape noise_;
  RolloutCosts costs_;
  RaceGuidance guidance_;
  std::optional<ShortList> short_list_;  ///< empty: the field is asked for every rollout
  RolloutObserver* observer_ = nullptr;
  std::vector<PlainVector4> mean_;  ///< U, starts the next step
  std::size_t steps_;
  int blocks_;

  // Sized once; each block of rollouts writes its own part.
  std::vector<float> inputs_;         ///< [block][K][4][kBlock], kept until the average
  std::vector<float> cost_, weight_;  ///< [M]
  std::vector<float> flat_mean_;      ///< [K][4]
  std::vector<double> sums_;          ///< [block][K][4]
};

}  // namespace gatefield::planner
