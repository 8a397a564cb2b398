#include "client/bridge/betaflight/vehicle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "tests/support/betaflight_controller.h"
#include "tests/support/link_pair.h"

namespace gatefield::bridge::betaflight {
namespace {

using namespace std::chrono_literals;
using flight::Wanted;
using testing::HasSubstr;

constexpr Stamp kStep = 10ms;

/// The bridge's vehicle and a board on a cable, with time in the test's hand. The board takes up commands and runs its
/// loop once a millisecond; its body turns as the motors say.
class BetaflightBridge : public testing::Test {
 protected:
  void SetUp() override { begin(); }

  void begin() {
    clock.set(10s);
    cable->on_wait = [this](std::chrono::nanoseconds) {
      clock.advance(1ms);
      board.serve(clock.now());
    };
    auto connection = std::make_unique<msp::Connection>(std::make_unique<test::CableEnd>(cable, true), clock);
    auto settings = read_settings(*connection, 500ms);
    ASSERT_TRUE(settings.ok()) << settings.error();
    vehicle = std::make_unique<BetaflightVehicle>(options, model, *settings, std::move(connection));
  }

  /// A millisecond of the board: at most one command, as a serial task of 1000 Hz would.
  void run_board() {
    clock.advance(1ms);
    if (board_works) board.serve(clock.now(), commands_per_ms);
    const auto motors = board.loop().step(clock.now(), w, 1e-3);
    thrust = Eigen::Map<const Eigen::Vector4d>(motors.data()).cwiseAbs2() * kMaxThrust_n;
    // rear right, front right, rear left, front left; about x left against right, about y rear against front, about z
    // what turns right against what turns left
    const Eigen::Vector3d torque(0.077 * (-thrust[0] - thrust[1] + thrust[2] + thrust[3]),
                                 0.077 * (thrust[0] - thrust[1] + thrust[2] - thrust[3]),
                                 0.016 * (thrust[0] - thrust[1] - thrust[2] + thrust[3]));
    w += 1e-3 * torque.cwiseQuotient(model.inertia_kg_m2);
    board.gyro_rad_s = w;
  }

  void run(Stamp span, const std::optional<sdk::Setpoint>& setpoint) {
    for (const Stamp end = clock.now() + span; clock.now() < end;) {
      vehicle->want(clock.now(), wanted);
      if (setpoint) {
        vehicle->apply(clock.now(), *setpoint);
      } else {
        vehicle->hold(clock.now());
      }
      for (Stamp elapsed{0}; elapsed < kStep; elapsed += 1ms) run_board();
      (void)vehicle->newest(clock.now());
    }
  }

  void arm() {
    wanted = Wanted::kDisarmed;
    run(300ms, std::nullopt);
    wanted = Wanted::kArmed;
    run(300ms, std::nullopt);
    ASSERT_TRUE(vehicle->newest(clock.now())->armed);
  }

  static sdk::Setpoint setpoint(const Eigen::Vector3d& rates, double collective_n) {
    sdk::Setpoint made;
    made.body_rates_rad_s = rates;
    made.collective_thrust_n = collective_n;
    return made;
  }

