#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "client/flight/frames.h"
#include "common/dds/client_endpoint.h"
#include "tests/integration/faults/faulty_flight.h"
#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
using protocol::Problem;
using simulator::Outcome;

/// One server for all flights.
class Faults : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    programs_ = std::make_unique<Programs>("faults");
    server_ = std::make_unique<Process>(programs_->server("server.log"));
    ASSERT_TRUE(server_->wait_for_output("ready: server", 60s)) << server_->output();
  }
  static void TearDownTestSuite() {
    server_.reset();
    programs_.reset();
  }

 private:
  static std::unique_ptr<Programs> programs_;
  static std::unique_ptr<Process> server_;
};
std::unique_ptr<Programs> Faults::programs_;
std::unique_ptr<Process> Faults::server_;

TEST_F(Faults, ARaceWithoutAnyHearsOfNone) {
  const Flown flown = fly_with({});
  EXPECT_EQ(flown.report.outcome, Outcome::kFinished) << flown.story();
  EXPECT_TRUE(flown.heard_s.empty()) << flown.story();
}

/// Told so long after the vehicle begins to move: before that nothing contradicts anything.
constexpr double kStates_s = 1.0;
/// What only images tell takes a gate that should be seen.
constexpr double kMounting_s = 1.0;
constexpr double kDepth_s = 4.0;

void expect_told(const Flown& flown, std::initializer_list<Problem> problems, double within_s = kStates_s) {
  for (const Problem problem : problems) {
    const auto heard = flown.heard_s.find(problem);
    ASSERT_NE(heard, flown.heard_s.end()) << protocol::name(problem) << " was not told\n" << flown.story();
    EXPECT_LE(heard->second, flown.moving_s + within_s) << protocol::name(problem) << "\n" << flown.story();
  }
}
/// Another likely cause is not told beside the right one.
void expect_no_other_cause(const Flown& flown, Problem right) {
  for (const Problem cause : {Problem::kStatesLookNed, Problem::kQuaternionLooksWFirst,
                              Problem::kVelocityLooksBodyFrame, Problem::kRatesLookWorldFrame,
                              Problem::kRotorsLookSwapped, Problem::kMountingLooksWrong, Problem::kDepthUnitLooksWrong})
    EXPECT_TRUE(cause == right || !flown.heard_s.contains(cause)) << protocol::name(cause) << "\n" << flown.story();
}

// ---- states ---------------------------------------------------------------------------------------------------------

Flown fly_with_states(QuadrotorState (*as_sent)(const QuadrotorState&), std::set<Problem> until_heard) {
  Fault fault;
  fault.falsification.state = as_sent;
  fault.until_heard = std::move(until_heard);
  return fly_with(fault);
}

/// A machine that is busy lets the simulated vehicle wait: such a flight in real time says nothing, and is flown again.
Flown fly_in_real_time(const std::function<Fault()>& make) {
  for (int attempt = 0; attempt < 5; ++attempt) {
    Fault fault = make();
    fault.timing = protocol::Timing::kRealTime;
    Flown flown = fly_with(fault);
    if (flown.report.loop_worst_s <= 0.02) return flown;
  }
  ADD_FAILURE() << "the simulator's loop was late by more than 20 ms in each flight: the machine is too busy";
  return {};
}

QuadrotorState ned(const QuadrotorState& state) {
  QuadrotorState ned = state;
  ned.p_WB = flight::ned_from_enu(state.p_WB);
  ned.v_WB = flight::ned_from_enu(state.v_WB);
  ned.q_WB = flight::ned_frd_from_enu_flu(state.q_WB);
  ned.w_WB_B = flight::frd_from_flu(state.w_WB_B);
  return ned;
}

Fault states_in_ned() {
  Fault fault;
  fault.falsification.state = ned;
  fault.until_heard = {Problem::kStatesLookNed};
  return fault;
}

