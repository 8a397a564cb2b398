// A pilot written down and read again, here and in another process.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "server/pilot/pilot_state.pb.h"
#include "tests/support/process.h"
#include "tests/unit/server/pilot/flight.h"

namespace gatefield::pilot {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;

constexpr int kLongest = 600;  // steps of 20 ms
constexpr std::size_t kFewKilobytes = 8 * 1024;

class Move : public ::testing::TestWithParam<protocol::Timing> {
 protected:
  bool lockstep() const { return GetParam() == protocol::Timing::kLockstep; }
};

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

TEST_P(Move, ToAnotherProcessChangesNoBitOfTheCommands) {
  testing::Flight flight(GetParam(), {}, 1);
  const auto pilot = flight.make_pilot();
  int first = 0;
  for (; first < kLongest && flight.target_waypoint() < 2; ++first) flight.fly(pilot.get(), 1);
  ASSERT_EQ(flight.target_waypoint(), 2u) << "half a race";
  const std::string state = pilot->save();
  RecordProperty("state_bytes", static_cast<int>(state.size()));
  EXPECT_LT(state.size(), kFewKilobytes) << "of a race on the shipped circle";
  int then = 0;
  std::string stayed;
  for (; then < kLongest && !flight.done(); ++then) stayed += joined(flight.fly(pilot.get(), 1));
  ASSERT_TRUE(flight.done()) << "the whole race";

  const std::string stem = ::testing::TempDir() + "pilot-" + std::to_string(::getpid());
  std::ofstream(stem + ".state", std::ios::binary) << state;
  test::Process other(
      GATEFIELD_BINARY_DIR "/tests/unit/server/pilot/pilot_flies_on",
      {stem + ".state", lockstep() ? "lockstep" : "real-time", std::to_string(first), std::to_string(then)},
      stem + ".out");
  ASSERT_EQ(other.wait(100s), 0) << other.output();
  EXPECT_EQ(other.output(), stayed);
  std::filesystem::remove(stem + ".state");
  std::filesystem::remove(stem + ".out");
}

TEST_P(Move, AgainAndAgainWithinARaceChangesNothing) {
  testing::Flight stays(GetParam()), moves(GetParam());
  auto pilot = stays.make_pilot();
  const std::vector<std::string> stayed = stays.fly(pilot.get(), 60);
  std::vector<std::string> moved;
  auto mover = moves.make_pilot();
  for (int i = 0; i < 20; ++i) {
    for (std::string& command : moves.fly(mover.get(), 3)) moved.push_back(std::move(command));
    const std::string state = mover->save();
    EXPECT_EQ(mover->save(), state) << "saving changes nothing";
    mover = moves.make_pilot();
    ASSERT_TRUE(mover->restore(state)) << mover->restore(state).error();
    EXPECT_EQ(mover->save(), state) << "all there is was taken over";
  }
  EXPECT_EQ(moved, stayed);
}

TEST_P(Move, OfAVehicleThatIsFlownByRatesChangesNothingEither) {
  testing::Conditions conditions;
  conditions.actuation = {Actuation::Kind::kBodyRates, 0.025, {0.04, 0.04, 0.08}};
  testing::Flight stays(GetParam(), conditions), moves(GetParam(), conditions);
  const auto pilot = stays.make_pilot();
  const std::vector<std::string> stayed = stays.fly(pilot.get(), 140);
  EXPECT_GT(stays.target_waypoint(), 0u) << "there was a gate to pass";
  auto mover = moves.make_pilot();
  std::vector<std::string> moved = moves.fly(mover.get(), 70);
  const std::string state = mover->save();
  mover = moves.make_pilot();
  ASSERT_TRUE(mover->restore(state)) << mover->restore(state).error();
  EXPECT_EQ(mover->save(), state) << "all there is was taken over";
  for (std::string& command : moves.fly(mover.get(), 70)) moved.push_back(std::move(command));
  EXPECT_EQ(moved, stayed);
  EXPECT_EQ(
      stays.problems() & (bit(protocol::Problem::kRateLoopUnlikeTold) | bit(protocol::Problem::kThrustUnlikeTold)), 0u);

  // What was found in flight is what flies.
  protocol::Telemetry telemetry;
  pilot->fill(Stamp{0}, &telemetry);
  EXPECT_NEAR(telemetry.identified.thrust_factor, 1.0, 0.05);
  for (int axis = 0; axis < 2; ++axis)
    EXPECT_NEAR(telemetry.identified.rate_time_constant_s[axis], 0.04, 0.01) << "axis " << axis;
}

TEST_P(Move, ToWhereAnEarlierStateWasReadBeforeChangesNothingEither) {
  testing::Flight flight(GetParam());
  const auto pilot = flight.make_pilot();
  const auto waiting = flight.make_pilot();
  for (int i = 0; i < 5; ++i) {
    flight.fly(pilot.get(), 25);
    const std::string state = pilot->save();
    ASSERT_TRUE(waiting->restore(state)) << waiting->restore(state).error();
    EXPECT_EQ(waiting->save(), state) << "state " << i;
  }
}

/// As a stand-by does it: an older state, and what was heard since.
TEST(MoveOn, FromAnEarlierStateAndWhatCameSinceThePredictionIsTheSame) {
  testing::Flight flight(protocol::Timing::kRealTime);
  const auto pilot = flight.make_pilot();
  flight.fly(pilot.get(), 60);
  const std::string state = pilot->save();
  const std::size_t saved = flight.events().size();
  std::vector<protocol::ThrustRateCommand> commands;
  for (int i = 0; i < 3; ++i) {
    flight.fly(pilot.get(), 1);
    commands.push_back(pilot->stepping().state().command);
  }
  const auto other = flight.make_pilot();
  ASSERT_TRUE(other->restore(state));
  for (const protocol::ThrustRateCommand& command : commands) other->stepping().sent_elsewhere(command);
  for (std::size_t i = saved; i < flight.events().size(); ++i)
    if (const auto* const arrived = std::get_if<StateArrived>(&flight.events()[i]))
      other->intake().take_state(arrived->state, arrived->at);

  other->stepping().absorb();
  pilot->stepping().absorb();
  const Stepping::State& goes_on = other->stepping().state();
  const Stepping::State& stayed = pilot->stepping().state();
  EXPECT_EQ(goes_on.newest.sequence, stayed.newest.sequence);
  EXPECT_EQ(goes_on.command.sequence, stayed.command.sequence);
  const auto sent = goes_on.inputs.pieces(stayed.newest.stamp);
  const auto truly_sent = stayed.inputs.pieces(stayed.newest.stamp);
  ASSERT_EQ(sent.size(), truly_sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(sent[i].from, truly_sent[i].from) << i;
    EXPECT_EQ(sent[i].to, truly_sent[i].to) << i;
    EXPECT_EQ(sent[i].input, truly_sent[i].input) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Timings, Move, ::testing::Values(protocol::Timing::kLockstep, protocol::Timing::kRealTime),
                         [](const auto& timing) {
                           return timing.param == protocol::Timing::kLockstep ? "Lockstep" : "RealTime";
                         });

class SavedState : public ::testing::Test {
 protected:
  SavedState() {
    flight_.fly(pilot_.get(), 30);
    EXPECT_TRUE(state_.ParseFromString(pilot_->save()));
  }
  /// What a new pilot says to the state, which it is left unchanged by.
  Error refusal() {
    const auto other = flight_.make_pilot();
    const std::string before = other->save();
    const Status status = other->restore(state_.SerializeAsString());
    EXPECT_EQ(other->save(), before);
    return status.ok() ? Error("taken") : status.failure();
  }
  testing::Flight flight_{protocol::Timing::kLockstep};
  std::unique_ptr<Pilot> pilot_ = flight_.make_pilot();
  proto::PilotState state_;
};

TEST_F(SavedState, OfAnotherFormatIsRefused) {
  state_.set_format(99);
  EXPECT_EQ(refusal().code, ErrorCode::kVersion);
  EXPECT_THAT(refusal().message, HasSubstr("format is 99"));
}

TEST_F(SavedState, OfAnotherModelIsRefused) {
  state_.set_model_hash(1);
  EXPECT_EQ(refusal().code, ErrorCode::kVersion);
  EXPECT_THAT(refusal().message, HasSubstr("model in use"));
}

TEST_F(SavedState, OfAnotherSessionCourseOrProfileIsRefused) {
  const proto::PilotState good = state_;
  state_.set_session(1);
  EXPECT_EQ(refusal().field, "session");
  state_ = good;
  state_.set_profile("paper");
  EXPECT_EQ(refusal().field, "profile");
  state_ = good;
  state_.mutable_looking()->mutable_gates()->RemoveLast();
  EXPECT_EQ(refusal().field, "looking.gates");
  state_ = good;
  state_.mutable_stepping()->mutable_mean_n_s()->RemoveLast();
  EXPECT_EQ(refusal().field, "stepping.mean_n_s");
  state_ = good;
  state_.mutable_stepping()->mutable_progress()->set_target(4);
  EXPECT_EQ(refusal().field, "stepping.progress");
}

TEST_F(SavedState, ThatIsDamagedIsRefused) {
  const proto::PilotState good = state_;
  state_.mutable_looking()->mutable_gates(0)->add_latent(0.0f);
  EXPECT_EQ(refusal().field, "looking.gates.latent");
  state_ = good;
  state_.mutable_stepping()->mutable_newest()->mutable_state()->set_p_wb(0, std::nan(""));
  EXPECT_EQ(refusal().field, "stepping.newest.state");
  state_ = good;
  state_.mutable_stepping()->mutable_newest()->mutable_state()->set_q_wb(0, 7.0);
  EXPECT_EQ(refusal().field, "stepping.newest.state");
  state_ = good;
  state_.mutable_stepping()->mutable_inputs(0)->set_length(std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(refusal().field, "stepping.inputs");
  state_ = good;
  state_.mutable_intake()->mutable_motion()->mutable_newest()->set_stamp(std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(refusal().field, "intake.motion.stamp");
  state_ = good;
  state_.mutable_stepping()->mutable_solve()->set_value(std::nan(""));
  EXPECT_EQ(refusal().field, "stepping.delay");
  state_ = good;
  state_.mutable_looking()->mutable_gates(0)->mutable_estimate()->set_center_variance_m2(-1.0);
  EXPECT_EQ(refusal().field, "looking.gates.estimate.center_variance_m2");
  state_ = good;
  state_.mutable_looking()->set_target(64);
  EXPECT_EQ(refusal().field, "looking.target");
  const auto other = flight_.make_pilot();
  EXPECT_EQ(other->restore("not a state").failure().code, ErrorCode::kInvalid);
}

TEST_F(SavedState, OfAServerWhoseClockIsOffIsMovedByAsMuch) {
  const auto other = flight_.make_pilot();
  ASSERT_TRUE(other->restore(state_.SerializeAsString(), 7s).ok());
  EXPECT_EQ(other->intake().last_heard(), pilot_->intake().last_heard() + 7s);
  EXPECT_EQ(other->stepping().state().newest.received, pilot_->stepping().state().newest.received + 7s);
}

}  // namespace
}  // namespace gatefield::pilot
