#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>
#include <thread>

#include "client/bridge/betaflight/vehicle.h"
#include "client/firmware/betaflight_sitl/exchange.h"
#include "tests/integration/betaflight/real_firmware.h"
#include "tests/support/sitl_board.h"

namespace gatefield::bridge::betaflight {
namespace {

using namespace std::chrono_literals;
namespace sitl = firmware::betaflight_sitl;
using flight::Wanted;

/// Through a flight controller on this machine, in real time: what the bridge asks for becomes channels, the firmware's
/// motors turn a body that hangs in its centre of mass, and its gyro goes back.
class Flown {
 public:
  Flown(std::uint16_t msp_port, const sitl::ExchangeOptions& ports) {
    auto exchange = sitl::Exchange::open(ports, clock_);
    if (!exchange) throw std::runtime_error(exchange.error());
    exchange_ = std::move(exchange).value();
    connect(msp_port);
  }

  BetaflightVehicle& vehicle() { return *vehicle_; }
  sitl::Exchange& exchange() { return *exchange_; }
  const Eigen::Vector3d& rates() const { return w_; }
  const sitl::Motors& motors() const { return motors_; }

  void run(Stamp span, Wanted wanted, const Eigen::Vector3d& rates, double collective_n) {
    sdk::Setpoint setpoint;
    setpoint.body_rates_rad_s = rates;
    setpoint.collective_thrust_n = collective_n;
    const Stamp begin = clock_.now();
    Stamp next_step = begin, last = begin;
    for (Stamp now = begin; now - begin < span; now = clock_.now()) {
      turn(std::min(seconds(now - last), 0.01));
      last = now;
      if (now >= next_step) {
        vehicle_->want(now, wanted);
        vehicle_->apply(now, setpoint);
        next_step += vehicle_->period();
      }
      (void)vehicle_->newest(now);
      std::this_thread::sleep_for(500us);
    }
  }

  /// Until it says that it is armed. @return false: it does not within `limit`
  bool arm(Stamp limit) {
    const Stamp end = clock_.now() + limit;
    while (clock_.now() < end) {
      run(200ms, Wanted::kDisarmed, {0, 0, 0}, 0);
      if (!vehicle_->complaints().empty()) continue;
      run(500ms, Wanted::kArmed, {0, 0, 0}, 0);
      if (vehicle_->newest(clock_.now())->armed) return true;
    }
    return false;
  }

 private:
  void connect(std::uint16_t msp_port) {
    Options options;
    options.link = *firmware::parse_address("tcp:127.0.0.1:" + std::to_string(msp_port));
    const Stamp end = clock_.now() + 10s;
    while (true) {
      auto vehicle = betaflight::open(options, model_, clock_);
      if (vehicle) {
        vehicle_ = std::move(vehicle).value();
        return;
      }
      if (clock_.now() > end) throw std::runtime_error(vehicle.error());
      std::this_thread::sleep_for(100ms);
    }
  }

  void turn(double dt_s) {
    sitl::State state;
    state.body_rates_rad_s = w_;
    state.specific_force_m_s2 = {0, 0, kGravity_m_s2};
    if (const auto motors = exchange_->exchange(state)) motors_ = *motors;
    constexpr double kMaxThrust_n = 10.0, kArm_m = 0.077, kTorquePerThrust_m = 0.016, kMotorLag_s = 0.02;
    Eigen::Vector4d wanted;
    for (int i = 0; i < 4; ++i) {
      const double output = motors_[static_cast<std::size_t>(i)];
      wanted[i] = kMaxThrust_n * output * output;
    }
    thrust_ += dt_s / (kMotorLag_s + dt_s) * (wanted - thrust_);
    // rear right, front right, rear left, front left; FLU
    const Eigen::Vector3d torque(kArm_m * (thrust_[2] + thrust_[3] - thrust_[0] - thrust_[1]),
                                 kArm_m * (thrust_[0] + thrust_[2] - thrust_[1] - thrust_[3]),
                                 kTorquePerThrust_m * (thrust_[0] + thrust_[3] - thrust_[1] - thrust_[2]));
    w_ += dt_s * (torque - 1e-3 * w_).cwiseQuotient(model_.inertia_kg_m2);
  }