TEST_F(Faults, StatesInNedAndFrdAreTold) {
  Fault fault = states_in_ned();
  for (const bool one_gate : {false, true}) {
    fault.one_gate = one_gate;
    const Flown flown = fly_with(fault);
    expect_told(flown, {Problem::kThrustAgainstMotion, Problem::kStatesLookNed});
    expect_no_other_cause(flown, Problem::kStatesLookNed);
  }
}

TEST_F(Faults, StatesInNedAndFrdAreToldInRealTime) {
  const Flown flown = fly_in_real_time([] {
    Fault fault = states_in_ned();
    fault.one_gate = true;
    return fault;
  });
  expect_told(flown, {Problem::kStatesLookNed});
  expect_no_other_cause(flown, Problem::kStatesLookNed);
}

TEST_F(Faults, AQuaternionWithWFirstIsTold) {
  const Flown flown = fly_with_states(
      [](const QuadrotorState& state) {
        QuadrotorState shifted = state;
        shifted.q_WB = flight::from_xyzw(flight::wxyz(state.q_WB));
        return shifted;
      },
      {Problem::kQuaternionLooksWFirst});
  expect_told(flown, {Problem::kQuaternionLooksWFirst});
  expect_no_other_cause(flown, Problem::kQuaternionLooksWFirst);
}

TEST_F(Faults, AVelocityInTheBodyFrameIsTold) {
  const Flown flown = fly_with_states(
      [](const QuadrotorState& state) {
        QuadrotorState body = state;
        body.v_WB = state.q_WB.conjugate() * state.v_WB;
        return body;
      },
      {Problem::kVelocityAgainstMotion, Problem::kVelocityLooksBodyFrame});
  expect_told(flown, {Problem::kVelocityAgainstMotion, Problem::kVelocityLooksBodyFrame});
  expect_no_other_cause(flown, Problem::kVelocityLooksBodyFrame);
}

TEST_F(Faults, RatesInTheWorldFrameAreTold) {
  const Flown flown = fly_with_states(
      [](const QuadrotorState& state) {
        QuadrotorState world = state;
        world.w_WB_B = state.q_WB * state.w_WB_B;
        return world;
      },
      {Problem::kRatesAgainstAttitude, Problem::kRatesLookWorldFrame});
  expect_told(flown, {Problem::kRatesAgainstAttitude, Problem::kRatesLookWorldFrame});
  expect_no_other_cause(flown, Problem::kRatesLookWorldFrame);
}

TEST_F(Faults, RatesInFrdAreTold) {
  const Flown flown = fly_with_states(
      [](const QuadrotorState& state) {
        QuadrotorState frd = state;
        frd.w_WB_B = flight::frd_from_flu(state.w_WB_B);
        return frd;
      },
      {Problem::kRatesAgainstAttitude});
  expect_told(flown, {Problem::kRatesAgainstAttitude});
  expect_no_other_cause(flown, Problem::kRatesAgainstAttitude);
}

/// Beyond the gate, as if it had been flown through: the vehicle's place mirrored at the gate's.
TEST_F(Faults, OnePositionBeyondTheGateCostsNoRaceAndIsTold) {
  Fault fault;
  fault.falsification.before_state = [sent = false](sdk::Client* client, Stamp stamp,
                                                    const QuadrotorState& state) mutable {
    if (sent || stamp < simulator::kLockstepEpoch + 1s) return;
    sent = true;
    QuadrotorState beyond = state;
    beyond.p_WB = 2.0 * Eigen::Vector3d(8.0, 0.0, 1.5) - state.p_WB;
    client->wait_for_answer(client->send_state(stamp - 1ms, beyond), 200ms);  // alone: nothing newer hides it
  };
  fault.one_gate = true;
  const Flown flown = fly_with(fault);
  EXPECT_EQ(flown.report.outcome, Outcome::kFinished) << flown.story();
  EXPECT_LE(flown.report.fallback_s, 0.2) << flown.story();
  ASSERT_EQ(flown.heard_s.count(Problem::kStatesRejected), 1u) << flown.story();
  EXPECT_EQ(flown.heard_s.size(), 1u) << flown.story();
}

