#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <thread>
#include <vector>

#include "server/planner/planner.h"
#include "server/planner/rollout_batch.h"
#include "tests/support/allocation_trap.h"
#include "tests/support/analytic_field.h"
#include "tests/support/crew_threads.h"
#include "tests/support/decoder_cases.h"

namespace gatefield::planner {
namespace {

using test::AnalyticField;
using test::upright_gate;

Profile small_profile() {
  Profile profile;
  profile.samples = 512;
  profile.control_rate_hz = 50;
  return profile;
}

/// What heights count from: the planner learns where gates are step by step.
Course over_a_floor() {
  Course course;
  course.waypoints = {{{8, 0, 1.5}, {1, 0, 0}}};
  course.floor_z_m = 0.0;
  return course;
}

std::unique_ptr<Planner> make(const Profile& profile, std::uint64_t seed = 1, const PlannerOptions& options = {},
                              const QuadrotorModel& model = {}) {
  auto planner = Planner::create(profile, model, over_a_floor(), kGuideConeAngle_rad, seed, options);
  EXPECT_TRUE(planner.ok());
  return std::move(planner).value();
}

QuadrotorState hovering_at(const Eigen::Vector3d& p_WB) {
  QuadrotorState state;
  state.p_WB = p_WB;
  state.thrust_n = state.thrust_command_n = hover_thrust_n(QuadrotorModel{});
  return state;
}

PlanInput towards(const Eigen::Isometry3d& X_WG, const Field* field, const QuadrotorState& state,
                  const GateShape& shape = {}) {
  PlanInput input;
  input.start = state;
  input.target.shape = shape;
  input.target.center_W = X_WG.translation();
  input.target.axis_W = X_WG.linear().col(0);
  input.target.seen = field != nullptr;
  input.target.field = field;
  input.has_next = true;
  input.next.center_W = X_WG.translation() + 8.0 * X_WG.linear().col(0);
  input.next.axis_W = X_WG.linear().col(0);
  return input;
}

/// Flies the reference dynamics under the planner's plans until the gate's plane is crossed. @return where, in the gate
/// frame.
Eigen::Vector3d fly_through(Planner& planner, const Eigen::Isometry3d& X_WG, const Field* field, QuadrotorState state,
                            const GateShape& shape = {}) {
  const QuadrotorModel model;
  Plan plan;
  for (int tick = 0; tick < 150; ++tick) {
    PlanInput input = towards(X_WG, field, state, shape);
    input.step = static_cast<std::uint64_t>(tick);
    input.elapsed_s = tick > 0 ? 0.02 : 0.0;
    input.speed_limit_m_s = 6.0;
    planner.plan(input, &plan);
    EXPECT_TRUE(plan.ok);
    for (int ms = 0; ms < 20; ++ms) {
      const double before = (X_WG.inverse() * state.p_WB).x();
      state = step_reference(model, state, plan.thrust_rate_n_s[0], 1e-3);
      Eigen::Vector3d p_G = X_WG.inverse() * state.p_WB;
      if (before < 0 && p_G.x() >= 0) return p_G;
    }
  }
  return {-1, 0, 0};
}

TEST(Mppi, FliesThroughAGateThatTheFieldShows) {
  const Eigen::Isometry3d X_WG = upright_gate({5, 0.6, 1.8}, 0.5);
  const AnalyticField field(X_WG);
  const auto planner = make(small_profile());
  const Eigen::Vector3d crossing_G = fly_through(*planner, X_WG, &field, hovering_at({0, 0, 1.5}));
  EXPECT_GE(crossing_G.x(), 0.0);
  EXPECT_LT(std::max(std::abs(crossing_G.y()), std::abs(crossing_G.z())), 0.5 - 0.13);
}

TEST(Mppi, OnePlannerFliesThroughGatesOfTwoSizes) {
  const auto planner = make(small_profile());
  for (const GateShape& shape : {GateShape{.inner_half_m = 0.9, .outer_half_m = 1.4, .thickness_m = 0.2},
                                 GateShape{.inner_half_m = 0.32, .outer_half_m = 0.45, .thickness_m = 0.03}}) {
    const Eigen::Isometry3d X_WG = upright_gate({5, 0.6, 1.8}, 0.5);
    const AnalyticField field(X_WG, shape);
    planner->reset();
    const Eigen::Vector3d crossing_G = fly_through(*planner, X_WG, &field, hovering_at({0, 0, 1.5}), shape);
    EXPECT_GE(crossing_G.x(), 0.0);
    EXPECT_LT(std::max(std::abs(crossing_G.y()), std::abs(crossing_G.z())), shape.inner_half_m - 0.13);
  }
}

TEST(Mppi, TheLimitsOfAVehiclesBodyRatesSlowItsTurns) {
  // At rest, the gate abeam: it has to turn by 90 degrees.
  const auto largest_yaw_rate = [](double limit_rad_s) {
    QuadrotorModel model;
    model.body_rate_max_rad_s.z() = limit_rad_s;
    const auto planner = make(small_profile(), 1, {}, model);
    PlanInput input = towards(upright_gate({0, 6, 1.5}, 1.57), nullptr, hovering_at({0, 0, 1.5}));
    Plan plan;
    double largest_rad_s = 0.0;
    for (input.step = 0; input.step < 60; ++input.step) {
      planner->plan(input, &plan);
      input.elapsed_s = 0.03;
      input.start = plan.state[0];
      largest_rad_s = std::max(largest_rad_s, std::abs(input.start.w_WB_B.z()));
    }
    return largest_rad_s;
  };
  const double free_rad_s = largest_yaw_rate(0.0);
  EXPECT_GT(free_rad_s, 1.5);
  EXPECT_LT(largest_yaw_rate(0.5), 0.7 * free_rad_s);
  EXPECT_EQ(largest_yaw_rate(50.0), free_rad_s) << "beyond the profile's limit it says nothing";
}

TEST(Mppi, GoesOnFromARestoredWarmStartBitForBit) {
  const Eigen::Isometry3d X_WG = upright_gate({5, 0.6, 1.8}, 0.5);
  const auto stays = make(small_profile()), moved = make(small_profile());
  Plan plan, there;
  PlanInput input = towards(X_WG, nullptr, hovering_at({6, -1.5, 1.5}));  // beside a missed gate: on one side of it
  for (input.step = 0; input.step < 3; ++input.step) stays->plan(input, &plan);
  ASSERT_TRUE(moved->restore(stays->warm_start()));
  EXPECT_EQ(moved->warm_start().detour_side, stays->warm_start().detour_side);
  input.elapsed_s = 0.02;
  stays->plan(input, &plan);
  moved->plan(input, &there);
  for (std::size_t k = 0; k < static_cast<std::size_t>(plan.steps); ++k)
    EXPECT_EQ(plan.thrust_rate_n_s[k], there.thrust_rate_n_s[k]);

  WarmStart bad = stays->warm_start();
  bad.mean.pop_back();
  EXPECT_FALSE(moved->restore(bad));
  bad = stays->warm_start();
  bad.mean[3][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(moved->restore(bad));
  bad = stays->warm_start();
  bad.detour_side = 0.0;
  EXPECT_FALSE(moved->restore(bad));
}

TEST(Mppi, FliesThroughAGateTurnedBySixtyDegrees) {
  const Eigen::Isometry3d X_WG = upright_gate({6, 0, 1.5}, 1.05);
  const AnalyticField field(X_WG);
  const auto planner = make(small_profile());
  const Eigen::Vector3d crossing_G = fly_through(*planner, X_WG, &field, hovering_at({0, 0, 1.5}));
  EXPECT_GE(crossing_G.x(), 0.0);
  EXPECT_LT(std::max(std::abs(crossing_G.y()), std::abs(crossing_G.z())), 0.5 - 0.13);
}

TEST(Mppi, TheSameSeedGivesTheSameBitsAndAnotherOneDoesNot) {
  const Eigen::Isometry3d X_WG = upright_gate({5, 0, 1.5}, 0);
  const AnalyticField field(X_WG);
  const auto run = [&](std::uint64_t seed) {
    const auto planner = make(small_profile(), seed);
    Plan plan;
    PlanInput input = towards(X_WG, &field, hovering_at({0, 0, 1.5}));
    for (std::uint64_t step = 0; step < 5; ++step) {
      input.step = step;
      input.elapsed_s = 0.02;
      planner->plan(input, &plan);
    }
    return plan.thrust_rate_n_s[0];
  };
  EXPECT_EQ(run(7), run(7));
  EXPECT_NE(run(7), run(8));
}

/// Where the rollouts of a step end.
class Watcher final : public RolloutObserver {
 public:
  void see(const RolloutBatch& batch, int) noexcept override {
    for (int m = 0; m < batch.samples; ++m) {
      last_x.push_back(batch.states.row(batch.steps - 1, kernels::kPx)[m]);
      last_z.push_back(batch.states.row(batch.steps - 1, kernels::kPz)[m]);
    }
  }
  std::vector<float> last_x, last_z;
};

TEST(Mppi, ADisturbanceMovesRolloutsAndPlanAlike) {
  Profile profile = small_profile();
  profile.rotors_thrust_sigma_s = profile.rotors_tilt_sigma_rad_s3 = profile.rotors_yaw_sigma_rad_s3 = 0;
  PlanInput input = towards(upright_gate({50, 0, 1.5}, 0), nullptr, hovering_at({0, 0, 1.5}));
  input.disturbance_W_m_s2 = {2.0, 0, 0};
  Watcher watcher;
  const auto planner = make(profile);
  planner->watch(&watcher);
  Plan plan;
  planner->plan(input, &plan);
  const double horizon_s = profile.steps * profile.step_s;
  ASSERT_FALSE(watcher.last_x.empty());
  EXPECT_NEAR(watcher.last_x.front(), horizon_s * horizon_s, 1e-3);
  EXPECT_NEAR(plan.state[19].p_WB.x(), horizon_s * horizon_s, 0.06);  // drag included
  EXPECT_NEAR(plan.state[19].v_WB.x(), 2.0 * horizon_s, 0.1);
}

TEST(Mppi, CorrelatedNoiseReachesFartherAndStillFliesThrough) {
  const Eigen::Isometry3d X_WG = upright_gate({5, 0.6, 1.8}, 0.5);
  const AnalyticField field(X_WG);
  const auto reach = [&](double correlation) {
    Profile profile = small_profile();
    profile.rotors_tilt_sigma_rad_s3 = profile.rotors_yaw_sigma_rad_s3 = 0;  // up and down only
    profile.rotors_correlation = correlation;
    const PlanInput input = towards(X_WG, &field, hovering_at({0, 0, 1.5}));
    Watcher watcher;
    const auto planner = make(profile);
    planner->watch(&watcher);
    Plan plan;
    planner->plan(input, &plan);
    double sum = 0.0;
    for (const float z : watcher.last_z) sum += (z - 1.5) * (z - 1.5);
    return std::sqrt(sum / static_cast<double>(watcher.last_z.size()));
  };
  EXPECT_GT(reach(0.8), 1.4 * reach(0.0));
  Profile profile = small_profile();
  profile.rotors_correlation = 0.5;
  const Eigen::Vector3d crossing_G = fly_through(*make(profile), X_WG, &field, hovering_at({0, 0, 1.5}));
  EXPECT_GE(crossing_G.x(), 0.0);
  EXPECT_LT(std::max(std::abs(crossing_G.y()), std::abs(crossing_G.z())), 0.5 - 0.13);
}

TEST(Mppi, HoldStaysAtThePoint) {
  const auto planner = make(small_profile());
  const QuadrotorModel model;
  QuadrotorState state = hovering_at({0.5, 0, 1.5});
  Plan plan;
  for (int tick = 0; tick < 200; ++tick) {
    PlanInput input;
    input.start = state;
    input.hold = true;
    input.target.center_W = {0, 0, 1.5};
    input.step = static_cast<std::uint64_t>(tick);
    input.elapsed_s = 0.02;
    planner->plan(input, &plan);
    for (int ms = 0; ms < 20; ++ms) state = step_reference(model, state, plan.thrust_rate_n_s[0], 1e-3);
  }
  EXPECT_LT((state.p_WB - Eigen::Vector3d(0, 0, 1.5)).norm(), 0.6);
  EXPECT_LT(state.v_WB.norm(), 2.0);
}

TEST(Mppi, PlansStayWithinTheVehiclesLimits) {
  const Eigen::Isometry3d X_WG = upright_gate({5, 0, 4}, 0);
  Profile profile = small_profile();
  profile.rotors_thrust_sigma_s *= 33;
  profile.rotors_tilt_sigma_rad_s3 *= 33;
  profile.rotors_yaw_sigma_rad_s3 *= 11;
  const auto planner = make(profile);
  const QuadrotorModel model;
  Plan plan;
  PlanInput input = towards(X_WG, nullptr, hovering_at({0, 0, 1.5}));
  planner->plan(input, &plan);
  for (std::size_t k = 0; k < static_cast<std::size_t>(plan.steps); ++k) {
    EXPECT_LE(plan.thrust_rate_n_s[k].cwiseAbs().maxCoeff(), model.thrust_rate_max_n_s + 1e-6);
    EXPECT_LE(plan.state[k].thrust_command_n.maxCoeff(), model.thrust_max_n + 1e-9);
    EXPECT_GE(plan.state[k].thrust_command_n.minCoeff(), model.thrust_min_n - 1e-9);
  }
}

TEST(Mppi, AStateThatIsNotFiniteGivesNoPlanAndNoCrash) {
  const auto planner = make(small_profile());
  Plan plan;
  PlanInput input = towards(upright_gate({5, 0, 1.5}, 0), nullptr, hovering_at({0, 0, 1.5}));
  input.start.p_WB.x() = std::numeric_limits<double>::quiet_NaN();
  planner->plan(input, &plan);
  EXPECT_FALSE(plan.ok);
  input.start.p_WB.x() = 0;
  planner->plan(input, &plan);
  EXPECT_TRUE(plan.ok);
  EXPECT_TRUE(plan.thrust_rate_n_s[0].allFinite());
}

TEST(Mppi, AStepAllocatesNothing) {
  const Eigen::Isometry3d X_WG = upright_gate({1, 0, 1.5}, 0);
  const AnalyticField field(X_WG);
  kernels::Crew crew(1);
  const test::CrewThreads others(&crew, 1);
  const auto planner = make(small_profile(), 1, {.crew = &crew});
  Plan plan;
  PlanInput input = towards(X_WG, &field, hovering_at({0, 0, 1.5}));
  input.next.field = &field;
  planner->plan(input, &plan);
  test::AllocationTrap trap;
  for (int i = 0; i < 3; ++i) planner->plan(input, &plan);
  EXPECT_EQ(trap.count(), 0u);
}

TEST(Mppi, AnObserverSeesEveryRolloutAndChangesNothing) {
  const Eigen::Isometry3d X_WG = upright_gate({5, 0.6, 1.8}, 0.5);
  const AnalyticField field(X_WG);
  const PlanInput input = towards(X_WG, &field, hovering_at({0, 0, 1.5}));
  const auto watched = make(small_profile(), 1, {.leave_out = false}),
             alone = make(small_profile(), 1, {.leave_out = false});
  Watcher watcher;
  watched->watch(&watcher);
  Plan plan, expected;
  watched->plan(input, &plan);
  alone->plan(input, &expected);
  EXPECT_EQ(watcher.last_x.size(), 512u);
  EXPECT_EQ(plan.thrust_rate_n_s[0], expected.thrust_rate_n_s[0]);
  watched->watch(nullptr);
  watched->plan(input, &plan);
  EXPECT_EQ(watcher.last_x.size(), 512u);
}

/// The planner as published, as far as it differs here: squared distances, low temperature, no crossing cost.
Profile paper_like() {
  Profile profile = small_profile();
  profile.temperature = 0.1;
  profile.progress_metric = ProgressMetric::kSquaredDistance;
  profile.progress_weight = 1;
  profile.visibility_weight = 0.05;
  profile.field_weight = 0.4;
  profile.switch_in_rollout = profile.waypoint_from_field = profile.funnel = false;
  profile.crossing_weight = profile.altitude_weight = 0;
  return profile;
}

/// Plans of a flight through one gate towards a second, both with fields: before, in and behind the opening, with
/// rollouts that come back through the plane where the speed is low.
std::vector<Plan> plans_of_a_flight(const Profile& profile, const PlannerOptions& options, double speed_m_s) {
  const Eigen::Isometry3d X_WG = upright_gate({4, 0.3, 1.6}, 0.3), X_WN = upright_gate({9, 2, 1.6}, 0.6);
  const AnalyticField field(X_WG), next(X_WN);
  const auto planner = make(profile, 3, options);
  QuadrotorState state = hovering_at({0.5, 0, 1.5});
  state.v_WB = {speed_m_s, 0.2 * speed_m_s, 0};
  std::vector<Plan> plans(30);
  for (std::size_t tick = 0; tick < plans.size(); ++tick) {
    PlanInput input = towards(X_WG, &field, state);
    input.next.center_W = X_WN.translation();
    input.next.field = &next;
    input.step = tick;
    input.elapsed_s = 0.02;
    planner->plan(input, &plans[tick]);
    state.p_WB += 0.02 * state.v_WB;  // the same states whatever was planned
  }
  return plans;
}

TEST(Mppi, ThePlanIsTheSameBitForBitWhateverTheNumberOfThreads) {
  for (const Profile& profile : {small_profile(), paper_like()}) {
    const std::vector<Plan> alone = plans_of_a_flight(profile, {}, 5.0);
    for (const int threads : {1, 2, 3}) {
      kernels::Crew crew(1);
      const test::CrewThreads others(&crew, threads - 1);
      const std::vector<Plan> together = plans_of_a_flight(profile, {.crew = &crew}, 5.0);
      for (std::size_t i = 0; i < alone.size(); ++i) {
        for (std::size_t k = 0; k < 20; ++k) {
          ASSERT_EQ(alone[i].thrust_rate_n_s[k], together[i].thrust_rate_n_s[k]) << threads << " threads, plan " << i;
        }
        EXPECT_EQ(alone[i].effective_samples, together[i].effective_samples);
        EXPECT_EQ(alone[i].decoded_rollouts, together[i].decoded_rollouts);
      }
    }
  }
}

TEST(Mppi, LeavingOutChangesThePlanLessThanRoundingDoes) {
  for (const Profile& profile : {small_profile(), paper_like()}) {
    for (const double speed_m_s : {5.0, 0.7}) {
      const std::vector<Plan> whole = plans_of_a_flight(profile, {.leave_out = false}, speed_m_s);
      const std::vector<Plan> less = plans_of_a_flight(profile, {}, speed_m_s);
      int asked = 0;
      for (std::size_t i = 0; i < whole.size(); ++i) {
        asked += less[i].decoded_rollouts;
        EXPECT_EQ(whole[i].decoded_rollouts, profile.samples);
        // 2.1e-9 of the range and what single precision makes of the weights' sum; warm starts carry it on.
        for (std::size_t k = 0; k < 20; ++k) {
          ASSERT_LT((whole[i].thrust_rate_n_s[k] - less[i].thrust_rate_n_s[k]).cwiseAbs().maxCoeff(), 60 * 1e-5)
              << profile.temperature << " speed " << speed_m_s << " plan " << i;
        }
        EXPECT_NEAR(less[i].effective_samples, whole[i].effective_samples, 1e-3 * whole[i].effective_samples);
      }
      EXPECT_LT(asked, 0.9 * 30 * profile.samples) << "nothing was left out";
    }
  }
}

/// A decoder with weights by chance, folded on one back end.
class RandomField final : public Field {
 public:
  explicit RandomField(const kernels::Backend& backend) {
    const auto weights = kernels::random_weights(kernels::DecoderKind::kHyper, {64, 64}, 0, 5);
    kernels::fold(backend.prepare(weights), kernels::random_latent(weights.latent_size, 6),
                  Eigen::Isometry3d(Eigen::Translation3d(2, 0, 1)), &decoder_);
  }
  void evaluate(std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
                std::span<float> sdf_m) const noexcept override {
    decoder_.decode(x_W, y_W, z_W, sdf_m);
  }

 private:
  kernels::FoldedDecoder decoder_;
};

/// Steps of one planner with a decoded field, all on one back end.
class Steps {
 public:
  explicit Steps(const kernels::Backend& backend)
      : field_(backend), planner_(make(small_profile(), 1, {.backend = &backend})) {}
  void step() {
    PlanInput input = towards(upright_gate({3, 0.3, 1.6}, 0.3), &field_, hovering_at({0, 0, 1.5}));
    input.step = done_++;
    input.elapsed_s = 0.02;
    planner_->plan(input, &plan_);
    for (std::size_t k = 0; k < static_cast<std::size_t>(plan_.steps); ++k)
      rates.insert(rates.end(), plan_.thrust_rate_n_s[k].data(), plan_.thrust_rate_n_s[k].data() + kRotors);
  }
  std::vector<double> rates;

 private:
  RandomField field_;
  std::unique_ptr<Planner> planner_;
  Plan plan_;
  std::uint64_t done_ = 0;
};

TEST(Mppi, PlannersOnDifferentBackEndsGiveSideBySideWhatEachGivesAlone) {
  constexpr int kSteps = 10;
  const auto backends = kernels::available_backends();
  std::vector<std::vector<double>> alone;
  for (const kernels::Backend* backend : backends) {
    Steps steps(*backend);
    for (int i = 0; i < kSteps; ++i) steps.step();
    alone.push_back(steps.rates);
  }
  if (backends.size() > 1) {
    EXPECT_NE(alone.front(), alone.back()) << "rounding differs, so the plans do";
  }

  // In one thread in turns, which crosses every switch from one to the other.
  std::vector<std::unique_ptr<Steps>> turns;
  for (const kernels::Backend* backend : backends) turns.push_back(std::make_unique<Steps>(*backend));
  for (int i = 0; i < kSteps; ++i)
    for (const auto& steps : turns) steps->step();
  // And in threads of their own at once.
  std::vector<std::unique_ptr<Steps>> at_once;
  std::vector<std::thread> threads;
  for (const kernels::Backend* backend : backends) {
    Steps* const steps = at_once.emplace_back(std::make_unique<Steps>(*backend)).get();
    threads.emplace_back([steps] {
      for (int i = 0; i < kSteps; ++i) steps->step();
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(turns[i]->rates, alone[i]) << backends[i]->name();
    EXPECT_EQ(at_once[i]->rates, alone[i]) << backends[i]->name();
  }
}

TEST(Mppi, AnAdaptiveTemperatureLeavesNothingOut) {
  Profile profile = small_profile();
  profile.target_effective_fraction = 0.1;
  for (const Plan& plan : plans_of_a_flight(profile, {}, 5.0)) EXPECT_EQ(plan.decoded_rollouts, profile.samples);
}

TEST(Mppi, MoreCareNearAGateThatWasNotSeenForLong) {
  // The same approach at 8 m/s, with a fresh and with an old field: the old one must slow down within the horizon.
  const Eigen::Isometry3d X_WG = upright_gate({3.5, 0, 1.5}, 0);
  const AnalyticField field(X_WG);
  QuadrotorState state = hovering_at({0, 0, 1.5});
  state.v_WB = {8, 0, 0};
  const auto end_speed = [&](double age_s) {
    const auto planner = make(small_profile());
    Plan plan;
    PlanInput input = towards(X_WG, &field, state);
    input.speed_limit_m_s = 8;
    input.field_age_s = age_s;
    for (std::uint64_t step = 0; step < 12; ++step) {
      input.step = step;
      planner->plan(input, &plan);
    }
    return plan.state[19].v_WB.norm();
  };
  EXPECT_LT(end_speed(3.0), end_speed(0.0) - 0.5);
}

}  // namespace
}  // namespace gatefield::planner