  const MonotonicClock clock_;
  QuadrotorModel model_;
  std::unique_ptr<sitl::Exchange> exchange_;
  std::unique_ptr<BetaflightVehicle> vehicle_;
  sitl::Motors motors_{};
  Eigen::Vector4d thrust_ = Eigen::Vector4d::Zero();
  Eigen::Vector3d w_ = Eigen::Vector3d::Zero();
};

/// Every axis, both ways, comes to what was asked for.
void expect_rates_flown(Flown& flown, double tolerance_rad_s) {
  for (int axis = 0; axis < 3; ++axis) {
    const bool yaw = axis == 2;  // little torque, and a long settling
    for (const double rate : yaw ? std::array{1.2, -1.2} : std::array{2.5, -2.5}) {
      Eigen::Vector3d rates = Eigen::Vector3d::Zero();
      rates[axis] = rate;
      flown.run(yaw ? 1800ms : 700ms, Wanted::kArmed, rates, 14);
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      constexpr int kSamples = 20;
      for (int i = 0; i < kSamples; ++i) {
        flown.run(10ms, Wanted::kArmed, rates, 14);
        mean += flown.rates() / kSamples;
      }
      EXPECT_LT((mean - rates).cwiseAbs().maxCoeff(), tolerance_rad_s)
          << "axis " << axis << ", asked for " << rates.transpose() << ", came to " << mean.transpose();
    }
  }
}

class BoardOfOurOwn : public testing::TestWithParam<sitl::Wire> {
 protected:
  void SetUp() override {
    ports.motors_port = firmware::open(*firmware::parse_address("udp-listen:127.0.0.1:0"), 1s).value()->local_port();
    ports.wire = GetParam();
    board = std::make_unique<test::SitlBoard>(ports.motors_port, ports.wire);
    ports.state_port = board->state_port();
  }
  sitl::ExchangeOptions ports;
  std::unique_ptr<test::SitlBoard> board;
};
INSTANTIATE_TEST_SUITE_P(BothWires, BoardOfOurOwn, testing::Values(sitl::Wire::kUntil2025, sitl::Wire::kSince2026));

TEST_P(BoardOfOurOwn, ArmsFliesRatesAndDisarms) {
  Flown flown(board->msp_port(), ports);
  EXPECT_FALSE(board->armed());
  ASSERT_TRUE(flown.arm(20s));
  expect_rates_flown(flown, 0.2);
  flown.run(300ms, Wanted::kDisarmed, {0, 0, 0}, 14);
  EXPECT_FALSE(board->armed());
  EXPECT_EQ(flown.motors(), (sitl::Motors{0, 0, 0, 0}));
}

TEST_P(BoardOfOurOwn, AFirmwareThatHangsInMidFlightIsTold) {
  Flown flown(board->msp_port(), ports);
  ASSERT_TRUE(flown.arm(20s));
  flown.run(300ms, Wanted::kArmed, {0, 0, 0}, 14);
  const Stamp heard = flown.vehicle().newest({})->stamp;
  board->hang();
  flown.run(1200ms, Wanted::kArmed, {0, 0, 0}, 14);
  EXPECT_GT(flown.exchange().silent_for(), 1s);
  EXPECT_EQ(flown.exchange().silence().code, ErrorCode::kNotAnswering);
  EXPECT_LT(flown.vehicle().newest({})->stamp - heard, 300ms);
}

class RealBetaflight : public testing::Test {
 protected:
  void SetUp() override {
    if (test::RealFirmware::program().empty())
      GTEST_SKIP() << "left out: GATEFIELD_BETAFLIGHT_SITL names no program (Betaflight built for the target SITL)";
    ports.wire = test::RealFirmware::wire();
    folder = std::filesystem::temp_directory_path() / ("gatefield-betaflight-" + std::to_string(getpid()));
  }
  void TearDown() override {
    if (!folder.empty()) std::filesystem::remove_all(folder);
  }
  sitl::ExchangeOptions ports;
  std::filesystem::path folder;
};

TEST_F(RealBetaflight, FliesTheRatesThatAreAskedForWithEveryTypeOfRates) {
  struct Rates {
    const char* type;
    int rc_rate, super_rate, expo;
  };
  for (const auto& [type, rc_rate, super_rate, expo] :
       {Rates{"ACTUAL", 20, 67, 30}, Rates{"BETAFLIGHT", 110, 65, 20}, Rates{"KISS", 110, 65, 20},
        Rates{"QUICK", 110, 67, 20}, Rates{"RACEFLIGHT", 40, 60, 30}}) {
    SCOPED_TRACE(type);
    test::RealFirmware firmware(folder, test::bridge_settings(type, rc_rate, super_rate, expo));
    Flown flown(sitl::kMspPort, ports);
    ASSERT_TRUE(flown.arm(30s)) << testing::PrintToString(flown.vehicle().complaints());
    expect_rates_flown(flown, 0.2);
    flown.run(300ms, Wanted::kDisarmed, {0, 0, 0}, 14);
    EXPECT_FALSE(flown.vehicle().newest({})->armed);
  }
}

TEST_F(RealBetaflight, ChannelsThatStopEndInItsFailsafe) {
  test::RealFirmware firmware(folder, test::bridge_settings("ACTUAL", 20, 67, 0));
  Flown flown(sitl::kMspPort, ports);
  ASSERT_TRUE(flown.arm(30s)) << testing::PrintToString(flown.vehicle().complaints());
  flown.run(500ms, Wanted::kArmed, {0, 0, 0}, 14);
  EXPECT_GT(flown.motors()[0], 0.1);
  flown.run(2500ms, Wanted::kReleased, {0, 0, 0}, 14);
  EXPECT_FALSE(flown.vehicle().newest({})->armed);
  EXPECT_EQ(flown.motors(), (sitl::Motors{0, 0, 0, 0}));
}

TEST_F(RealBetaflight, AProgramThatIsStoppedIsTold) {
  test::RealFirmware firmware(folder, test::bridge_settings("ACTUAL", 20, 67, 0));
  Flown flown(sitl::kMspPort, ports);
  ASSERT_TRUE(flown.arm(30s)) << testing::PrintToString(flown.vehicle().complaints());
  firmware.stop();
  flown.run(1200ms, Wanted::kArmed, {0, 0, 0}, 14);
  EXPECT_GT(flown.exchange().silent_for(), 1s);
  firmware.go_on();
}

}  // namespace
}  // namespace gatefield::bridge::betaflight