// ---- rotors ---------------------------------------------------------------------------------------------------------

TEST_F(Faults, SpinsUnlikeTheTrueOnesAreTold) {
  Fault fault;
  fault.told = [](sdk::Options* told) {
    for (int& spin : told->quadrotor.rotor_spin) spin = -spin;
  };
  fault.until_heard = {Problem::kRotorsLookSwapped};
  const Flown flown = fly_with(fault);
  expect_told(flown, {Problem::kRotorsLookSwapped});
  expect_no_other_cause(flown, Problem::kRotorsLookSwapped);
}

TEST_F(Faults, RotorsInAnotherOrderAreTold) {
  Fault fault;
  fault.told = [](sdk::Options* told) {
    std::rotate(told->quadrotor.rotor_position_B_m.begin(), told->quadrotor.rotor_position_B_m.begin() + 1,
                told->quadrotor.rotor_position_B_m.end());
    std::rotate(told->quadrotor.rotor_spin.begin(), told->quadrotor.rotor_spin.begin() + 1,
                told->quadrotor.rotor_spin.end());
  };
  fault.until_heard = {Problem::kRotorsLookSwapped};
  const Flown flown = fly_with(fault);
  expect_told(flown, {Problem::kRotorsLookSwapped});
  expect_no_other_cause(flown, Problem::kRotorsLookSwapped);
}

// ---- depth ----------------------------------------------------------------------------------------------------------

/// Depth is read as `factor` times what it is: the client told another unit than its images are in.
void must_tell_depth_off_by(double factor) {
  Fault fault;
  fault.told = [factor](sdk::Options* told) { told->camera.metres_per_count *= factor; };
  fault.until_heard = {Problem::kDepthUnitLooksWrong};
  const Flown flown = fly_with(fault);
  expect_told(flown, {Problem::kDepthUnitLooksWrong}, kDepth_s);
  expect_no_other_cause(flown, Problem::kDepthUnitLooksWrong);
}

TEST_F(Faults, DepthFourTimesTooFarIsTold) { must_tell_depth_off_by(4.0); }
TEST_F(Faults, DepthFiveTimesTooFarIsTold) { must_tell_depth_off_by(5.0); }
TEST_F(Faults, DepthFourTimesTooNearIsTold) { must_tell_depth_off_by(0.25); }

TEST_F(Faults, MillimetresSentAsMetresAreTold) {
  Fault fault;
  fault.depth_in_counts = false;
  fault.falsification.metres = [](std::vector<float>* image) {
    for (float& depth : *image) depth *= 1000.0f;
  };
  fault.until_heard = {Problem::kDepthUnitLooksWrong};
  const Flown flown = fly_with(fault);
  expect_told(flown, {Problem::kDepthUnitLooksWrong}, kDepth_s);
  expect_no_other_cause(flown, Problem::kDepthUnitLooksWrong);
}

TEST_F(Faults, ACameraUpsideDownIsTold) {
  Fault fault;
  fault.falsification.counts = [](std::vector<std::uint16_t>* image) { std::reverse(image->begin(), image->end()); };
  fault.until_heard = {Problem::kMountingLooksWrong};
  const Flown flown = fly_with(fault);
  expect_told(flown, {Problem::kMountingLooksWrong}, kMounting_s);
  expect_no_other_cause(flown, Problem::kMountingLooksWrong);
}

TEST_F(Faults, DepthInAnotherUnitThatIsToldIsFlown) {
  Fault fault;
  fault.told = [](sdk::Options* told) { told->camera.metres_per_count = 0.0005; };
  fault.falsification.counts = [](std::vector<std::uint16_t>* image) {
    for (std::uint16_t& count : *image) count = static_cast<std::uint16_t>(2 * count);
  };
  const Flown flown = fly_with(fault);
  EXPECT_EQ(flown.report.outcome, Outcome::kFinished) << flown.story();
  EXPECT_TRUE(flown.heard_s.empty()) << flown.story();
}

