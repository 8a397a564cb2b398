// A flight through gatefield-bridge in real time, with PX4's topics: server and bridge as processes, and a PX4 of ours
// (tests/support) with a simulated body on the bus.

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <memory>
#include <variant>

#include "client/bridge/px4/vehicle.h"
#include "tests/integration/bridge/world.h"
#include "tests/integration/race/programs.h"
#include "tests/support/px4_bus.h"
#include "tests/support/px4_controller.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

px4::BusOptions bus_options(px4::Release release = px4::Release::k1_16) {
  px4::BusOptions options;
  options.domain = own_domain();
  options.release = release;
  return options;
}

/// A PX4 on the bus, served on one thread.
class Px4Side {
 public:
  explicit Px4Side(const px4::BusOptions& options) : bus_(Px4Bus::open(options)) {}
  Px4Controller::Say say() {
    return [this](const px4::Message& message) { bus_->write(message); };
  }
  void serve(Px4Controller* controller, Stamp now) {
    for (const auto& heard : bus_->heard())
      std::visit([&](const auto& message) { controller->hear(now, message); }, heard);
    controller->serve(now, std::chrono::system_clock::now().time_since_epoch());
  }

 private:
  const std::unique_ptr<Px4Bus> bus_;
};

class Px4World final : private Px4Side, public World<Px4Controller> {
 public:
  explicit Px4World(const px4::BusOptions& options)
      : Px4Side(options), World(std::make_unique<Px4Controller>(say()), [this](Px4Controller* controller, Stamp now) {
          serve(controller, now);
        }) {}
  ~Px4World() { end(); }
};

class Px4BridgeFlight : public testing::Test {
 protected:
  Px4BridgeFlight() {
    std::ofstream(programs_.file("bridge.txt"))
        << "vehicle: 'racer-rates' course: 'one-gate' session { domain: " << programs_.domain()
        << " speed_limit_m_s: 3 connect_timeout: 20 } safety { needs_field: false needs_depth: false "
           "needs_firmware_failsafe: false round_trip_max: 0.4 take_off_height_m: 1.5 } "
           "thrust { hover_throttle: 0.43 } px4 { release: '1.16' domain: "
        << programs_.domain() << " radio { arm: 5 } }";
  }
  Process bridge() const {
    return Process((kPrograms / "gatefield-bridge").string(),
                   {"px4", "--config", programs_.file("bridge.txt").string()}, programs_.file("bridge.log"));
  }

  Programs programs_{"px4-bridge-flight"};
};

TEST_F(Px4BridgeFlight, FromTheArmSwitchThroughTheFirstGateToTheGround) {
  Process server = programs_.server("server.log");
  Px4World world(bus_options());
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

TEST_F(Px4BridgeFlight, AnAgentThatDiesOnTheGroundIsToldWithTheNextStep) {
  Process server = programs_.server("server.log");
  Px4World world(bus_options());
  Process bridge = this->bridge();
  ASSERT_TRUE(bridge.wait_for_output("joined a session", 60s)) << bridge.output() << server.output();
  world.end();
  EXPECT_EQ(bridge.wait(30s).value_or(-1), 4) << bridge.output();
  EXPECT_NE(bridge.output().find("PX4 does not always come back by itself"), std::string::npos) << bridge.output();
}

/// What goes over the bus, in each release's layout.
class EachRelease : public testing::TestWithParam<px4::Release> {};
INSTANTIATE_TEST_SUITE_P(Px4OverDds, EachRelease,
                         testing::Values(px4::Release::k1_15, px4::Release::k1_16, px4::Release::k1_17,
                                         px4::Release::k1_18),
                         [](const auto& release) {
                           return "Release1_" + std::string(px4::name(release.param).substr(2));
                         });

TEST_P(EachRelease, StatesStatusAndCommandsCross) {
  Px4World world(bus_options(GetParam()));
  bridge::Px4Config config;
  config.bus = bus_options(GetParam());
  config.radio.arm = 5;
  auto opened = bridge::Px4Vehicle::open(config);
  ASSERT_TRUE(opened.ok()) << opened.error();
  bridge::Px4Vehicle& vehicle = **opened;
  vehicle.keep_alive(1200ms);
  const auto state = vehicle.states()->newest({});
  ASSERT_TRUE(state);
  EXPECT_LE(state->state.p_WB.norm(), 0.01);
  const auto status = vehicle.flight_controller().newest({});
  ASSERT_TRUE(status);
  EXPECT_EQ(status->on_ground, true);
  EXPECT_EQ(status->battery_v, 15.5);
  ASSERT_TRUE(status->pilot);
  EXPECT_FALSE(status->pilot->arm);
  const auto hold = [&](Stamp span) {
    for (const Stamp end = vehicle.clock()->now() + span; vehicle.clock()->now() < end;
         vehicle.clock()->sleep_until(vehicle.clock()->now() + 10ms)) {
      vehicle.flight_controller().want(vehicle.clock()->now(), flight::Wanted::kArmed);
      vehicle.actuator().hold(vehicle.clock()->now());
    }
  };
  hold(2s);
  EXPECT_EQ(vehicle.report().mode.kind, bridge::CommandFate::Kind::kAccepted);
  EXPECT_TRUE(vehicle.flight_controller().newest({})->follows_us);
  for (const std::string& sentence : vehicle.complaints()) ADD_FAILURE() << sentence;
}

TEST(Px4OverDds, HostileValuesAreRefusedWithTheirFieldAndTheFlightGoesOn) {
  const px4::BusOptions options = bus_options();
  const auto bus = Px4Bus::open(options);
  flight::RealTimeClock clock;
  Px4Controller controller([&](const px4::Message& message) { bus->write(message); });
  bridge::Px4Config config;
  config.bus = options;
  config.radio.arm = 5;
  config.connect_timeout = 100ms;
  ASSERT_FALSE(bridge::Px4Vehicle::open(config).ok()) << "nothing was said yet";
  config.connect_timeout = 10s;
  std::atomic<bool> ending{false};
  std::thread thread([&] {
    while (!ending) {
      clock.sleep_until(clock.now() + 1ms);
      controller.serve(clock.now(), std::chrono::system_clock::now().time_since_epoch());
      px4::VehicleOdometry bad;
      bad.timestamp = bad.timestamp_sample = 1;
      bad.position[1] = std::numeric_limits<float>::quiet_NaN();
      bus->write(bad);
    }
  });
  auto opened = bridge::Px4Vehicle::open(config);
  if (opened.ok()) {
    (*opened)->keep_alive(500ms);
    EXPECT_TRUE((*opened)->states()->newest({}));
    bool told = false;
    for (const std::string& sentence : (*opened)->complaints())
      told = told || sentence.find("vehicle_odometry.position[1] is nan m, expected") != std::string::npos;
    EXPECT_TRUE(told);
  }
  ending = true;
  thread.join();
  EXPECT_TRUE(opened.ok()) << opened.error();
}

}  // namespace
}  // namespace gatefield::test
