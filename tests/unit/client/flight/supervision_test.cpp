#include "client/flight/supervision.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>
#include <vector>

#include "client/flight/loop.h"
#include "tests/unit/client/flight/rate_vehicle.h"

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

class FakeClock final : public LoopClock {
 public:
  Stamp now() const noexcept override { return now_; }
  Stamp sleep_until(Stamp deadline) noexcept override { return now_ = std::max(now_, deadline); }

 private:
  Stamp now_ = 100s;
};

/// A server whose plan is to fly north at 3 m/s.
class FakeClient final : public sdk::Client {
 public:
  FakeClient(const FakeClock& clock, const QuadrotorModel& model) : clock_(clock), law_(model) {}

  Stamp plans_from{0}, plans_until = Stamp::max(), course_done_at = Stamp::max();
  std::vector<std::optional<sdk::Setpoint>> told;  ///< by applied(), each step

  protocol::SessionReply session() const override {
    protocol::SessionReply reply;
    reply.control_period_s = 0.02;
    return reply;
  }
  std::uint64_t send_depth(Stamp, std::span<const float>) override { return 0; }
  std::uint64_t send_depth_counts(Stamp, std::span<const std::uint16_t>) override { return 0; }
  std::uint64_t send_state(Stamp stamp, const QuadrotorState&, bool) override {
    newest_state_ = stamp;
    return ++states_;
  }
  std::optional<protocol::ThrustRateCommand> newest() override {
    if (!there() || clock_.now() < next_) return std::nullopt;
    next_ = clock_.now() + 20ms;
    protocol::ThrustRateCommand command{};
    command.sequence = ++plans_;
    command.answers_stamp = newest_state_;
    command.health.latent_age_s = 0.01;
    command.health.course_done = clock_.now() >= course_done_at;
    return command;
  }
  std::optional<protocol::ThrustRateCommand> wait_for_answer(std::uint64_t, std::chrono::milliseconds) override {
    return std::nullopt;
  }
  sdk::Setpoint play(Stamp, const QuadrotorState& state, std::chrono::nanoseconds) override {
    sdk::Fallback::Goal goal;
    goal.v_W = {0, 3, 0};
    goal.z_m = 1.0;
    sdk::Setpoint setpoint = law_.toward(goal, state);
    setpoint.source = there() ? sdk::Setpoint::Source::kPlan : sdk::Setpoint::Source::kFallback;
    return setpoint;
  }
  void applied(Stamp, const std::optional<sdk::Setpoint>& setpoint) override { told.push_back(setpoint); }
  sdk::LinkStatistics statistics() const override { return {}; }
  protocol::Problems problems() const override { return 0; }
  std::optional<sdk::ProblemChange> problem_change() override { return std::nullopt; }
  std::optional<sdk::SessionChange> session_change() override { return std::nullopt; }
  std::optional<protocol::Telemetry> telemetry() override { return std::nullopt; }

 private:
  bool there() const { return clock_.now() >= plans_from && clock_.now() < plans_until; }

  const FakeClock& clock_;
  sdk::Fallback law_;
  Stamp next_{0}, newest_state_{0};
  std::uint64_t states_ = 0, plans_ = 0;
};

/// A vehicle with a flight controller that has a throttle, an arm switch and an accelerometer.
class FakeVehicle final : public StateSource, public Actuator, public Observer {
 public:
  explicit FakeVehicle(ThrustEstimate* thrust) : thrust_(*thrust) {}

  RateVehicle body;
  double throttle_at_hover = 0.36;  // as it truly is
  Stamp switch_on_at = Stamp::max(), states_until = Stamp::max(), take_over_at = Stamp::max(), over_at = Stamp::max();
  Stamp dies_at = Stamp::max();     // the firmware: no word, no motor
  Stamp disarms_at = Stamp::max();  // by itself
  std::vector<Phase> phases;
  /// Each step: what was applied, and how high above the ground the vehicle was then.
  struct Step {
    std::optional<sdk::Setpoint> applied;
    double height_m;
  };
  std::vector<Step> steps;
  bool armed = false;

  std::optional<TimedState> newest(Stamp now) noexcept override {
    if (now >= std::min(states_until, dies_at)) return last_;
    last_ = TimedState{.stamp = now, .state = body.state, .thrust_known = false};
    return last_;
  }
  SetpointPart accepts() const noexcept override { return SetpointPart::kCollectiveAndBodyRates; }
  Stamp period() const noexcept override { return 5ms; }
  void apply(Stamp now, const sdk::Setpoint& setpoint) noexcept override {
    steps.push_back({setpoint, body.state.p_WB.z()});
    const double throttle = thrust_.command(now, setpoint.collective_thrust_n);
    const double thrust_n = body.model.mass_kg * kGravity_m_s2 * std::pow(throttle / throttle_at_hover, 1.7);
    move(armed ? thrust_n : 0.0, setpoint.body_rates_rad_s);
  }
  void hold(Stamp) noexcept override {
    steps.push_back({std::nullopt, body.state.p_WB.z()});
    move(0.0, Eigen::Vector3d::Zero());
  }