  static constexpr double kMaxThrust_n = 10.0;
  ManualClock clock;
  std::shared_ptr<test::Cable> cable = std::make_shared<test::Cable>();
  test::BetaflightController board{std::make_unique<test::CableEnd>(cable, false)};
  Options options;
  QuadrotorModel model;
  std::unique_ptr<BetaflightVehicle> vehicle;
  Wanted wanted = Wanted::kDisarmed;
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
  Eigen::Vector4d thrust = Eigen::Vector4d::Zero();
  int commands_per_ms = 1;
  bool board_works = true;
};

TEST_F(BetaflightBridge, IsAPortOfRatesAndSaysWhatItFound) {
  EXPECT_EQ(vehicle->accepts(), flight::SetpointPart::kCollectiveAndBodyRates);
  EXPECT_EQ(vehicle->period(), 10ms);
  EXPECT_EQ(vehicle->states(), nullptr);
  EXPECT_THAT(vehicle->description().front(), HasSubstr("Betaflight 4.5.1"));
  EXPECT_FALSE(vehicle->newest(clock.now()).has_value()) << "nothing was heard yet";
}

TEST_F(BetaflightBridge, ArmsWhenItIsWantedAndNotBefore) {
  run(500ms, setpoint({0, 0, 0}, 9));
  EXPECT_FALSE(board.loop().armed());
  EXPECT_EQ(board.loop().throttle(), 0.0) << "nothing but standing is sent";
  arm();
  wanted = Wanted::kDisarmed;
  run(100ms, setpoint({0, 0, 0}, 9));
  EXPECT_FALSE(board.loop().armed());
  EXPECT_FALSE(vehicle->newest(clock.now())->armed);
}

TEST_F(BetaflightBridge, TheThrottleStaysDownUntilTheFirmwareSaysThatItIsArmed) {
  run(200ms, std::nullopt);
  board.reasons = 1u << 8;
  wanted = Wanted::kArmed;
  run(300ms, setpoint({1, 0, 0}, 12));
  EXPECT_FALSE(board.loop().armed());
  EXPECT_EQ(board.loop().throttle(), 0.0);
  EXPECT_THAT(vehicle->complaints(), testing::ElementsAre(HasSubstr("not level")));
  board.reasons = 0;
  run(300ms, setpoint({0, 0, 0}, 12));
  EXPECT_TRUE(board.loop().armed());
  EXPECT_GT(board.loop().throttle(), 0.2);
}

TEST_F(BetaflightBridge, TheArmSwitchStaysOffWhileSomethingStandsAgainstArming) {
  board.reasons = 1u << 5;  // it has just started
  wanted = Wanted::kArmed;
  run(500ms, std::nullopt);
  EXPECT_FALSE(board.loop().armed());
  EXPECT_LT(board.channels()[4], 1700) << "a switch that is on too early would have to go off first";
  board.reasons = 0;
  run(300ms, std::nullopt);
  EXPECT_TRUE(board.loop().armed());
}

TEST_F(BetaflightBridge, RatesAreFlownAboutEveryAxisBothWays) {
  arm();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double rate : {3.0, -3.0}) {
      Eigen::Vector3d rates = Eigen::Vector3d::Zero();
      rates[axis] = axis == 2 ? rate / 3 : rate;
      run(600ms, setpoint(rates, 15));
      EXPECT_LT((w - rates).norm(), 0.15) << axis << " " << rate << ": " << w.transpose();
    }
  }
}

TEST_F(BetaflightBridge, ThrottleIsWhatTheThrustAsksFor) {
  arm();
  run(200ms, setpoint({0, 0, 0}, model.mass_kg * kGravity_m_s2));
  EXPECT_NEAR(board.loop().throttle(), options.thrust.hover_throttle, 0.002);
}