// ---- time -----------------------------------------------------------------------------------------------------------

constexpr Stamp kFaultAt = simulator::kLockstepEpoch + 1500ms;

/// The race is won, at most 0.2 s of it without a plan, and the client knows that its stamps were odd.
void expect_won_over_a_jump(const Flown& flown) {
  EXPECT_EQ(flown.report.outcome, Outcome::kFinished) << flown.story();
  EXPECT_LE(flown.report.fallback_s, 0.2) << flown.story();
  ASSERT_EQ(flown.heard_s.count(Problem::kStampsJump), 1u) << flown.story();
  EXPECT_NEAR(flown.heard_s.at(Problem::kStampsJump), seconds(kFaultAt - simulator::kLockstepEpoch), 1.0);
}

TEST_F(Faults, AClockThatBeginsAnewCostsAFewPlansAndIsTold) {
  Fault fault;
  fault.falsification.clock = [](Stamp stamp) { return stamp < kFaultAt ? stamp : stamp - kFaultAt; };
  expect_won_over_a_jump(fly_with(fault));
}

TEST_F(Faults, AClockThatBeginsAnewCostsAFewPlansInRealTime) {
  const Flown flown = fly_in_real_time([] {
    Fault fault;
    const Stamp begins_anew = MonotonicClock().now() + 4s;
    fault.falsification.clock = [begins_anew](Stamp stamp) {
      return stamp < begins_anew ? stamp : stamp - begins_anew;
    };
    return fault;
  });
  EXPECT_EQ(flown.report.outcome, Outcome::kFinished) << flown.story();
  EXPECT_LE(flown.report.fallback_s, 0.2) << flown.story();
  EXPECT_EQ(flown.heard_s.count(Problem::kStampsJump), 1u) << flown.story();
}

TEST_F(Faults, AStampFarAheadCostsNoRaceAndIsTold) {
  Fault fault;
  fault.falsification.before_state = [sent = false](sdk::Client* client, Stamp stamp,
                                                    const QuadrotorState& state) mutable {
    if (sent || stamp < kFaultAt) return;
    sent = true;
    client->send_state(Stamp::max(), state);
  };
  expect_won_over_a_jump(fly_with(fault));
}

TEST_F(Faults, AFrameOfAnotherParticipantChangesNothing) {
  struct Nobody : dds::ClientHandler {
    void on_reply(const protocol::SessionReply&, const dds::ParticipantId&) override {}
    void on_command(const protocol::ThrustRateCommand&, const dds::ParticipantId&) override {}
    void on_telemetry(const protocol::Telemetry&) override {}
    void on_rejected(dds::Topic, const std::string&) override {}
  } nobody;
  const std::string vehicle = sdk::Options().vehicle;
  auto endpoint = dds::ClientEndpoint::create(own_domain(), vehicle, &nobody);
  ASSERT_TRUE(endpoint.ok()) << endpoint.error();
  Fault fault;
  fault.falsification.before_state = [&, sent = false](sdk::Client* client, Stamp stamp,
                                                       const QuadrotorState&) mutable {
    if (sent || stamp < kFaultAt) return;
    sent = true;
    const CameraModel camera = default_camera();
    protocol::DepthFrame frame;
    frame.vehicle = vehicle;
    frame.session = client->session().session;
    frame.sequence = std::numeric_limits<std::uint64_t>::max();
    frame.stamp = stamp;
    frame.width_px = static_cast<std::uint32_t>(camera.width_px);
    frame.height_px = static_cast<std::uint32_t>(camera.height_px);
    frame.pixels.resize(std::size_t{2} * frame.width_px * frame.height_px);
    EXPECT_TRUE(endpoint.value()->publish(frame));
  };
  const Flown flown = fly_with(fault);
  EXPECT_EQ(flown.report.outcome, Outcome::kFinished) << flown.story();
  EXPECT_TRUE(flown.heard_s.empty()) << flown.story();
}

}  // namespace
}  // namespace gatefield::test
