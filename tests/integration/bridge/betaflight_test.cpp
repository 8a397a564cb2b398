// Flights through gatefield-bridge betaflight in real time: server and bridge as processes, a board of ours (or a real
// one) with a simulated body, and a motion capture that tells the bridge over DDS where that body is.

#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <functional>
#include <numbers>
#include <thread>

#include "client/firmware/betaflight_sitl/exchange.h"
#include "client/flight/clock.h"
#include "gatefield/sdk/publisher.h"
#include "tests/integration/betaflight/real_firmware.h"
#include "tests/integration/bridge/camera_program.h"
#include "tests/integration/race/programs.h"
#include "tests/support/betaflight_controller.h"
#include "tests/support/rate_body.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
namespace msp = firmware::msp;
namespace sitl = firmware::betaflight_sitl;

/// A motion capture of 250 Hz: the body's markers lie 5 cm above its centre of mass, and its room's axes are turned by
/// 90 degrees against the course's.
class MotionCapture {
 public:
  static constexpr const char* kConfig =
      "p_WO { x: 1 y: 0 z: 0 } yaw_WO_rad: 1.5707963267948966 p_MB { x: 0 y: 0 z: -0.05 } ";

  MotionCapture() {
    sdk::PublisherOptions options;
    options.domain = own_domain();
    options.odometry = "/mocap/odometry";
    options.pose = "/mocap/pose";
    auto created = sdk::Publisher::create(options);
    if (!created) throw std::runtime_error(created.error());
    publisher_ = std::move(created).value();
  }

  void publish(Stamp now, const QuadrotorState& state) {
    if (!works || now < due_) return;
    due_ = now + 4ms;
    const Eigen::Quaterniond q_OW(Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitZ())), q_WB(state.q_WB);
    const Eigen::Vector3d p_BM(0, 0, 0.05), p_WO(1, 0, 0);
    const sdk::Pose pose{q_OW * (state.p_WB + q_WB * p_BM - p_WO), PlainQuaternion(q_OW * q_WB)};
    const Eigen::Vector3d v_W = state.v_WB + q_WB * state.w_WB_B.cross(p_BM);
    const auto measured = std::chrono::system_clock::now();
    (void)publisher_->publish_odometry(measured, "room", pose, q_OW * v_W, state.w_WB_B);
    (void)publisher_->publish_pose(measured, "room", pose);
  }

  std::atomic<bool> works{true};

 private:
  std::unique_ptr<sdk::Publisher> publisher_;
  Stamp due_{0};
};