TEST_F(BetaflightBridge, ReportsWhatTheFirmwareSays) {
  board.roll_deg = 20;
  board.pitch_nose_down_deg = 10;
  board.yaw_deg = 90;
  board.battery_v = 15.2;
  run(500ms, std::nullopt);
  const auto status = vehicle->newest(clock.now());
  ASSERT_TRUE(status.has_value());
  EXPECT_FALSE(status->armed);
  EXPECT_TRUE(status->follows_us);
  EXPECT_FALSE(status->own_failsafe);
  EXPECT_FALSE(status->pilot.has_value());
  EXPECT_NEAR(status->battery_v.value(), 15.2, 1e-9);
  EXPECT_NEAR(status->specific_force_z_m_s2.value(), kGravity_m_s2, 0.01);
  EXPECT_EQ(status->failsafe, flight::FirmwareFailsafe::kGood);
  EXPECT_LE(clock.now() - status->stamp, 50ms);
  // heading east: ENU yaw 0; nose down is +y of FLU, right wing down +x
  const Eigen::Quaterniond expected = Eigen::AngleAxisd(10 * 3.14159265 / 180, Eigen::Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(20 * 3.14159265 / 180, Eigen::Vector3d::UnitX());
  EXPECT_LT(Eigen::Quaterniond(*status->q_WB).angularDistance(expected), 1e-3);
}

TEST_F(BetaflightBridge, OfSensorsInOddUnitsGravityIsLearnedOnTheGround) {
  board.acceleration_g = {0, 0, 0.125};  // 256 counts
  run(500ms, std::nullopt);
  EXPECT_NEAR(vehicle->newest(clock.now())->specific_force_z_m_s2.value(), kGravity_m_s2, 0.01);
  arm();
  board.acceleration_g = {0, 0, 0.25};
  run(300ms, setpoint({0, 0, 0}, 9));
  EXPECT_NEAR(vehicle->newest(clock.now())->specific_force_z_m_s2.value(), 2 * kGravity_m_s2, 0.01);
}

TEST_F(BetaflightBridge, KilledDisarmsInTheAir) {
  arm();
  run(200ms, setpoint({0, 0, 0}, 9));
  wanted = Wanted::kKilled;
  run(20ms, setpoint({0, 0, 0}, 9));
  EXPECT_FALSE(board.loop().armed());
}

TEST_F(BetaflightBridge, ReleasedSendsNoChannelsSoThatTheFirmwaresFailsafeEndsTheFlight) {
  arm();
  run(200ms, setpoint({0, 0, 0}, 9));
  wanted = Wanted::kReleased;
  const auto sets = board.channel_sets();
  run(1s, setpoint({0, 0, 0}, 9));
  EXPECT_LE(board.channel_sets(), sets + 1);
  EXPECT_FALSE(board.loop().armed());
  EXPECT_TRUE(board.loop().in_failsafe());
  EXPECT_TRUE(vehicle->newest(clock.now())->own_failsafe) << "it is still asked";
  EXPECT_FALSE(vehicle->newest(clock.now())->follows_us);
}

TEST_F(BetaflightBridge, ASetpointThatIsNotFiniteIsFlownAsStanding) {
  arm();
  run(200ms, setpoint({0, 0, 0}, 9));
  run(50ms, setpoint({std::numeric_limits<double>::quiet_NaN(), 0, 0}, 9));
  EXPECT_EQ(board.loop().throttle(), 0.0);
  EXPECT_TRUE(board.loop().armed());
  run(50ms, setpoint({0, 0, 0}, std::numeric_limits<double>::infinity()));
  EXPECT_EQ(board.loop().throttle(), 0.0);
}

TEST_F(BetaflightBridge, AFirmwareThatHangsGrowsOldAndIsNotFilledUp) {
  arm();
  const Stamp heard = vehicle->newest(clock.now())->stamp;
  board_works = false;
  run(2s, setpoint({0, 0, 0}, 9));
  EXPECT_LE(vehicle->newest(clock.now())->stamp, heard + 20ms) << "who watches the stamp sees it";
  EXPECT_LT(cable->to_board.size(), 60u * 2 * 2 * 8) << "two commands every quarter of a second, no more";
  EXPECT_GT(vehicle->channels_skipped(), 100u);
  board_works = true;
  run(600ms, std::nullopt);
  EXPECT_GE(vehicle->newest(clock.now())->stamp, clock.now() - 50ms) << "it is heard again";
}

TEST_F(BetaflightBridge, ASlowSerialTaskStillHearsChannelsAndIsHeard) {
  arm();
  // one command in ten milliseconds, as Betaflight comes
  commands_per_ms = 0;
  const auto sets = board.channel_sets();
  Stamp oldest{0};
  for (int i = 0; i < 200; ++i) {
    vehicle->want(clock.now(), wanted);
    vehicle->apply(clock.now(), setpoint({0, 0, 0}, 9));
    for (int ms = 0; ms < 10; ++ms) run_board();
    board.serve(clock.now(), 1);
    if (i > 20) oldest = std::max(oldest, clock.now() - vehicle->newest(clock.now())->stamp);
  }
  EXPECT_GT(board.channel_sets() - sets, 80u) << "of 200 commands";
  EXPECT_LT(oldest, 200ms);
  EXPECT_TRUE(board.loop().armed());
}

TEST_F(BetaflightBridge, ANoisyLineCostsAnswersAndNothingElse) {
  std::mt19937 random(5);
  cable->noise = [&](std::deque<std::uint8_t>* bytes) {
    if (random() % 10 == 0) (*bytes)[random() % bytes->size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
    if (random() % 20 == 0) bytes->erase(bytes->begin() + static_cast<std::ptrdiff_t>(random() % bytes->size()));
  };
  arm();
  const Eigen::Vector3d rates(2, -1, 0.5);
  for (int i = 0; i < 30; ++i) {
    run(100ms, setpoint(rates, 12));
    const auto status = vehicle->newest(clock.now());
    EXPECT_TRUE(status->armed);
    EXPECT_LT(clock.now() - status->stamp, 400ms);
  }
  EXPECT_LT((w - rates).norm(), 0.15);
}

TEST_F(BetaflightBridge, ACableThatIsCutEndsInTheFirmwaresFailsafe) {
  arm();
  run(200ms, setpoint({0, 0, 0}, 9));
  cable->cut = true;
  run(700ms, setpoint({0, 0, 0}, 9));
  EXPECT_FALSE(board.loop().armed());
}

class Kept final : public ChannelSink {
 public:
  bool send(const Channels::Pulses& pulses) noexcept override {
    newest = pulses;
    ++sets;
    return true;
  }
  Channels::Pulses newest{};
  int sets = 0;
};

TEST_F(BetaflightBridge, ChannelsThatGoAnotherWayDoNotGoOverMsp) {
  Kept kept;
  vehicle->send_through(&kept, 2ms);
  EXPECT_EQ(vehicle->period(), 2ms);
  const std::uint64_t before = board.channel_sets();
  run(100ms, std::nullopt);
  EXPECT_GT(kept.sets, 5);
  EXPECT_EQ(kept.newest[0], 1500);
  EXPECT_EQ(board.channel_sets(), before);
  EXPECT_TRUE(vehicle->newest(clock.now()).has_value()) << "the rest is asked for over MSP";
}

TEST_F(BetaflightBridge, ABrokenLinkIsComplainedOf) {
  run(300ms, std::nullopt);
  EXPECT_TRUE(vehicle->complaints().empty());
  cable->broken = EIO;
  run(20ms, std::nullopt);
  EXPECT_THAT(vehicle->complaints(), testing::Contains(HasSubstr("cable broke")));
}

TEST_F(BetaflightBridge, OverrideTellsThePersonsSwitches) {
  options.receiver = Options::Receiver::kOverride;
  board.answers[msp::command::kBoxIds] = {msp::kModeArm, msp::kModeMspOverride, msp::kModeFailsafe};
  begin();
  run(500ms, std::nullopt);
  const auto status = vehicle->newest(clock.now());
  ASSERT_TRUE(status->pilot.has_value());
  EXPECT_TRUE(status->pilot->take_over) << "the override's switch is off";
  EXPECT_FALSE(status->pilot->arm);
  EXPECT_FALSE(status->follows_us);
  EXPECT_EQ(status->failsafe, flight::FirmwareFailsafe::kNotChecked);
  EXPECT_THAT(vehicle->complaints(), testing::Contains(HasSubstr("keeps the last channels")));
}

}  // namespace
}  // namespace gatefield::bridge::betaflight