  class Status final : public FlightController {
   public:
    explicit Status(FakeVehicle* vehicle) : vehicle_(*vehicle) {}
    std::optional<ControllerStatus> newest(Stamp now) noexcept override {
      if (now >= vehicle_.disarms_at && !std::exchange(disarmed_, true)) vehicle_.armed = false;
      return vehicle_.status(now);
    }
    void want(Stamp now, Wanted wanted) noexcept override {
      if (now >= vehicle_.dies_at) return;
      if (wanted == Wanted::kArmed && last != Wanted::kArmed) {
        vehicle_.armed = true;
        ++armings;
      }
      if (wanted == Wanted::kKilled || (wanted == Wanted::kDisarmed && vehicle_.body.on_ground()))
        vehicle_.armed = false;
      last = wanted;
    }
    Wanted last = Wanted::kDisarmed;
    int armings = 0;

   private:
    bool disarmed_ = false;
    FakeVehicle& vehicle_;
  };

  std::optional<ControllerStatus> status(Stamp now) const noexcept {
    ControllerStatus status;
    status.stamp = std::min(now, dies_at);
    status.armed = status.follows_us = armed;
    status.pilot = PilotSwitches{.arm = now >= switch_on_at, .take_over = now >= take_over_at};
    status.specific_force_z_m_s2 = body.specific_force_z();
    status.failsafe = FirmwareFailsafe::kGood;
    return status;
  }
  void on_plan(const protocol::ThrustRateCommand&) noexcept override {}
  bool goes_on() noexcept override { return time_ < over_at; }
  void on_phase(const Directive& directive) noexcept override { phases.push_back(directive.phase); }

 private:
  void move(double thrust_n, const Eigen::Vector3d& rates) {
    for (int i = 0; i < 5; ++i) body.step(thrust_n, rates, 1e-3);
    time_ += 5ms;
  }

  ThrustEstimate& thrust_;
  std::optional<TimedState> last_;
  Stamp time_ = 100s;
};

class SupervisedLoop : public testing::Test {
 protected:
  SupervisedLoop() { vehicle.phases.reserve(1000); }
  LoopStatistics run() {
    LoopOptions loop;
    loop.give_up = give_up;
    return run_loop({.states = &vehicle,
                     .actuator = &vehicle,
                     .observer = &vehicle,
                     .controller = &controller,
                     .supervision = &supervision},
                    &client, loop, &clock, stop);
  }
  static Course course() {
    Course course;
    course.waypoints.emplace_back(Eigen::Vector3d(0, 300, 1.5), Eigen::Vector3d(0, 1, 0));
    course.closed = false;
    return course;
  }

  QuadrotorModel model;
  ThrustOptions thrust_options;
  ThrustEstimate thrust{thrust_options, model};
  SupervisorOptions options;
  Supervision supervision{options, model, RateVehicle::actuation(), course(), &thrust};
  FakeClock clock;
  FakeClient client{clock, model};
  FakeVehicle vehicle{&thrust};
  FakeVehicle::Status controller{&vehicle};
  std::atomic<bool> stop{false};
  Stamp give_up = 60s;
};

TEST_F(SupervisedLoop, FliesFromTheGroundToTheGround) {
  vehicle.switch_on_at = 102s;
  client.course_done_at = 112s;
  vehicle.over_at = 130s;
  const LoopStatistics statistics = run();
  EXPECT_EQ(statistics.end, End::kOver);
  EXPECT_THAT(vehicle.phases, ElementsAre(Phase::kReady, Phase::kArming, Phase::kTakeOff, Phase::kHolding,
                                          Phase::kHandOver, Phase::kRacing, Phase::kBraking, Phase::kHolding,
                                          Phase::kDescending, Phase::kLanded, Phase::kDisarmed));
  EXPECT_TRUE(vehicle.body.on_ground());
  EXPECT_FALSE(vehicle.armed);
  EXPECT_GT(vehicle.body.state.p_WB.y(), 5.0) << "it did fly north";
  EXPECT_LT(vehicle.body.hardest_touch_m_s, 1.0);
  // The throttle was told a sixth too low.
  EXPECT_NEAR(thrust.hover_throttle(), vehicle.throttle_at_hover, 0.015);
}

