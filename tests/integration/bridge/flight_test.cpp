// A flight through gatefield-bridge in real time: server and bridge as processes, and an autopilot of ours
// (tests/support) with a simulated body behind a UDP link.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <fstream>
#include <thread>

#include "client/flight/clock.h"
#include "tests/integration/race/programs.h"
#include "tests/support/mavlink_controller.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

/// An autopilot, the body that its motors move, and the person's arm switch; on a thread of its own.
class World {
 public:
  explicit World(const std::string& link)
      : controller_(firmware::open(firmware::parse_address(link).value(), 1s).value(), bridge::Dialect::kPx4),
        thread_([this] { run(); }) {
    model_.rotor_spin = {-1, -1, 1, 1};  // as RateController's mixer has them
  }
  ~World() { end(); }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// The autopilot dies.
  void end() {
    ending_ = true;
    if (thread_.joinable()) thread_.join();
  }

  std::atomic<bool> arm_switch{false};
  std::atomic<bool> disarms{false};  ///< the autopilot, by itself
  std::atomic<bool> passed{false};   ///< the gate of course one-gate, inside of its opening
  std::atomic<double> highest_m{0};  ///< that the vehicle was
  std::atomic<bool> armed{false}, on_ground{true};

 private:
  static constexpr Stamp kStep = 1ms;

  void run() {
    flight::RealTimeClock clock;
    for (Stamp due = clock.now(); !ending_; due += kStep) {
      clock.sleep_until(due);
      turn_switch(due);
      move(due);
      controller_.serve(due);
      armed = controller_.armed();
      on_ground = controller_.on_ground;
    }
  }

  /// The autopilot's own switch arms it at once; the radio's next word of that comes later than the heartbeat's.
  void turn_switch(Stamp now) {
    controller_.radio_us[4] = arm_switch ? 1900 : 1000;
    if (disarms) controller_.loop().arm_switch(now, false);
    if (!arm_switch) {
      if (has_armed_) controller_.loop().arm_switch(now, false);
      has_armed_ = false;
    } else if (!has_armed_) {  // it arms as soon as it may, once
      controller_.loop().arm_switch(now, true);
      has_armed_ = controller_.armed();
    }
  }

  void move(Stamp now) {
    constexpr double kStep_s = 1e-3;
    QuadrotorState& state = controller_.state;
    const auto outputs = controller_.loop().step(now, state.w_WB_B, kStep_s);
    constexpr std::array<std::size_t, 4> kOutputOfRotor{1, 2, 3, 0};  // front right, rear left, front left, rear right
    for (std::size_t i = 0; i < 4; ++i)
      state.thrust_command_n[static_cast<Eigen::Index>(i)] =
          model_.thrust_max_n * outputs[kOutputOfRotor[i]] * outputs[kOutputOfRotor[i]];
    const QuadrotorState before = state;
    state = step_reference(model_, state, ThrustRates::Zero(), kStep_s);
    controller_.on_ground = state.p_WB.z() <= 0.0;
    if (controller_.on_ground) {
      state.p_WB.z() = 0.0;
      state.v_WB = Eigen::Vector3d(0, 0, std::max(state.v_WB.z(), 0.0));
      state.w_WB_B.setZero();
    }
    const Eigen::Vector3d force_W = (state.v_WB - before.v_WB) / kStep_s + Eigen::Vector3d(0, 0, kGravity_m_s2);
    controller_.specific_force_z = (Eigen::Quaterniond(state.q_WB).inverse() * force_W).z();
    highest_m = std::max<double>(highest_m, state.p_WB.z());
    constexpr double kGate_x_m = 8.0, kGate_z_m = 1.5, kHalf_m = 0.5;
    if (before.p_WB.x() < kGate_x_m && state.p_WB.x() >= kGate_x_m)
      passed = std::abs(state.p_WB.y()) < kHalf_m && std::abs(state.p_WB.z() - kGate_z_m) < kHalf_m;
  }

  QuadrotorModel model_;
  MavlinkController controller_;
  bool has_armed_ = false;  // since the switch went on
  std::atomic<bool> ending_{false};
  std::thread thread_;
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
  World world(link());
  Process bridge = this->bridge();
  ASSERT_TRUE(bridge.wait_for_output("checks_pass", 60s)) << bridge.output() << server.output();
  EXPECT_FALSE(world.armed) << "nobody asked for turning motors yet";
  world.arm_switch = true;
  EXPECT_EQ(bridge.wait(90s).value_or(-1), 0) << bridge.output();
  EXPECT_TRUE(world.passed) << bridge.output();
  EXPECT_GT(world.highest_m, 1.0);
  EXPECT_TRUE(world.on_ground);
  EXPECT_FALSE(world.armed);
}

TEST_F(BridgeFlight, AskedToStopInTheAirItLandsAndDisarms) {
  Process server = programs_.server("server.log");
  World world(link());
  Process bridge = this->bridge();
  ASSERT_TRUE(bridge.wait_for_output("checks_pass", 60s)) << bridge.output() << server.output();
  world.arm_switch = true;
  ASSERT_TRUE(bridge.wait_for_output("handed_over", 30s)) << bridge.output();
  bridge.signal(SIGTERM);
  EXPECT_EQ(bridge.wait(60s).value_or(-1), 0) << bridge.output();
  EXPECT_TRUE(world.on_ground);
  EXPECT_FALSE(world.armed);
}

TEST_F(BridgeFlight, AnAutopilotThatDiesInTheAirEndsTheFlightAndIsTold) {
  Process server = programs_.server("server.log");
  World world(link());
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
  World world(link());
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
  World world(link());
  Process bridge = this->bridge();
  std::this_thread::sleep_for(4s);  // of the 20 that joining may take
  bridge.signal(SIGINT);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(bridge.wait(30s).value_or(-1), 0) << bridge.output();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 10s);
}

TEST_F(BridgeFlight, AnAutopilotThatDiesOnTheGroundIsTold) {
  Process server = programs_.server("server.log");
  World world(link());
  Process bridge = this->bridge();
  ASSERT_TRUE(bridge.wait_for_output("joined a session", 60s)) << bridge.output() << server.output();
  world.end();
  EXPECT_EQ(bridge.wait(30s).value_or(-1), 4) << bridge.output();
}

TEST_F(BridgeFlight, WithoutAServerItSaysSo) {
  World world(link());
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
