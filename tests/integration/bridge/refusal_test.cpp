// Bad input, as a person gives it to the bridge: exit code 2 and a sentence that names it.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <csignal>
#include <fstream>
#include <functional>
#include <thread>

#include "client/firmware/link/link.h"
#include "client/firmware/msp/messages.h"
#include "common/base/clock.h"
#include "tests/integration/race/programs.h"
#include "tests/support/betaflight_controller.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

class BridgeRefusal : public testing::Test {
 protected:
  /// Runs the bridge on a file with this section. @return its exit code
  int bridge(const std::string& section, const std::vector<std::string>& extra = {"mavlink"}) {
    std::ofstream(programs_.file("bridge.txt")) << "vehicle: 'racer-rates' course: 'one-gate' " + section;
    std::vector<std::string> arguments = extra;
    arguments.insert(arguments.end(), {"--config", programs_.file("bridge.txt").string()});
    Process bridge((kPrograms / "gatefield-bridge").string(), arguments, programs_.file("log"));
    const int code = bridge.wait(30s).value_or(-1);
    said_ = bridge.output();
    return code;
  }
  void expect_said(const std::string& words) const {
    EXPECT_NE(said_.find(words), std::string::npos) << "expected '" << words << "' in:\n" << said_;
  }
  static std::string mavlink(const std::string& link) {
    return "mavlink { link: '" + link + "' connect_timeout: 0.5 radio { arm: 5 } }";
  }

  Programs programs_{"bridge"};
  std::string said_;
};

TEST_F(BridgeRefusal, AWrongPortIsNamed) {
  EXPECT_EQ(bridge(mavlink("udp-listen:127.0.0.1:99999")), 2);
  expect_said("mavlink.link");
  expect_said("99999");
}

TEST_F(BridgeRefusal, APortThatIsTakenIsNamed) {
  const auto taken = firmware::open(firmware::parse_address("udp-listen:127.0.0.1:0").value(), 1s);
  ASSERT_TRUE(taken.ok()) << taken.error();
  const std::string port = std::to_string((*taken)->local_port());
  EXPECT_EQ(bridge(mavlink("udp-listen:127.0.0.1:" + port)), 2);
  expect_said(port);
}

TEST_F(BridgeRefusal, AWrongBaudRateIsNamed) {
  EXPECT_EQ(bridge(mavlink("serial:/dev/ttyACM0:1234")), 2);
  expect_said("baud is '1234'");
}

TEST_F(BridgeRefusal, ADeviceThatIsNotThereIsNamed) {
  EXPECT_EQ(bridge(mavlink("serial:/dev/ttyNowhere:57600")), 2);
  expect_said("/dev/ttyNowhere");
}

TEST_F(BridgeRefusal, WhereNoAutopilotSpeaksTheNextStepIsSaid) {
  EXPECT_EQ(bridge(mavlink("udp-listen:127.0.0.1:0")), 2);
  expect_said("no heartbeat of an autopilot");
}

TEST_F(BridgeRefusal, AMissingFileAndAnUnknownFieldAreNamed) {
  EXPECT_EQ(bridge("wings: 2"), 2);
  expect_said("unknown field 'wings'");
  Process bridge((kPrograms / "gatefield-bridge").string(), {"mavlink", "--config", "/nowhere.txt"},
                 programs_.file("missing.log"));
  EXPECT_EQ(bridge.wait(30s).value_or(-1), 2);
  EXPECT_NE(bridge.output().find("/nowhere.txt: does not exist"), std::string::npos) << bridge.output();
}

/// A Betaflight board behind a TCP port, as its simulator is; on a thread of its own.
class Board {
 public:
  explicit Board(const std::function<void(BetaflightController*)>& set_up) {
    auto link = firmware::open(firmware::parse_address("tcp-listen:127.0.0.1:0").value(), 1s).value();
    port_ = std::to_string(link->local_port());
    controller_ = std::make_unique<BetaflightController>(std::move(link));
    set_up(controller_.get());
    thread_ = std::thread([this] {
      while (!ending_) {
        controller_->serve(MonotonicClock().now());
        std::this_thread::sleep_for(1ms);
      }
    });
  }
  ~Board() {
    ending_ = true;
    thread_.join();
  }
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;
  std::string section() const { return "betaflight { link: 'tcp:127.0.0.1:" + port_ + "' }"; }

 private:
  std::string port_;
  std::unique_ptr<BetaflightController> controller_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

TEST_F(BridgeRefusal, AnUnknownFirmwareOrVersionIsNamedWithTheNextStep) {
  namespace msp = firmware::msp;
  {
    const Board board([](BetaflightController* c) { c->answers[msp::command::kFcVersion] = {3, 5, 7}; });
    EXPECT_EQ(bridge(board.section(), {"betaflight", "--check"}), 2);
    expect_said("firmware is Betaflight 3.5.7, expected 4.4 to 2026.12; flash one of these");
  }
  const Board board([](BetaflightController* c) { c->answers[msp::command::kFcVariant] = {'I', 'N', 'A', 'V'}; });
  EXPECT_EQ(bridge(board.section(), {"betaflight", "--check"}), 2);
  expect_said("firmware is 'INAV', expected Betaflight (BTFL)");
}

TEST_F(BridgeRefusal, SettingsThatDontFlyAreNamedWithTheNextStep) {
  namespace msp = firmware::msp;
  const Board board([](BetaflightController* c) { c->answers[msp::command::kMixerConfig] = {1, 0}; });
  EXPECT_EQ(bridge(board.section(), {"betaflight", "--check"}), 2);
  expect_said("the firmware's mixer is 1, expected 3 (QUADX); set mixer QUADX");
}

TEST_F(BridgeRefusal, ABoardThatNobodyAnswersForIsNamed) {
  EXPECT_EQ(bridge("betaflight { link: 'tcp:127.0.0.1:1' }", {"betaflight", "--check"}), 2);
  expect_said("start the flight controller");
}

TEST_F(BridgeRefusal, AnInterruptEndsTheWaitForAnAutopilot) {
  std::ofstream(programs_.file("bridge.txt"))
      << "vehicle: 'racer-rates' course: 'one-gate' "
         "mavlink { link: 'udp-listen:127.0.0.1:0' connect_timeout: 600 radio { arm: 5 } }";
  Process bridge((kPrograms / "gatefield-bridge").string(),
                 {"mavlink", "--config", programs_.file("bridge.txt").string()}, programs_.file("log"));
  std::this_thread::sleep_for(1s);
  bridge.signal(SIGINT);
  EXPECT_EQ(bridge.wait(10s).value_or(-1), 0) << bridge.output();
}

TEST_F(BridgeRefusal, AFirmwareThatIsNotThereIsRefused) {
  EXPECT_EQ(bridge(mavlink("udp-listen:127.0.0.1:0"), {"px4"}), 2);
  expect_said("mavlink");
}

}  // namespace
}  // namespace gatefield::test
