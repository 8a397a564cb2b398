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
/// What only images tell takes a gate that should be seen, and a vehicle that turns.
constexpr double kMounting_s = 1.5;
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

TEST_F(Faults, StatesInNedAndFrdAreTold) {
  const Flown flown = fly_with_states(
      [](const QuadrotorState& state) {
        QuadrotorState ned = state;
        ned.p_WB = flight::ned_from_enu(state.p_WB);
        ned.v_WB = flight::ned_from_enu(state.v_WB);
        ned.q_WB = flight::ned_frd_from_enu_flu(state.q_WB);
        ned.w_WB_B = flight::frd_from_flu(state.w_WB_B);
        return ned;
      },
      {Problem::kThrustAgainstMotion, Problem::kStatesLookNed});
  expect_told(flown, {Problem::kThrustAgainstMotion, Problem::kStatesLookNed});
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

TEST_F(Faults, AFrameNumberFarAheadCostsNoRaceAndIsTold) {
  struct Nobody : dds::ClientHandler {
    void on_reply(const protocol::SessionReply&) override {}
    void on_command(const protocol::ThrustRateCommand&) override {}
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
  expect_won_over_a_jump(fly_with(fault));
}

}  // namespace
}  // namespace gatefield::test