/// The body, what drives its motors, and who watches it; on a thread of its own.
class World {
 public:
  /// Outputs of the motors (rear right, front right, rear left, front left) for what the sensors say.
  using Motors = std::function<std::array<double, 4>(Stamp, const RateBody&)>;
  /// @param camera  told where the body is; may be null
  explicit World(Motors motors, CameraProgram* camera = nullptr)
      : motors_(std::move(motors)), camera_(camera), thread_([this] { run(); }) {}
  ~World() {
    ending_ = true;
    thread_.join();
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  MotionCapture capture;
  std::atomic<bool> passed{false}, on_ground{true};
  std::atomic<double> highest_m{0};

 private:
  static constexpr Stamp kStep = 1ms;

  static Eigen::Isometry3d pose_of(const QuadrotorState& state) {
    return Eigen::Translation3d(state.p_WB) * Eigen::Quaterniond(state.q_WB);
  }

  void run() {
    flight::RealTimeClock clock;
    for (Stamp due = clock.now(); !ending_; due += kStep) {
      const Stamp now = clock.sleep_until(due);
      body_.step(motors_(now, body_), seconds(kStep));
      passed = body_.passed;
      on_ground = body_.on_ground;
      highest_m = std::max<double>(highest_m, body_.state.p_WB.z());
      capture.publish(now, body_.state);
      if (camera_ != nullptr) camera_->set_pose(pose_of(body_.state));
    }
  }

  const Motors motors_;
  CameraProgram* const camera_;
  RateBody body_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

/// A board of ours behind MSP over TCP, with a person's radio or without.
class Board {
 public:
  explicit Board(bool radio) : radio_(radio) {
    auto link = firmware::open(firmware::parse_address("tcp-listen:127.0.0.1:0").value(), 1s).value();
    port = link->local_port();
    board_ = std::make_unique<BetaflightController>(std::move(link));
    if (!radio) return;
    board_->answers[msp::command::kBoxIds].push_back(msp::kModeMspOverride);
    auto& ranges = board_->answers[msp::command::kModeRanges];
    ranges[4] = msp::kModeMspOverride;
    ranges[5] = 1;  // AUX2
    ranges[6] = (1700 - 900) / 25;
    ranges[7] = (2100 - 900) / 25;
  }

  std::array<double, 4> motors(Stamp now, const RateBody& body) {
    const Eigen::Quaterniond q(body.state.q_WB);
    board_->gyro_rad_s = body.state.w_WB_B;
    board_->acceleration_g = body.specific_force_B / kGravity_m_s2;
    board_->roll_deg =
        kDegrees * std::atan2(2 * (q.w() * q.x() + q.y() * q.z()), 1 - 2 * (q.x() * q.x() + q.y() * q.y()));
    board_->pitch_nose_down_deg = kDegrees * std::asin(std::clamp(2 * (q.w() * q.y() - q.z() * q.x()), -1.0, 1.0));
    if (radio_)
      board_->radio_us = {{1500, 1500, 1500, 1000, arm_switch ? std::uint16_t{1900} : std::uint16_t{1000}, 1900}};
    board_->serve(now);
    const auto outputs = board_->loop().step(now, board_->gyro_rad_s, 1e-3);
    armed = board_->loop().armed();
    return outputs;
  }

  std::uint16_t port = 0;
  std::atomic<bool> arm_switch{false}, armed{false};

 private:
  static constexpr double kDegrees = 180.0 / std::numbers::pi;
  const bool radio_;
  std::unique_ptr<BetaflightController> board_;
};

class BetaflightBridge : public testing::Test {
 protected:
  /// @param states  the section's topic   @param more  of the section betaflight, of safety
  Process bridge(std::uint16_t msp_port, const std::string& states, const std::string& betaflight,
                 const std::string& safety, double hover_throttle = 0.43) const {
    return start("course: 'one-gate'", msp_port, states, betaflight, "needs_field: false needs_depth: false " + safety,
                 hover_throttle);
  }
  /// @param head  course, and what else stands beside the sections
  Process start(const std::string& head, std::uint16_t msp_port, const std::string& states,
                const std::string& betaflight, const std::string& safety, double hover_throttle = 0.43) const {
    std::ofstream(programs_.file("bridge.txt"))
        << "vehicle: 'racer-rates' " << head << " session { domain: " << programs_.domain()
        << " speed_limit_m_s: 3 connect_timeout: 20 } safety { round_trip_max: 0.4 take_off_height_m: 1.5 " << safety
        << " } thrust { hover_throttle: " << hover_throttle << " } states { " << states << MotionCapture::kConfig
        << " } betaflight { link: 'tcp:127.0.0.1:" << msp_port << "' " << betaflight << " }";
    return Process((kPrograms / "gatefield-bridge").string(),
                   {"betaflight", "--config", programs_.file("bridge.txt").string()}, programs_.file("bridge.log"));
  }

  static constexpr const char* kByItself = "arm_by: ITSELF needs_pilot: false ";
  static constexpr const char* kOdometry = "odometry: '/mocap/odometry' ";
  static constexpr const char* kPose = "pose: '/mocap/pose' ";
  Programs programs_{"bridge-betaflight"};
};

TEST_F(BetaflightBridge, FromAPersonsArmSwitchThroughTheFirstGateToTheGround) {
  Process server = programs_.server("server.log");
  Board board(true);
  World world([&](Stamp now, const RateBody& body) { return board.motors(now, body); });
  Process bridge = this->bridge(board.port, kOdometry, "receiver: OVERRIDE", "needs_firmware_failsafe: false");
  ASSERT_TRUE(bridge.wait_for_output("checks_pass", 60s)) << bridge.output() << server.output();
  EXPECT_FALSE(board.armed) << "nobody asked for turning motors yet";
  board.arm_switch = true;
  ASSERT_TRUE(bridge.wait_for_output("touched_down", 90s)) << bridge.output();
  board.arm_switch = false;
  EXPECT_EQ(bridge.wait(20s).value_or(-1), 0) << bridge.output();
  EXPECT_TRUE(world.passed) << bridge.output();
  EXPECT_GT(world.highest_m, 1.0);
  EXPECT_TRUE(world.on_ground);
  EXPECT_FALSE(board.armed);
}

TEST_F(BetaflightBridge, OfPosesAloneItFliesTheGateAndDisarmsByItself) {
  Process server = programs_.server("server.log");
  Board board(false);
  World world([&](Stamp now, const RateBody& body) { return board.motors(now, body); });
  Process bridge = this->bridge(board.port, kPose, "", kByItself);
  EXPECT_EQ(bridge.wait(120s).value_or(-1), 0) << bridge.output() << server.output();
  EXPECT_NE(bridge.output().find("velocity is made of poses"), std::string::npos) << bridge.output();
  EXPECT_TRUE(world.passed) << bridge.output();
  EXPECT_TRUE(world.on_ground);
  EXPECT_FALSE(board.armed);
}

TEST_F(BetaflightBridge, ADepthCamerasProgramShowsItWhereTheGateReallyIs) {
  // The course has the gate 0.7 m from where it stands: whoever flies there meets its frame.
  std::ofstream(programs_.file("course.txt"))
      << "laps: 1 closed: false waypoint { position { x: 8 y: 0.7 z: 1.5 } yaw_deg: 0 } "
         "gate { inner_half_m: 0.5 outer_half_m: 0.75 thickness_m: 0.06 } "
         "start { position { x: 0 y: 0 z: 1.5 } yaw_deg: 0 } "
         "flight_volume { min { x: -3 y: -6 z: 0 } max { x: 16 y: 6 z: 5 } } floor { z: 0 }";
  scene::World seen;
  seen.gates.resize(1);
  seen.gates[0].X_WG.translation() = Eigen::Vector3d(8, 0, 1.5);
  Process server = programs_.server("server.log");
  Board board(false);
  CameraProgram camera(seen);
  World world([&](Stamp now, const RateBody& body) { return board.motors(now, body); }, &camera);
  Process bridge = start("course: 'course.txt' depth { image: '" + std::string(CameraProgram::kTopic) + "' }",
                         board.port, kOdometry, "", kByItself);
  EXPECT_EQ(bridge.wait(120s).value_or(-1), 0) << bridge.output() << server.output();
  EXPECT_TRUE(world.passed) << bridge.output();
  EXPECT_TRUE(world.on_ground);
}

TEST_F(BetaflightBridge, AMotionCaptureThatStopsInTheAirEndsInALevelDescent) {
  Process server = programs_.server("server.log");
  Board board(false);
  World world([&](Stamp now, const RateBody& body) { return board.motors(now, body); });
  Process bridge = this->bridge(board.port, kOdometry, "", kByItself);
  ASSERT_TRUE(bridge.wait_for_output("height_reached", 90s)) << bridge.output() << server.output();
  world.capture.works = false;
  ASSERT_TRUE(bridge.wait_for_output("state_lost", 10s)) << bridge.output();
  EXPECT_TRUE(bridge.wait(30s).has_value()) << bridge.output();
  EXPECT_FALSE(board.armed);
}

TEST_F(BetaflightBridge, RealFirmwareFliesTheGate) {
  if (RealFirmware::program().empty())
    GTEST_SKIP() << "left out: GATEFIELD_BETAFLIGHT_SITL names no program (Betaflight built for the target SITL)";
  auto settings = bridge_settings("ACTUAL", 20, 67, 0);
  settings.insert(settings.end(),
                  {"set throttle_boost = 0", "set rc_smoothing = OFF", "set serial_update_rate_hz = 1000"});
  const RealFirmware firmware(programs_.file("firmware"), settings);
  const MonotonicClock clock;
  auto exchange = sitl::Exchange::open({.wire = RealFirmware::wire()}, clock);
  ASSERT_TRUE(exchange.ok()) << exchange.error();
  std::array<double, 4> motors{};
  World world([&](Stamp, const RateBody& body) {
    sitl::State state;
    state.body_rates_rad_s = body.state.w_WB_B;
    state.specific_force_m_s2 = body.specific_force_B;
    state.q_WB = body.state.q_WB;
    if (const auto fresh = (*exchange)->exchange(state)) motors = *fresh;
    return motors;
  });
  Process server = programs_.server("server.log");
  Process bridge = this->bridge(sitl::kMspPort, kOdometry, "", std::string(kByItself) + "arming_limit: 15 ", 0.4);
  EXPECT_EQ(bridge.wait(120s).value_or(-1), 0) << bridge.output() << server.output();
  EXPECT_TRUE(world.passed) << bridge.output();
  EXPECT_TRUE(world.on_ground);
}

}  // namespace
}  // namespace gatefield::test
