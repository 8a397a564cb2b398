#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/simulator/simulation.h"
#include "common/base/result.h"
#include "common/config/scenario.h"
#include "common/dds/network.h"
#include "gatefield/sdk/client.h"

/// What a person asks gatefield-sim for, and what that means. Thread-safe: yes.   Real-time safe: no.
namespace gatefield::simulator {

struct Arguments {
  std::string scenario, course, vehicle;
  std::optional<std::uint64_t> seed, planner_seed;
  std::optional<double> position_noise_m, yaw_noise_deg, camera_rate_hz, time_limit_s;
  std::optional<Actuation::Kind> actuation;
  std::optional<config::HullKind> hull;
  bool exact = false;
  std::vector<config::WorldPart> world;
  std::optional<double> rate_loop_factor, rate_limit_rad_s, setpoint_delay_ms, thrust_factor;
  std::optional<int> laps;
  double speed_m_s = 0.0;
  std::string profile = "race";
  std::string name = "drone", server;
  int priority = protocol::kUsualPriority;
  std::uint32_t domain = 0;
  dds::NetworkOptions network;
  bool lockstep = false, real_time = false, depth_metres = false, quiet = false;
  double delay_ms = 0.0, jitter_ms = 0.0, loss = 0.0, outage_s = 0.0;
  double state_rate_hz = 200.0;
  std::string flight_controller, firmware_address;  ///< an empty address: the firmware's usual one
  std::string firmware_setpoints;                   ///< empty: on the bus; with a board, beside its sensors
  px4::BusOptions px4_bus;
  double pace = Px4Options().pace;
  double sensor_rate_hz = firmware::HilOptions().sample_rate_hz;
  double gyro_noise_rad_s = 0.0, gyro_bias_rad_s = 0.0;
  double connect_timeout_s = 10.0;
  std::string csv, picture, depth_picture, frame_folder;
  std::string log_level = "warn";
};

/// The program's options, with their help.
void declare(CLI::App* app, Arguments* arguments);

/// The scenario with everything that the command line says in place of it. Errors: a file's, or an option's value.
Result<config::Scenario> read_scenario(const Arguments& arguments);

/// How to fly it. Unchecked: validate(Options).
Options race_options(const Arguments& arguments);

/// How to join. Errors: --name.
Result<sdk::Options> link_options(const Arguments& arguments, const config::Scenario& scenario);

}  // namespace gatefield::simulator
