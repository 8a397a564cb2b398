// The bridge to Betaflight on a serial line, against a board of ours on a thread of its own, in real time.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "client/bridge/betaflight/vehicle.h"
#include "client/flight/clock.h"
#include "tests/support/betaflight_controller.h"
#include "tests/support/terminal.h"

namespace gatefield::bridge::betaflight {
namespace {

using namespace std::chrono_literals;
using flight::Wanted;
using testing::HasSubstr;

/// A board that is plugged in until it goes out of scope. Its motors turn nothing.
class Plugged {
 public:
  explicit Plugged(std::unique_ptr<test::Terminal> terminal)
      : board_(std::move(terminal)), thread_([this] { run(); }) {}
  ~Plugged() {
    ending_ = true;
    thread_.join();
  }
  Plugged(const Plugged&) = delete;
  Plugged& operator=(const Plugged&) = delete;

  bool armed() const { return armed_; }

 private:
  void run() {
    flight::RealTimeClock clock;
    for (Stamp now = clock.now(); !ending_; now = clock.sleep_until(now + 1ms)) {
      board_.serve(now);
      (void)board_.loop().step(now, Eigen::Vector3d::Zero(), 1e-3);
      armed_ = board_.loop().armed();
    }
  }

  test::BetaflightController board_;
  std::atomic<bool> ending_{false}, armed_{false};
  std::thread thread_;
};

class BetaflightSerial : public testing::Test {
 protected:
  void plug(const test::LineNoise& noise = {}) {
    auto terminal = std::make_unique<test::Terminal>();
    ASSERT_FALSE(terminal->name().empty());
    options_.link = firmware::parse_address("serial:" + terminal->name() + ":115200").value();
    terminal->noise = noise;
    board = std::make_unique<Plugged>(std::move(terminal));
    auto opened = open(options_, QuadrotorModel{}, clock);
    ASSERT_TRUE(opened.ok()) << opened.error();
    vehicle = std::move(opened).value();
  }

  /// Flies for `span`. @return the oldest status meanwhile
  Stamp run(Stamp span, Wanted wanted) {
    sdk::Setpoint setpoint;
    setpoint.collective_thrust_n = 9.0;
    Stamp oldest{0};
    const Stamp begin = clock.now();
    for (Stamp now = begin; now - begin < span; now = clock.sleep_until(now + vehicle->period())) {
      const auto status = vehicle->newest(now);
      oldest = std::max(oldest, now - (status ? status->stamp : begin));
      vehicle->want(now, wanted);
      if (wanted == Wanted::kArmed)
        vehicle->apply(now, setpoint);
      else
        vehicle->hold(now);
    }
    return oldest;
  }
  /// Until the board's own switch has armed it.
  void arm() {
    for (int i = 0; i < 50 && !(vehicle->newest(clock.now()) && vehicle->newest(clock.now())->armed); ++i) {
      run(100ms, Wanted::kDisarmed);
      run(100ms, Wanted::kArmed);
    }
    ASSERT_TRUE(board->armed());
  }

  flight::RealTimeClock clock;
  std::unique_ptr<Plugged> board;
  std::unique_ptr<BetaflightVehicle> vehicle;

 private:
  Options options_;
};

TEST_F(BetaflightSerial, ANoisyLineCostsAnswersAndNothingElse) {
  ASSERT_NO_FATAL_FAILURE(plug(test::line_noise(2e-3, 3)));
  EXPECT_FALSE(board->armed());
  ASSERT_NO_FATAL_FAILURE(arm());
  EXPECT_LT(run(2s, Wanted::kArmed), 1s);
  EXPECT_TRUE(board->armed());
  run(500ms, Wanted::kDisarmed);
  EXPECT_FALSE(board->armed());
}

TEST_F(BetaflightSerial, ABoardThatIsPulledOutGrowsOldAndIsTold) {
  ASSERT_NO_FATAL_FAILURE(plug());
  ASSERT_NO_FATAL_FAILURE(arm());
  board.reset();
  const Stamp pulled = clock.now();
  EXPECT_GT(run(1s, Wanted::kArmed), 800ms);
  EXPECT_LE(vehicle->newest(clock.now())->stamp, pulled + 100ms) << "who watches the stamp sees it";
  EXPECT_THAT(vehicle->complaints(), testing::Contains(HasSubstr(" broke: ")));
}

}  // namespace
}  // namespace gatefield::bridge::betaflight
