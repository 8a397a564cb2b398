#include "client/bridge/betaflight/ground_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/betaflight_controller.h"
#include "tests/support/link_pair.h"

namespace gatefield::bridge::betaflight {
namespace {

using namespace std::chrono_literals;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A board in a person's hands: who does what is asked for, and says what is to be seen.
class GroundCheck : public testing::Test, protected Person, protected flight::StateSource {
 protected:
  GroundCheck() {
    clock.set(10s);
    cable->on_wait = [this](std::chrono::nanoseconds) { pass(1ms); };
  }

  Result<std::vector<std::string>> check(bool with_states = false) {
    msp::Connection connection(std::make_unique<test::CableEnd>(cable, true), clock);
    auto settings = read_settings(connection, 500ms);
    if (!settings) return settings.failure();
    return check_on_the_ground(&connection, *settings, clock, this, with_states ? this : nullptr, {.patience = 3s});
  }

  void pass(Stamp span) {
    clock.advance(span);
    Eigen::Vector3d w_B = Eigen::Vector3d::Zero();
    if (left_rad > 0) {
      w_B = kHand_rad_s * axis_B;
      left_rad -= kHand_rad_s * seconds(span);
      q_WB = (q_WB * Eigen::Quaterniond(Eigen::AngleAxisd(kHand_rad_s * seconds(span), axis_B))).normalized();
    }
    board.gyro_rad_s = gyro * w_B;
    board.acceleration_g = accelerometer * (q_WB.conjugate() * Eigen::Vector3d::UnitZ());
    const Eigen::Matrix3d R = q_WB.toRotationMatrix();
    board.roll_deg = std::atan2(R(2, 1), R(2, 2)) * kDegrees;
    board.pitch_nose_down_deg = attitude_pitch * -std::asin(R(2, 0)) * kDegrees;
    board.yaw_deg = std::fmod(360.0 - std::atan2(R(1, 0), R(0, 0)) * kDegrees, 360.0);
    board.serve(clock.now());
  }

  void tell(const std::string& sentence) override {
    told.push_back(sentence);
    if (sentence.find("level") != std::string::npos) q_WB.setIdentity();  // lifted and put down, without a turn
    if (sentence.find("right side down") != std::string::npos) turn({1, 0, 0});
    if (sentence.find("nose down") != std::string::npos) turn({0, 1, 0});
    if (sentence.find("to the left") != std::string::npos) turn({0, 0, 1});
  }
  std::optional<std::string> answer() override {
    if (!answers) return std::nullopt;
    for (std::size_t i = 0; i < 4; ++i) {
      if (board.motors_us[i] == 1000) continue;
      EXPECT_EQ(board.motors_us[i], 1080);
      return seen[i];
    }
    return std::nullopt;
  }
  bool leaves() override { return left; }
  std::optional<flight::TimedState> newest(Stamp now) noexcept override {
    flight::TimedState state;
    state.stamp = now;
    state.state.q_WB = (q_SW * q_WB * q_BS).normalized();
    return state;
  }
  void turn(const Eigen::Vector3d& axis) {
    axis_B = axis;
    left_rad = obeys ? 0.8 : 0.0;
  }

  static constexpr double kHand_rad_s = 1.5, kDegrees = 180 / std::numbers::pi;
  ManualClock clock;
  std::shared_ptr<test::Cable> cable = std::make_shared<test::Cable>();
  test::BetaflightController board{std::make_unique<test::CableEnd>(cable, false)};
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d axis_B = Eigen::Vector3d::Zero();
  double left_rad = 0.0;

