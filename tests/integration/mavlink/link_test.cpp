// The bridge on real links (UDP, TCP, a serial line) against an autopilot of ours on a thread of its own, in real time.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <iostream>
#include <thread>
#include <vector>

#include "client/bridge/mavlink/vehicle.h"
#include "common/base/statistics.h"
#include "tests/support/mavlink_controller.h"
#include "tests/support/terminal.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

/// An autopilot that is served until it goes out of scope.
class Served {
 public:
  explicit Served(std::unique_ptr<firmware::Link> link)
      : controller_(std::move(link), Dialect::kPx4), thread_([this] {
          while (!ending_) {
            controller_.serve(MonotonicClock().now());
            std::this_thread::sleep_for(500us);
          }
        }) {}
  ~Served() {
    ending_ = true;
    thread_.join();
  }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;

 private:
  test::MavlinkController controller_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

MavlinkConfig config_for(const std::string& link) {
  MavlinkConfig config;
  config.link = link;
  config.setpoint_rate_hz = 200;
  config.connect_timeout = 5s;
  return config;
}

struct Latency {
  double median_ms, p99_ms, oldest_state_ms;
};

/// The loop's steps for two seconds: state in, setpoint out.
Latency measure(MavlinkVehicle* vehicle) {
  std::vector<double> taken_ms;
  double oldest_ms = 0.0;
  const sdk::Setpoint setpoint{};
  flight::LoopClock& clock = *vehicle->clock();
  Stamp due = clock.now();
  for (int i = 0; i < 400; ++i) {
    due = clock.sleep_until(due + vehicle->actuator().period());
    const Stamp begin = MonotonicClock().now();
    const auto state = vehicle->states()->newest(due);
    (void)vehicle->flight_controller().newest(due);
    vehicle->flight_controller().want(due, flight::Wanted::kDisarmed);
    vehicle->actuator().apply(due, setpoint);
    const Stamp end = MonotonicClock().now();
    taken_ms.push_back(seconds(end - begin) * 1e3);
    if (state && i > 100) oldest_ms = std::max(oldest_ms, seconds(begin - state->stamp) * 1e3);
  }
  return {quantile_in_place<double>(taken_ms, 0.5), quantile_in_place<double>(taken_ms, 0.99), oldest_ms};
}

void expect_flows(MavlinkVehicle* vehicle) {
  ASSERT_TRUE(vehicle->connect().ok());
  const Latency latency = measure(vehicle);
  std::cout << "state in to setpoint out: p50 " << latency.median_ms << " ms, p99 " << latency.p99_ms
            << " ms; oldest state " << latency.oldest_state_ms << " ms\n";
  EXPECT_LE(latency.median_ms, 0.3);
  EXPECT_GT(vehicle->report().states, 100U);
  EXPECT_LE(std::abs(vehicle->report().drift_ppm), 500.0);
  for (const std::string& complaint : vehicle->complaints()) ADD_FAILURE() << complaint;
}

TEST(BridgeLink, StatesAndSetpointsGoOverUdp) {
  auto link = firmware::open(firmware::parse_address("udp-listen:127.0.0.1:0").value(), 1s);
  ASSERT_TRUE(link.ok()) << link.error();
  const std::string there = "udp:127.0.0.1:" + std::to_string((*link)->local_port());
  Served autopilot(firmware::open(firmware::parse_address(there).value(), 1s).value());
  MavlinkVehicle vehicle(config_for("udp-listen:127.0.0.1:0"), std::move(link).value(),
                         std::make_unique<MonotonicClock>());
  expect_flows(&vehicle);
}

TEST(BridgeLink, StatesAndSetpointsGoOverTcp) {
  auto server = firmware::open(firmware::parse_address("tcp-listen:127.0.0.1:0").value(), 1s);
  ASSERT_TRUE(server.ok()) << server.error();
  const std::string there = "tcp:127.0.0.1:" + std::to_string((*server)->local_port());
  Served autopilot(std::move(server).value());
  auto vehicle = MavlinkVehicle::open(config_for(there));
  ASSERT_TRUE(vehicle.ok()) << vehicle.error();
  expect_flows(vehicle->get());
}

TEST(BridgeLink, StatesAndSetpointsGoOverASerialLine) {
  auto terminal = std::make_unique<test::Terminal>();
  ASSERT_FALSE(terminal->name().empty());
  const std::string there = "serial:" + terminal->name() + ":921600";
  Served autopilot(std::move(terminal));
  auto vehicle = MavlinkVehicle::open(config_for(there));
  ASSERT_TRUE(vehicle.ok()) << vehicle.error();
  expect_flows(vehicle->get());
}

TEST(BridgeLink, ANoisySerialLineCostsWhatItBreaks) {
  auto terminal = std::make_unique<test::Terminal>();
  ASSERT_FALSE(terminal->name().empty());
  const std::string there = "serial:" + terminal->name() + ":921600";
  terminal->noise = test::line_noise(2e-3, 7);  // a message in four, or so
  Served autopilot(std::move(terminal));
  auto vehicle = MavlinkVehicle::open(config_for(there));
  ASSERT_TRUE(vehicle.ok()) << vehicle.error();
  const auto before = (*vehicle)->report().states;
  (void)measure(vehicle->get());
  const auto report = (*vehicle)->report();
  EXPECT_GT(report.states - before, 60U) << "of 200";
  EXPECT_EQ(report.faults, 0U) << "what has a right checksum was sent so";
  const auto state = (*vehicle)->states()->newest(MonotonicClock().now());
  ASSERT_TRUE(state);
  EXPECT_LE(state->state.p_WB.norm() + state->state.v_WB.norm(), 1e-6) << "where it stands";
  EXPECT_FALSE((*vehicle)->flight_controller().newest(MonotonicClock().now())->armed);
}

TEST(BridgeLink, ASerialLineThatIsPulledOutGrowsOldAndIsTold) {
  auto terminal = std::make_unique<test::Terminal>();
  ASSERT_FALSE(terminal->name().empty());
  const std::string there = "serial:" + terminal->name() + ":921600";
  auto autopilot = std::make_unique<Served>(std::move(terminal));
  auto vehicle = MavlinkVehicle::open(config_for(there));
  ASSERT_TRUE(vehicle.ok()) << vehicle.error();
  autopilot.reset();
  const Stamp pulled = MonotonicClock().now();
  (void)measure(vehicle->get());
  const Stamp now = MonotonicClock().now();
  EXPECT_LE((*vehicle)->flight_controller().newest(now)->stamp, pulled + 100ms) << "who watches the stamp sees it";
  const auto state = (*vehicle)->states()->newest(now);
  EXPECT_TRUE(!state || state->stamp <= pulled + 100ms);
  const auto complaints = (*vehicle)->complaints();
  EXPECT_TRUE(std::ranges::any_of(complaints, [](const std::string& s) { return s.find(" broke: ") != s.npos; }));
}

TEST(BridgeLink, ADeviceThatIsNotThereIsNamed) {
  const auto vehicle = MavlinkVehicle::open(config_for("serial:/dev/ttyNowhere:57600"));
  ASSERT_FALSE(vehicle.ok());
  EXPECT_EQ(vehicle.failure().field, "device");
}

}  // namespace
}  // namespace gatefield::bridge
