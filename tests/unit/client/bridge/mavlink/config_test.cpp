#include "client/bridge/mavlink/config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

TEST(MavlinkConfig, DefaultsAreGood) {
  const Status status = validate(MavlinkConfig{});
  EXPECT_TRUE(status.ok()) << status.error();
}

TEST(MavlinkConfig, EveryFieldOutOfRangeIsNamed) {
  using Bend = std::function<void(MavlinkConfig*)>;
  const std::vector<std::pair<std::string, Bend>> bends{
      {"link.kind", [](auto* c) { c->link = "bus:1"; }},
      {"link.port", [](auto* c) { c->link = "udp-listen:0.0.0.0:70000"; }},
      {"own_system", [](auto* c) { c->own_system = 0; }},
      {"own_component", [](auto* c) { c->own_component = 0; }},
      {"vehicle_system", [](auto* c) { c->vehicle_system = c->own_system; }},
      {"setpoint_rate_hz", [](auto* c) { c->setpoint_rate_hz = 10; }},
      {"setpoint_rate_hz", [](auto* c) { c->setpoint_rate_hz = std::nan(""); }},
      {"state_rate_hz", [](auto* c) { c->state_rate_hz = 1000; }},
      {"link_delay", [](auto* c) { c->link_delay = -1ms; }},
      {"link_delay", [](auto* c) { c->link_delay = 201ms; }},
      {"connect_timeout", [](auto* c) { c->connect_timeout = 1ms; }},
      {"connect_timeout", [](auto* c) { c->connect_timeout = 1h; }},
      {"time_sync.ask_every", [](auto* c) { c->time_sync.ask_every = 2s; }},
      {"state.oldest", [](auto* c) { c->state.oldest = 2s; }},
      {"radio.arm", [](auto* c) { c->radio.arm = 19; }},
      {"radio.take_over", [](auto* c) { c->radio.take_over = -1; }},
      {"radio.kill", [](auto* c) { c->radio.take_over = c->radio.kill = 6; }},
      {"radio.threshold_us", [](auto* c) { c->radio.threshold_us = 900; }},
      {"arm_by_command",
       [](auto* c) {
         c->arm_by_command = true;
         c->radio.arm = 5;
       }},
      {"thrust.hover_throttle", [](auto* c) { c->thrust.hover_throttle = 2; }},
      {"quadrotor.mass_kg", [](auto* c) { c->quadrotor.mass_kg = -1; }},
  };
  for (const auto& [field, bend] : bends) {
    MavlinkConfig config;
    bend(&config);
    const Status status = validate(config);
    ASSERT_FALSE(status.ok()) << field;
    EXPECT_EQ(status.failure().field, field) << status.error();
  }
}

}  // namespace
}  // namespace gatefield::bridge