TEST_F(SupervisedLoop, TellsTheServerWhatTheVehicleIsReallyAskedForOffTheGround) {
  vehicle.switch_on_at = 102s;
  client.course_done_at = 112s;
  vehicle.over_at = 130s;
  run();
  ASSERT_EQ(client.told.size(), vehicle.steps.size()) << "each step";
  int in_the_air = 0, on_the_ground = 0;
  for (std::size_t i = 0; i < vehicle.steps.size(); ++i) {
    const auto& [applied, height_m] = vehicle.steps[i];
    const auto& told = client.told[i];
    if (applied && height_m > 0.1) {
      ++in_the_air;
      ASSERT_TRUE(told) << "step " << i;
      ASSERT_EQ(told->collective_thrust_n, applied->collective_thrust_n) << "step " << i;
      ASSERT_EQ(told->body_rates_rad_s, applied->body_rates_rad_s) << "step " << i;
    } else {
      ++on_the_ground;
      ASSERT_FALSE(told) << "step " << i << ": the ground or nobody carries it";
    }
  }
  EXPECT_GT(in_the_air, 1000);
  EXPECT_GT(on_the_ground, 400);
}

TEST_F(SupervisedLoop, NothingMovesWithoutTheSwitch) {
  vehicle.over_at = 105s;
  const LoopStatistics statistics = run();
  EXPECT_EQ(statistics.end, End::kOver);
  EXPECT_THAT(vehicle.phases, ElementsAre(Phase::kReady));
  EXPECT_EQ(statistics.flown, 0s);
  EXPECT_FALSE(vehicle.armed);
}

TEST_F(SupervisedLoop, AStopLandsBeforeTheLoopEnds) {
  vehicle.switch_on_at = 102s;
  vehicle.over_at = 110s;  // asks as a signal would
  run();
  EXPECT_TRUE(vehicle.body.on_ground());
  EXPECT_FALSE(vehicle.armed);
  EXPECT_EQ(vehicle.phases.back(), Phase::kDisarmed);
}

TEST_F(SupervisedLoop, AServerThatDiesForGoodEndsInALanding) {
  vehicle.switch_on_at = 102s;
  client.plans_until = 109s;
  give_up = 30s;
  const LoopStatistics statistics = run();
  EXPECT_EQ(statistics.end, End::kGivenUp);
  EXPECT_THAT(vehicle.phases, ElementsAre(Phase::kReady, Phase::kArming, Phase::kTakeOff, Phase::kHolding,
                                          Phase::kHandOver, Phase::kRacing, Phase::kBraking, Phase::kHolding,
                                          Phase::kDescending, Phase::kLanded, Phase::kDisarmed));
  EXPECT_TRUE(vehicle.body.on_ground());
}

TEST_F(SupervisedLoop, StatesThatEndInMidRaceEndLevelOnTheGroundMotorsOff) {
  vehicle.switch_on_at = 102s;
  vehicle.states_until = 110s;
  const LoopStatistics statistics = run();
  EXPECT_EQ(statistics.end, End::kKilled);
  ASSERT_GE(vehicle.phases.size(), 2u);
  EXPECT_EQ(vehicle.phases.end()[-2], Phase::kLevelDescent);
  EXPECT_EQ(controller.last, Wanted::kKilled);
  EXPECT_FALSE(vehicle.armed);
  EXPECT_TRUE(vehicle.body.on_ground()) << "it was down before the motors went off";
  EXPECT_LT(vehicle.body.hardest_touch_m_s, 2.5);
}

TEST_F(SupervisedLoop, AFirmwareKilledInMidRaceEndsTheFlight) {
  vehicle.switch_on_at = 102s;
  vehicle.dies_at = 110s;
  const LoopStatistics statistics = run();
  EXPECT_EQ(statistics.end, End::kKilled);
  EXPECT_THAT(vehicle.phases, ElementsAre(Phase::kReady, Phase::kArming, Phase::kTakeOff, Phase::kHolding,
                                          Phase::kHandOver, Phase::kRacing, Phase::kLevelDescent, Phase::kKilled));
  EXPECT_EQ(controller.armings, 1);
  EXPECT_LT(clock.now(), 120s) << "told to stop for good soon";
}

TEST_F(SupervisedLoop, AFirmwareThatDisarmsInMidRaceIsNotArmedAgain) {
  vehicle.switch_on_at = 102s;
  vehicle.disarms_at = 110s;
  vehicle.over_at = 120s;
  run();
  // Who disarms follows nobody any more, which is heard as soon.
  EXPECT_THAT(vehicle.phases,
              ElementsAre(Phase::kReady, Phase::kArming, Phase::kTakeOff, Phase::kHolding, Phase::kHandOver,
                          Phase::kRacing, Phase::kYielded, Phase::kLanded, Phase::kDisarmed));
  EXPECT_EQ(controller.armings, 1) << "the switch is still on";
  EXPECT_FALSE(vehicle.armed);
}

TEST_F(SupervisedLoop, WhoTookOverIsLeftAloneAndTheProgramMayEnd) {
  vehicle.switch_on_at = 102s;
  vehicle.take_over_at = 110s;
  vehicle.over_at = 112s;
  run();
  EXPECT_EQ(vehicle.phases.back(), Phase::kYielded);
  EXPECT_EQ(controller.last, Wanted::kReleased);
  EXPECT_TRUE(vehicle.armed) << "it is the person's now";
}

}  // namespace
}  // namespace gatefield::flight