  // What may be wrong.
  Eigen::Matrix3d gyro = Eigen::Matrix3d::Identity(), accelerometer = Eigen::Matrix3d::Identity();
  double attitude_pitch = 1.0;
  Eigen::Quaterniond q_SW = Eigen::Quaterniond::Identity(), q_BS = Eigen::Quaterniond::Identity();
  std::array<std::string, 4> seen{"1c", "2a", "3a", "4c"};
  bool obeys = true, answers = true, left = false;
  std::vector<std::string> told;
};

TEST_F(GroundCheck, OfABoardThatIsRightItFindsNothingAndLeavesTheMotorsStill) {
  q_SW = Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ());  // a source's heading may count from anywhere
  const auto faults = check(true);
  ASSERT_TRUE(faults.ok()) << faults.error();
  EXPECT_THAT(*faults, IsEmpty());
  EXPECT_THAT(std::vector(board.motors_us.begin(), board.motors_us.begin() + 4), Each(1000));
}

TEST_F(GroundCheck, AGyroOfTheOtherSignAboutZIsFound) {
  gyro.diagonal() = Eigen::Vector3d(1, 1, -1);
  EXPECT_THAT(*check(), ElementsAre(HasSubstr("turned to the left, the gyro says to the right")));
}

TEST_F(GroundCheck, ABoardThatIsTurnedByAQuarterIsFound) {
  gyro = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_THAT(*check(), ElementsAre(HasSubstr("turned right side down, the gyro says nose down"),
                                    HasSubstr("turned nose down, the gyro says left side down")));
}

TEST_F(GroundCheck, ABoardThatIsUpsideDownIsFoundFirst) {
  accelerometer.diagonal() = Eigen::Vector3d(1, -1, -1);
  EXPECT_THAT(*check(), ElementsAre(HasSubstr("its accelerometer says that up is")));
}

TEST_F(GroundCheck, AnAttitudeOfTheOtherSignIsFound) {
  attitude_pitch = -1.0;
  EXPECT_THAT(*check(), ElementsAre(HasSubstr("turned nose down, the firmware's attitude says nose up")));
}

TEST_F(GroundCheck, ASourceWhoseBodyLooksBackwardsIsFound) {
  q_BS = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ());
  EXPECT_THAT(*check(true), ElementsAre(HasSubstr("turned right side down, the source of states says left side down"),
                                        HasSubstr("turned nose down, the source of states says nose up")));
}

TEST_F(GroundCheck, MotorsInAnotherOrderAreFound) {
  seen = {"2a", "1c", "3a", "4c"};
  EXPECT_THAT(*check(), ElementsAre(HasSubstr("motor 1 is the one at the front right, expected the rear right"),
                                    HasSubstr("motor 2 is the one at the rear right, expected the front right")));
}

TEST_F(GroundCheck, MotorsThatTurnTheOtherWayRoundAreFound) {
  seen[2] = "3c";
  EXPECT_THAT(*check(), ElementsAre(HasSubstr("motor 3 turns clockwise, expected anticlockwise")));
}

TEST_F(GroundCheck, YawMotorsReversedAreExpectedToTurnTheOtherWay) {
  board.answers[msp::command::kMixerConfig] = {3, 1};
  seen = {"1a", "2c", "3c", "4a"};
  EXPECT_THAT(*check(), IsEmpty());
}

TEST_F(GroundCheck, AMotorThatDoesNotTurnIsFound) {
  seen[3] = "0";
  EXPECT_THAT(*check(), ElementsAre(HasSubstr("motor 4 did not turn")));
}

TEST_F(GroundCheck, WhoDoesNothingIsNotWaitedForForEver) {
  obeys = false;
  const auto faults = check();
  ASSERT_FALSE(faults.ok());
  EXPECT_EQ(faults.failure().code, ErrorCode::kNoAnswer);
  EXPECT_EQ(faults.failure().field, "person");
  EXPECT_THAT(faults.error(), HasSubstr("nothing happened for 3 s, expected a turn"));
}

TEST_F(GroundCheck, MotorsStopWhenNobodyAnswers) {
  answers = false;
  EXPECT_EQ(check().failure().field, "person");
  EXPECT_THAT(std::vector(board.motors_us.begin(), board.motors_us.begin() + 4), Each(1000));
}

TEST_F(GroundCheck, WhoLeavesEndsIt) {
  left = true;
  EXPECT_THAT(check().error(), HasSubstr("the check was left"));
}

TEST_F(GroundCheck, NothingIsTriedWithABoardThatIsArmed) {
  board.loop().arm_switch(clock.now(), false);
  board.loop().command(clock.now(), {0, 0, 0}, 0);
  board.loop().arm_switch(clock.now(), true);
  (void)board.loop().step(clock.now(), {0, 0, 0}, 1e-3);
  ASSERT_TRUE(board.loop().armed());
  EXPECT_EQ(check().failure().field, "arming");
  EXPECT_THAT(told, IsEmpty());
}

}  // namespace
}  // namespace gatefield::bridge::betaflight
