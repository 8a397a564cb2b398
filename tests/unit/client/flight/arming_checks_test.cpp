#include "client/flight/arming_checks.h"

#include <gmock/gmock.h>

#include "tests/unit/client/flight/supervised_flight.h"

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

/// Makes that check fail.
void fail(Check check, SupervisedFlight* flight) {
  switch (check) {
    case Check::kControllerHeard:
      flight->controller_talks = false;
      return;
    case Check::kPilotHeard:
      flight->controller().pilot.reset();
      return;
    case Check::kArmSwitchOff:
      flight->switches().arm = true;
      return;
    case Check::kNotTakenOver:
      flight->switches().take_over = true;
      return;
    case Check::kFirmwareFailsafe:
      flight->controller().failsafe = FirmwareFailsafe::kNotChecked;
      return;
    case Check::kBattery:
      flight->controller().battery_v = 14.9;
      return;
    case Check::kStateFresh:
      flight->states_come = false;
      return;
    case Check::kStill:
      flight->v_W = {0.5, 0, 0};
      return;
    case Check::kInsideFence:
      flight->p_W.z() = 30;
      return;
    case Check::kServerAnswers:
      flight->plan(false);
      return;
    case Check::kRoundTrip:
      flight->observation().round_trip = 200ms;
      return;
    case Check::kFieldSeen:
      flight->observation().field_seen = false;
      return;
    case Check::kServerContent:
      flight->observation().problems = protocol::bit(protocol::Problem::kMountingLooksWrong);
      return;
    case Check::kFlightWanted:
      flight->observation().race_over = true;
      return;
    case Check::kAttitudesAgree:
      flight->controller().q_WB = PlainQuaternion(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())));
      return;
  }
  FAIL() << "how does " << name(check) << " fail?";
}

TEST(ArmingChecks, EachKeepsTheVehicleOnTheGroundAndSaysWhy) {
  for (int i = 0; i < kChecks; ++i) {
    const auto check = static_cast<Check>(i);
    SupervisedFlight flight;
    flight.all_is_well();
    fail(check, &flight);
    flight.pass(3s);
    EXPECT_EQ(flight.phase(), Phase::kDisarmed) << name(check);
    EXPECT_TRUE(flight.supervisor.directive().failing & bit(check)) << name(check);
    const Error error = explain(check, flight.observation(), flight.options);
    EXPECT_EQ(error.field, name(check));
    EXPECT_EQ(error.code, ErrorCode::kInvalid);
    EXPECT_FALSE(error.value.empty()) << name(check);
    EXPECT_GT(error.expected.size(), 10u) << error.message;
  }
}

TEST(ArmingChecks, OneAloneIsTheOnlyOneNamed) {
  for (const Check check : {Check::kFirmwareFailsafe, Check::kBattery, Check::kRoundTrip, Check::kFieldSeen,
                            Check::kServerContent, Check::kNotTakenOver, Check::kInsideFence, Check::kFlightWanted}) {
    SupervisedFlight flight;
    flight.all_is_well();
    fail(check, &flight);
    flight.pass(3s);
    EXPECT_THAT(list(flight.supervisor.directive().failing), ElementsAre(check));
  }
}

TEST(ArmingChecks, AHeadingFromAnywhereIsNoContradiction) {
  SupervisedFlight flight;
  flight.all_is_well();
  flight.controller().q_WB = PlainQuaternion(Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ())));
  flight.pass(3s);
  EXPECT_EQ(flight.phase(), Phase::kReady);
}

TEST(ArmingChecks, AttitudesThatWereApartWhileItWasCarriedAboutKeepItOnTheGround) {
  SupervisedFlight flight;
  flight.all_is_well();
  flight.controller().q_WB = PlainQuaternion(Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX())));
  flight.pass(300ms);  // one of them is late
  flight.controller().q_WB = PlainQuaternion::Identity();
  flight.pass(2s);
  EXPECT_EQ(flight.phase(), Phase::kReady);
  flight.controller().q_WB = PlainQuaternion(Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX())));
  flight.pass(1s);
  flight.controller().q_WB = PlainQuaternion::Identity();
  flight.pass(2s);
  EXPECT_EQ(flight.phase(), Phase::kDisarmed);
  EXPECT_THAT(list(flight.supervisor.directive().failing), ElementsAre(Check::kAttitudesAgree));
}

TEST(ArmingChecks, CanBeToldOtherwise) {
  SupervisorOptions options = SupervisedFlight::usual();
  options.needs_field = options.needs_firmware_failsafe = false;
  options.battery_arm_v = 0;
  options.fence.reset();
  SupervisedFlight flight(options);
  flight.plan(true);
  flight.controller().failsafe = FirmwareFailsafe::kNotChecked;
  flight.controller().battery_v.reset();
  flight.p_W.z() = 30;
  flight.pass(2s);
  EXPECT_EQ(flight.phase(), Phase::kReady);
}

TEST(ArmingChecks, WithoutACameraDepthAloneMayBeMissing) {
  SupervisorOptions options = SupervisedFlight::usual();
  for (const bool needs_depth : {true, false}) {
    options.needs_depth = needs_depth;
    SupervisedFlight flight(options);
    flight.all_is_well();
    flight.observation().problems = protocol::bit(protocol::Problem::kDepthMissing);
    flight.pass(2s);
    EXPECT_EQ(flight.phase(), needs_depth ? Phase::kDisarmed : Phase::kReady);
    flight.observation().problems |= protocol::bit(protocol::Problem::kStatesMissing);
    flight.pass(1s);
    EXPECT_EQ(flight.phase(), Phase::kDisarmed);
    if (!needs_depth) {
      EXPECT_EQ(explain(Check::kServerContent, flight.observation(), options).message.find("depth"), std::string::npos);
    }
  }
}

TEST(ArmingChecks, AFirmwareFailsafeThatIsBadIsNeverGoodEnough) {
  SupervisorOptions options = SupervisedFlight::usual();
  options.needs_firmware_failsafe = false;
  SupervisedFlight flight(options);
  flight.all_is_well();
  flight.controller().failsafe = FirmwareFailsafe::kBad;
  flight.pass(2s);
  EXPECT_EQ(flight.phase(), Phase::kDisarmed);
}

TEST(ArmingChecks, SayWhatIsExpectedAndWhatToDo) {
  SupervisedFlight flight;
  flight.all_is_well();
  fail(Check::kBattery, &flight);
  fail(Check::kRoundTrip, &flight);
  flight.step();
  EXPECT_THAT(explain(Check::kBattery, flight.observation(), flight.options).message,
              HasSubstr("battery is 14.9 V, expected battery_arm_v (15 V) or more: charge it"));
  EXPECT_THAT(explain(Check::kRoundTrip, flight.observation(), flight.options).message,
              HasSubstr("round_trip is 0.2 s, expected round_trip_max (0.15 s) or less: check the link"));
}

}  // namespace
}  // namespace gatefield::flight
