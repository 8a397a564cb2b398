#include "client/simulator/arguments.h"

#include <cmath>
#include <numbers>

#include "common/config/locate.h"
#include "common/dds/network_arguments.h"
#include "common/protocol/validate.h"

namespace gatefield::simulator {
namespace {

/// What the command line says of how the vehicle is driven, and how that is in truth.
Status read_drive(const Arguments& a, config::Scenario* scenario) {
  if (a.actuation) {
    scenario->vehicle.actuation = config::driven_by(scenario->vehicle, *a.actuation);
  } else if (!a.flight_controller.empty()) {
    scenario->vehicle.actuation = config::driven_by(scenario->vehicle, Actuation::Kind::kBodyRates);
  }
  config::Mismatch& mismatch = scenario->mismatch;
  if (a.rate_loop_factor) mismatch.rate_lag_factor = *a.rate_loop_factor;
  if (a.rate_limit_rad_s) mismatch.rate_limit_rad_s.setConstant(*a.rate_limit_rad_s);
  if (a.setpoint_delay_ms) mismatch.setpoint_delay = from_seconds(1e-3 * *a.setpoint_delay_ms);
  if (a.thrust_factor) mismatch.thrust_factor = *a.thrust_factor;
  if (auto status = config::validate(mismatch); !status) return status;
  return config::validate(mismatch, scenario->vehicle.actuation);
}

decltype(Px4Options::setpoints) px4_setpoints(const Arguments& a, bool board) {
  const std::string way = !a.firmware_setpoints.empty() ? a.firmware_setpoints : board ? "same" : "bus";
  if (way == "bus") return a.px4_bus;
  if (way == "same") return SameLink{};
  return way;
}

}  // namespace

void declare(CLI::App* app, Arguments* a) {
  app->description(
      "Flies one race in simulation: MuJoCo for the vehicle, Embree for its depth camera, and a referee that knows "
      "where the\n"
      "gates truly stand. Plans come from a gatefield-server over DDS.\n");
  app->footer(
      "\nExamples\n"
      "  gatefield-sim --scenario circle-0.3m --speed 7 --picture flight.png     one race at 7 m/s, with a picture\n"
      "  gatefield-sim --scenario circle-0.3m --seed 12                          the same race with other gates\n"
      "  gatefield-sim --scenario circle-yaw30 --realtime                        at the speed of the real world\n"
      "  gatefield-sim --actuation body-rates --setpoint-delay-ms 20             through a flight controller's rate "
      "loop\n"
      "  gatefield-sim --world hard --speed 8                                    in a world that is harder than told\n"
      "  gatefield-sim --vehicle racer-betaflight --flight-controller betaflight through a real firmware\n"
      "  gatefield-sim --flight-controller px4 --pace 0.5                        through PX4, at half the world's "
      "speed\n"
      "  gatefield-sim --flight-controller px4 --firmware-address serial:/dev/ttyACM0:921600 --realtime\n"
      "                                                                          through a board with PX4\n"
      "  gatefield-sim --course my/course.txt --vehicle my/drone.txt             files of your own "
      "(docs/courses-and-vehicles.md)\n"
      "\nExit code\n"
      "  0 the race is won, or a person ended it (Ctrl-C)   1 lost   2 bad input   3 no server, or it refused\n");

  app->add_option("--scenario", a->scenario, "Scenario: a file or a short name (default: circle-0.3m)")->group("Race");
  app->add_option("--course", a->course, "Course in place of the scenario's: a file or a short name")->group("Race");
  app->add_option("--vehicle", a->vehicle, "Vehicle in place of the scenario's: a file or a short name")->group("Race");
  app->add_option("--seed", a->seed, "Seed of the true world: where gates stand, noise, link")->group("Race");
  app->add_option("--planner-seed", a->planner_seed,
                  "Seed of the planner's sampling (default: the scenario's, else it goes with --seed)")
      ->group("Race");
  app->add_option("--laps", a->laps, "Laps in place of the course's")->check(CLI::Range(1, kMaxLaps))->group("Race");
  app->add_option("--speed", a->speed_m_s, "Soft speed limit in m/s (default: the profile's)")
      ->check(CLI::Range(0.5, 50.0))
      ->group("Race");
  app->add_option("--position-noise", a->position_noise_m,
                  "Displacement of the gates in metres, in place of the scenario's")
      ->group("Race");
  app->add_option("--yaw-noise", a->yaw_noise_deg, "Turn of the gates in degrees, in place of the scenario's")
      ->group("Race");
  app->add_flag("--exact", a->exact,
                "Gates are displaced, turned and leant by exactly what the scenario says, none of it by less")
      ->group("Race");
  app->add_option("--hull", a->hull,
                  "By what contact is judged: discs (those of the propellers, as they are turned, and the body's "
                  "sphere) or sphere alone, in place of the scenario's")
      ->transform(CLI::CheckedTransformer(config::hull_names(), CLI::ignore_case))
      ->group("Race");
  app->add_option("--camera-rate", a->camera_rate_hz, "Depth frames per second, in place of the vehicle's")
      ->group("Race");
  app->add_option("--world", a->world,
                  "How the truth is harder than the planner's idea of it, in place of the scenario's: hard, or some of "
                  "its parts, drift,battery (docs/hard-world.md)")
      ->delimiter(',')
      ->transform(CLI::CheckedTransformer(config::world_part_names(), CLI::ignore_case))
      ->group("Race");
  app->add_option("--actuation", a->actuation,
                  "How the vehicle is driven: rotor-thrusts or body-rates (default: the scenario's, else the vehicle "
                  "file's)")
      ->transform(CLI::CheckedTransformer(config::actuation_names(), CLI::ignore_case))
      ->group("Race");
  app->add_option("--rate-loop-factor", a->rate_loop_factor,
                  "Time constants of the true rate loop against those told, in place of the scenario's")
      ->group("Race");
  app->add_option("--rate-limit", a->rate_limit_rad_s,
                  "Where the true rate loop clamps each body rate that it is asked for, rad/s, in place of the "
                  "scenario's")
      ->group("Race");
  app->add_option("--setpoint-delay-ms", a->setpoint_delay_ms,
                  "From setpoint to the true rate loop, in place of the scenario's")
      ->group("Race");
  app->add_option("--thrust-factor", a->thrust_factor, "True thrust against what is told, in place of the scenario's")
      ->group("Race");
  app->add_option("--time-limit", a->time_limit_s, "Longest race in seconds, in place of the scenario's")
      ->check(CLI::Range(1.0, 86400.0))
      ->group("Race");

  app->add_option("--profile", a->profile, "Planner profile of the server")->capture_default_str()->group("Server");
  app->add_option("--name", a->name, "Name of the vehicle on the wire; one client per name")
      ->capture_default_str()
      ->group("Server");
  app->add_option("--priority", a->priority,
                  "0 to 9: who has least is refused, or sent away, first when the server can't serve all")
      ->check(CLI::Range(0, int{protocol::kMaxPriority}))
      ->capture_default_str()
      ->group("Server");
  app->add_option("--server", a->server, "Name of the one server that may answer (default: whichever does first)")
      ->group("Server");
  app->add_option("--domain", a->domain, "DDS domain")
      ->check(CLI::Range(0, 232))
      ->capture_default_str()
      ->group("Server");
  app->add_option("--connect-timeout", a->connect_timeout_s, "How long to look for a server, in seconds")
      ->check(CLI::Range(0.1, 600.0))
      ->capture_default_str()
      ->group("Server");
  dds::add_network_options(app, &a->network);

  auto* lockstep = app->add_flag("--lockstep", a->lockstep,
                                 "Simulated time, as fast as the machine can; same seed, same race (default)");
  auto* real_time = app->add_flag("--realtime", a->real_time, "At the speed of the real world");
  lockstep->excludes(real_time)->group("Time");
  real_time->group("Time");
  app->add_option("--delay-ms", a->delay_ms, "Lockstep: plans take effect this much later, as over a slow link")
      ->check(CLI::Range(0.0, 1000.0))
      ->group("Time");
  app->add_option("--jitter-ms", a->jitter_ms, "Lockstep: and by up to this much more, uniform, message by message")
      ->check(CLI::Range(0.0, 1000.0))
      ->group("Time");
  app->add_option("--loss", a->loss, "Lockstep: share of messages that are lost, each way")
      ->check(CLI::Range(0.0, 0.9))
      ->group("Time");
  app->add_option("--outage-s", a->outage_s,
                  "Lockstep: for so long nothing gets through, beginning 2 to 8 s after the start, as the seed says")
      ->check(CLI::Range(0.0, 60.0))
      ->group("Time");
  app->add_option("--state-rate", a->state_rate_hz, "Real time: states sent per second")
      ->check(CLI::Range(10.0, 1000.0))
      ->capture_default_str()
      ->group("Time");
  app->add_flag("--depth-metres", a->depth_metres,
                "Send depth as 32-bit metres (default: 16-bit counts of the camera's metres_per_count)")
      ->group("Time");

  auto* controller = app->add_option("--flight-controller", a->flight_controller,
                                     "The firmware that flies the vehicle: betaflight (of its target SITL; in "
                                     "lockstep with the clock library) or px4 (its SITL in lockstep, or a board on a "
                                     "serial port with --realtime)");
  controller->check(CLI::IsMember({"betaflight", "px4"}))->group("Firmware");
  app->add_option("--firmware-address", a->firmware_address,
                  "Where it is: betaflight's MSP (default: " + FirmwareOptions().address +
                      "); where px4 connects to for its sensors (default: " + Px4Options().hil.address +
                      "), or a board with px4: serial:/dev/ttyACM0:921600")
      ->needs(controller)
      ->group("Firmware");
  app->add_option("--firmware-setpoints", a->firmware_setpoints,
                  "px4: bus (its uXRCE-DDS agent's; the default of its SITL), a link on which it speaks MAVLink and "
                  "takes setpoints, udp-listen:127.0.0.1:14540, or same (the sensors' own; the default of a board)")
      ->needs(controller)
      ->group("Firmware");
  app->add_option("--px4-domain", a->px4_bus.domain, "px4: DDS domain of its agent")
      ->check(CLI::Range(0, 232))
      ->capture_default_str()
      ->needs(controller)
      ->group("Firmware");
  app->add_option("--px4-release", a->px4_bus.release, "px4: its release, which decides topics and layouts: 1.15, ...")
      ->transform(CLI::CheckedTransformer(px4::release_names()))
      ->needs(controller)
      ->group("Firmware");
  app->add_option("--pace", a->pace, "px4: seconds of simulation in a second at most; on a busy machine less than 1")
      ->check(CLI::Range(0.01, 20.0))
      ->capture_default_str()
      ->needs(controller)
      ->group("Firmware");

  app->add_option("--sensor-rate", a->sensor_rate_hz, "px4 on a board: samples of its sensors per second")
      ->check(CLI::Range(20.0, 1000.0))
      ->capture_default_str()
      ->needs(controller)
      ->group("Firmware");

  app->add_option("--gyro-noise", a->gyro_noise_rad_s, "betaflight: noise of each sample of its gyro, rad/s")
      ->needs(controller)
      ->group("Firmware");
  app->add_option("--gyro-bias", a->gyro_bias_rad_s, "betaflight: bias of its gyro, drawn once a flight, rad/s")
      ->needs(controller)
      ->group("Firmware");

  app->add_option("--csv", a->csv, "Write the run here, a line every 10 ms")->group("Output");
  app->add_option("--picture", a->picture, "Write a picture of the flight here (PNG)")->group("Output");
  app->add_option("--depth-picture", a->depth_picture, "Write a depth frame in colours here (PNG)")->group("Output");
  app->add_option("--save-frame", a->frame_folder, "Keep a raw depth frame and its pose in this folder")
      ->group("Output");
  app->add_flag("--quiet,-q", a->quiet, "No progress, no summary; the exit code tells")->group("Output");
  app->add_option("--log-level", a->log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str()
      ->group("Output");
}

Result<config::Scenario> read_scenario(const Arguments& a) {
  const bool own_parts = !a.course.empty() && !a.vehicle.empty();
  std::optional<config::Scenario> scenario;
  if (!a.scenario.empty() || !own_parts) {
    const auto file = config::find_config("scenarios", a.scenario.empty() ? "circle-0.3m" : a.scenario);
    if (!file) return file.failure();
    auto loaded = config::load_scenario(*file);
    if (!loaded) return loaded;
    scenario = std::move(loaded).value();
    if (a.scenario.empty() && !a.course.empty()) scenario->title.clear();
  } else {
    scenario.emplace();
  }
  if (!a.course.empty()) {
    const auto file = config::find_config("courses", a.course);
    if (!file) return file.failure();
    auto track = config::load_track(*file);
    if (!track) return track.failure();
    scenario->track = std::move(track).value();
    scenario->course_file = *file;
  }
  if (!a.vehicle.empty()) {
    const auto file = config::find_config("vehicles", a.vehicle);
    if (!file) return file.failure();
    auto vehicle = config::load_vehicle(*file);
    if (!vehicle) return vehicle.failure();
    scenario->vehicle = std::move(vehicle).value();
    scenario->vehicle_file = *file;
  }
  if (scenario->title.empty()) scenario->title = scenario->track.title;
  if (a.seed) scenario->seed = *a.seed;
  if (a.planner_seed) scenario->planner_seed = a.planner_seed;
  if (a.laps) scenario->track.course.laps = *a.laps;
  if (a.position_noise_m) {
    scenario->perturbation.position_m = *a.position_noise_m;
    scenario->perturbation.height_m = 0.5 * *a.position_noise_m;
  }
  if (a.yaw_noise_deg) scenario->perturbation.yaw_rad = *a.yaw_noise_deg * std::numbers::pi / 180.0;
  if (a.exact) scenario->perturbation.exact = true;
  if (a.hull) scenario->hull = *a.hull;
  if (auto status = config::validate(scenario->perturbation); !status) return status.failure().within("command line: ");
  if (auto status = read_drive(a, &*scenario); !status) return status.failure().within("command line: ");
  if (!a.world.empty()) scenario->hard = config::hard_world(a.world);
  if (scenario->hard.camera_rate_hz > 0 && !a.world.empty())
    scenario->vehicle.camera.rate_hz = scenario->hard.camera_rate_hz;
  if (a.camera_rate_hz) scenario->vehicle.camera.rate_hz = *a.camera_rate_hz;
  if (auto status = validate(scenario->vehicle.camera); !status) return status.failure().within("command line: ");
  if (a.time_limit_s) scenario->time_limit = from_seconds(*a.time_limit_s);
  return std::move(*scenario);
}

Options race_options(const Arguments& a) {
  Options options;
  options.timing = a.real_time ? protocol::Timing::kRealTime : protocol::Timing::kLockstep;
  options.link_delay = from_seconds(1e-3 * a.delay_ms);
  options.link_jitter = from_seconds(1e-3 * a.jitter_ms);
  options.link_loss = a.loss;
  options.link_outage = from_seconds(a.outage_s);
  options.state_rate_hz = a.state_rate_hz;
  options.depth_in_counts = !a.depth_metres;
  if (a.flight_controller == "betaflight") {
    FirmwareOptions& firmware = options.firmware.emplace();
    if (!a.firmware_address.empty()) firmware.address = a.firmware_address;
    firmware.gyro = {a.gyro_noise_rad_s, a.gyro_bias_rad_s};
  } else if (a.flight_controller == "px4") {
    Px4Options& px4 = options.px4.emplace();
    px4.pace = a.pace;
    px4.hil.sample_rate_hz = a.sensor_rate_hz;
    if (!a.firmware_address.empty()) px4.hil.address = a.firmware_address;
    px4.setpoints = px4_setpoints(a, px4.hil.address.starts_with("serial:"));
  }
  return options;
}

Result<sdk::Options> link_options(const Arguments& a, const config::Scenario& scenario) {
  if (auto status = protocol::validate_name("--name", a.name); !status) return status.failure();
  sdk::Options link = session_options(scenario, race_options(a).timing);
  link.domain = a.domain;
  link.network = a.network;
  link.vehicle = a.name;
  link.server = a.server;
  link.profile = a.profile;
  link.speed_limit_m_s = a.speed_m_s;
  link.priority = static_cast<std::uint8_t>(a.priority);
  link.connect_timeout = std::chrono::milliseconds(std::lround(1000 * a.connect_timeout_s));
  return link;
}

}  // namespace gatefield::simulator
