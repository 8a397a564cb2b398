#include "client/bridge/px4/config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

TEST(Px4Config, DefaultsAreGood) {
  const Status status = validate(Px4Config{});
  EXPECT_TRUE(status.ok()) << status.error();
}

TEST(Px4Config, EveryFieldOutOfRangeIsNamed) {
  using Bend = std::function<void(Px4Config*)>;
  const std::vector<std::pair<std::string, Bend>> bends{
      {"domain", [](auto* c) { c->bus.domain = 233; }},
      {"namespace", [](auto* c) { c->bus.name_space = "/px4_1"; }},
      {"namespace", [](auto* c) { c->bus.name_space = "px4 1"; }},
      {"namespace", [](auto* c) { c->bus.name_space = std::string(64, 'a'); }},
      {"versions.topic", [](auto* c) { c->bus.versions["vehicle_mood"] = 1; }},
      {"versions.version", [](auto* c) { c->bus.versions["vehicle_status"] = -1; }},
      {"versions.version", [](auto* c) { c->bus.versions["vehicle_status"] = 100; }},
      {"own_system", [](auto* c) { c->own_system = 0; }},
      {"own_component", [](auto* c) { c->own_component = 0; }},
      {"setpoint_rate_hz", [](auto* c) { c->setpoint_rate_hz = 10; }},
      {"setpoint_rate_hz", [](auto* c) { c->setpoint_rate_hz = std::nan(""); }},
      {"link_delay", [](auto* c) { c->link_delay = -1ms; }},
      {"link_delay", [](auto* c) { c->link_delay = 201ms; }},
      {"connect_timeout", [](auto* c) { c->connect_timeout = 1ms; }},
      {"connect_timeout", [](auto* c) { c->connect_timeout = 1h; }},
      {"clock.most_error", [](auto* c) { c->clock.most_error = 0ms; }},
      {"clock.most_error", [](auto* c) { c->clock.most_error = 2s; }},
      {"state.oldest", [](auto* c) { c->state.oldest = 2s; }},
      {"radio.arm", [](auto* c) { c->radio.arm = 19; }},
      {"radio.arm",
       [](auto* c) {
         c->radio_from = RadioFrom::kManualControl;
         c->radio.arm = 7;
       }},
      {"radio.kill", [](auto* c) { c->radio.take_over = c->radio.kill = 6; }},
      {"arm_by_command",
       [](auto* c) {
         c->arm_by_command = true;
         c->radio.arm = 5;
       }},
      {"thrust.hover_throttle", [](auto* c) { c->thrust.hover_throttle = 2; }},
      {"quadrotor.mass_kg", [](auto* c) { c->quadrotor.mass_kg = -1; }},
  };
  for (const auto& [field, bend] : bends) {
    Px4Config config;
    bend(&config);
    const Status status = validate(config);
    ASSERT_FALSE(status.ok()) << field;
    EXPECT_EQ(status.failure().field, field) << status.error();
  }
}

}  // namespace
}  // namespace gatefield::bridge
