// A flight through gatefield-bridge in real time: server and bridge as processes, and an autopilot of ours
// (tests/support) with a simulated body behind a UDP link.

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <memory>
#include <thread>

#include "common/protocol/problems.h"
#include "tests/integration/bridge/world.h"
#include "tests/integration/race/programs.h"
#include "tests/support/mavlink_controller.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

/// An autopilot at the other end of the link.
class MavlinkWorld final : public World<MavlinkController> {
 public:
  explicit MavlinkWorld(const std::string& link)
      : World(std::make_unique<MavlinkController>(firmware::open(firmware::parse_address(link).value(), 1s).value(),
                                                  bridge::Dialect::kPx4),
              [](MavlinkController* controller, Stamp now) { controller->serve(now); }) {}
};

class BridgeFlight : public testing::Test {
 protected:
  BridgeFlight() {
    const auto free = firmware::open(firmware::parse_address("udp-listen:127.0.0.1:0").value(), 1s);
    port_ = std::to_string(free.value()->local_port());
    std::ofstream(programs_.file("bridge.txt"))
        << "vehicle: 'racer-rates' course: 'one-gate' session { domain: " << programs_.domain()
        << " speed_limit_m_s: 3 connect_timeout: 20 } safety { needs_field: false needs_depth: false "
           "round_trip_max: 0.4 take_off_height_m: 1.5 } thrust { hover_throttle: 0.43 } "
           "mavlink { link: 'udp-listen:127.0.0.1:"
        << port_ << "' radio { arm: 5 } }";
  }
  Process bridge() const {
    return Process((kPrograms / "gatefield-bridge").string(),
                   {"mavlink", "--config", programs_.file("bridge.txt").string()}, programs_.file("bridge.log"));
  }
  std::string link() const { return "udp:127.0.0.1:" + port_; }

  Programs programs_{"bridge-flight"};
  std::string port_;
};

TEST_F(BridgeFlight, FromTheArmSwitchThroughTheFirstGateToTheGround) {
  Process server = programs_.server("server.log");
  MavlinkWorld world(link());
  Process bridge = this->bridge();
  ASSERT_TRUE(bridge.wait_for_output("checks_pass", 60s)) << bridge.output() << server.output();
  EXPECT_FALSE(world.armed) << "nobody asked for turning motors yet";
  world.arm_switch = true;
  EXPECT_EQ(bridge.wait(90s).value_or(-1), 0) << bridge.output();
  EXPECT_TRUE(world.passed) << bridge.output();
  // Braking from speed turns this body hard, and its mixer gives more thrust than it is asked for meanwhile.
  const std::string until_braking = bridge.output().substr(0, bridge.output().find("race_over"));
  EXPECT_EQ(until_braking.find(protocol::sentence(protocol::Problem::kThrustUnlikeTold)), std::string::npos)
      << "its thrust is as told, whoever asked for it:\n"
      << until_braking;
  EXPECT_GT(world.highest_m, 1.0);
  EXPECT_TRUE(world.on_ground);
  EXPECT_FALSE(world.armed);
}

TEST_F(BridgeFlight, AskedToStopInTheAirItLandsAndDisarms) {
  Process server = programs_.server("server.log");
  MavlinkWorld world(link());
  Process bridge = this->bridge();
  ASSERT_TRUE(bridge.wait_for_output("checks_pass", 60s)) << bridge.output() << server.output();
  world.arm_switch = true;
  ASSERT_TRUE(bridge.wait_for_output("handed_over", 30s)) << bridge.output();
  bridge.signal(SIGTERM);
  EXPECT_EQ(bridge.wait(60s).value_or(-1), 0) << bridge.output();
  EXPECT_TRUE(world.on_ground);
  EXPECT_FALSE(world.armed);
}

TEST_F(BridgeFlight, WhatBecomesOfTheSessionInTheAirIsTold) {
  Process server = programs_.server("server.log");
  MavlinkWorld world(link());
  Process bridge = this->bridge();
  ASSERT_TRUE(bridge.wait_for_output("checks_pass", 60s)) << bridge.output() << server.output();
  world.arm_switch = true;
  ASSERT_TRUE(bridge.wait_for_output("handed_over", 30s)) << bridge.output();
  server.signal(SIGTERM);
  EXPECT_TRUE(bridge.wait_for_output("server gatefield is leaving", 10s)) << bridge.output();
  bridge.signal(SIGTERM);
  EXPECT_EQ(bridge.wait(60s).value_or(-1), 0) << bridge.output();
  EXPECT_TRUE(world.on_ground);
}

TEST_F(BridgeFlight, AnAutopilotThatDiesInTheAirEndsTheFlightAndIsTold) {
  Process server = programs_.server("server.log");
  MavlinkWorld world(link());
  Process bridge = this->bridge();
  ASSERT_TRUE(bridge.wait_for_output("checks_pass", 60s)) << bridge.output() << server.output();
  world.arm_switch = true;
  ASSERT_TRUE(bridge.wait_for_output("handed_over", 30s)) << bridge.output();
  world.end();
  // Without states and without its word: level by time, then motors off, though nobody may hear that any more.
  EXPECT_EQ(bridge.wait(30s).value_or(-1), 4) << bridge.output();
  EXPECT_NE(bridge.output().find("state_lost"), std::string::npos) << bridge.output();
  EXPECT_NE(bridge.output().find("level_time_over"), std::string::npos) << bridge.output();
}

TEST_F(BridgeFlight, AnAutopilotThatDisarmsInTheAirIsNotArmedAgain) {
  Process server = programs_.server("server.log");
  MavlinkWorld world(link());
  Process bridge = this->bridge();
  ASSERT_TRUE(bridge.wait_for_output("checks_pass", 60s)) << bridge.output() << server.output();
  world.arm_switch = true;
  ASSERT_TRUE(bridge.wait_for_output("handed_over", 30s)) << bridge.output();
  world.disarms = true;
  EXPECT_EQ(bridge.wait(30s).value_or(-1), 0) << bridge.output();
  EXPECT_NE(bridge.output().find("motors_off"), std::string::npos) << bridge.output();
  EXPECT_FALSE(world.armed);
}

TEST_F(BridgeFlight, AnInterruptWhileNoServerAnswersEndsItAtOnce) {
  MavlinkWorld world(link());
  Process bridge = this->bridge();
  std::this_thread::sleep_for(4s);  // of the 20 that joining may take
  bridge.signal(SIGINT);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(bridge.wait(30s).value_or(-1), 0) << bridge.output();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 10s);
}

TEST_F(BridgeFlight, AnAutopilotThatDiesOnTheGroundIsTold) {
  Process server = programs_.server("server.log");
  MavlinkWorld world(link());
  Process bridge = this->bridge();
  ASSERT_TRUE(bridge.wait_for_output("joined a session", 60s)) << bridge.output() << server.output();
  world.end();
  EXPECT_EQ(bridge.wait(30s).value_or(-1), 4) << bridge.output();
}

TEST_F(BridgeFlight, WithoutAServerItSaysSo) {
  MavlinkWorld world(link());
  std::string text;
  {
    std::ifstream file(programs_.file("bridge.txt"));
    text.assign(std::istreambuf_iterator<char>(file), {});
  }
  text.replace(text.find("connect_timeout: 20"), 19, "connect_timeout: 1");
  std::ofstream(programs_.file("bridge.txt")) << text;
  Process bridge = this->bridge();
  EXPECT_EQ(bridge.wait(30s).value_or(-1), 3) << bridge.output();
}

}  // namespace
}  // namespace gatefield::test
