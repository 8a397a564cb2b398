#include "client/simulator/simulation.h"

#include <algorithm>
#include <utility>

#include "client/simulator/lockstep_race.h"
#include "client/simulator/plant.h"
#include "client/simulator/real_time_race.h"
#include "client/simulator/server_news.h"
#include "common/base/text.h"

namespace gatefield::simulator {

using protocol::Timing;

namespace {

Status check_firmware(const Options& options) {
  if (options.firmware && options.px4)
    return Error{"two firmwares would fly one vehicle, expected Betaflight or PX4", ErrorCode::kInvalid, "px4"};
  if (options.px4) {
    if (Status status = validate(*options.px4); !status) return status;
    const bool board = firmware::is_board(options.px4->hil);
    if (board && options.timing != Timing::kRealTime)
      return Error{"a board on a serial port runs by its own clock, expected real time (--realtime)",
                   ErrorCode::kInvalid, "timing"};
    if (!board && options.timing != Timing::kLockstep)
      return Error{
          "PX4's SITL runs by the simulation's clock, expected lockstep with it; a board on a serial port runs "
          "in real time",
          ErrorCode::kInvalid, "timing"};
    return {};
  }
  if (!options.firmware) return {};
  return validate(*options.firmware);
}

/// Null: none flies the vehicle.
Result<std::unique_ptr<FlightControllerInLoop>> open_firmware(const Options& options,
                                                              const config::Scenario& scenario) {
  const auto opened = [](auto loop) -> Result<std::unique_ptr<FlightControllerInLoop>> {
    if (!loop) return loop.failure();
    return std::unique_ptr<FlightControllerInLoop>(std::move(loop).value());
  };
  if (options.firmware) return opened(FirmwareInLoop::open(*options.firmware, scenario, options.timing));
  if (options.px4) return opened(Px4InLoop::open(*options.px4, scenario));
  return std::unique_ptr<FlightControllerInLoop>();
}

}  // namespace

Status validate(const Options& options) {
  for (const auto& [field, value] :
       {std::pair("link_delay", options.link_delay), std::pair("link_jitter", options.link_jitter)})
    if (value < Stamp{0} || value > std::chrono::seconds(1))
      return Error::invalid(field, text(1e3 * seconds(value)) + " ms", "0 to 1000 ms");
  if (!(options.link_loss >= 0 && options.link_loss <= 0.9))
    return Error::invalid("link_loss", text(options.link_loss), "0 to 0.9 of the messages");
  if (options.link_outage < Stamp{0} || options.link_outage > std::chrono::seconds(60))
    return Error::invalid("link_outage", text(seconds(options.link_outage)) + " s", "0 to 60 s");
  if (options.timing == Timing::kRealTime && (options.link_delay > Stamp{0} || options.link_jitter > Stamp{0} ||
                                              options.link_loss > 0 || options.link_outage > Stamp{0}))
    return Error{"a link's delay, jitter, loss and outage are only simulated in lockstep, expected none in real time",
                 ErrorCode::kInvalid, "timing"};
  if (!(options.state_rate_hz >= 10 && options.state_rate_hz <= 1000))
    return Error::invalid("state_rate_hz", text(options.state_rate_hz) + " Hz", "10 to 1000 Hz");
  return check_firmware(options);
}

sdk::Options session_options(const config::Scenario& scenario, protocol::Timing timing) {
  sdk::Options options;
  options.timing = timing;
  options.seed = config::planner_seed_of(scenario);
  options.quadrotor = scenario.vehicle.quadrotor;
  options.actuation = scenario.vehicle.actuation;
  options.camera = scenario.vehicle.camera;
  options.course = scenario.track.course;
  return options;
}

QuadrotorState start_state(const config::Scenario& scenario) {
  QuadrotorState state;
  state.p_WB = scenario.track.start_p_WB;
  state.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(scenario.track.start_yaw_rad, Eigen::Vector3d::UnitZ()));
  state.thrust_n = state.thrust_command_n =
      hover_thrust_n(config::true_quadrotor(scenario.vehicle.quadrotor, scenario.mismatch));
  return state;
}

Result<Report> fly(const config::Scenario& scenario, const Options& options, sdk::Client* client,
                   const std::atomic<bool>& stop, const ProgressFunction& on_progress,
                   const ProblemFunction& on_problem, const SessionFunction& on_session) {
  if (auto status = validate(options); !status) return status.failure();
  const auto opened = open_firmware(options, scenario);
  if (!opened) return opened.failure();
  FlightControllerInLoop* const firmware = opened->get();
  const scene::World world = config::true_world(scenario);
  const QuadrotorModel model = config::true_quadrotor(scenario.vehicle.quadrotor, scenario.mismatch);
  auto plant = Plant::create(world, model, scenario.mismatch.wind_W_m_s,
                             Aerodynamics::create(scenario.hard.air, model, world, scenario.seed));
  if (!plant) return plant.failure();
  auto drive = firmware ? Result<Drive>(Drive::through(firmware, scenario)) : Drive::create(scenario);
  if (!drive) return drive.failure();

  JudgedVehicle vehicle(scenario, world, std::move(plant).value(), std::move(drive).value());
  Shutter shutter(scenario.hard.camera, from_seconds(1.0 / scenario.vehicle.camera.rate_hz), scenario.seed);
  DepthSensor sensor(world, scenario);
  Estimator estimator(scenario.state_noise, scenario.hard.estimate, scenario.seed);
  SnapshotKeeper snapshots(config::gates_by_waypoint(world, scenario.track.course), sensor.camera());
  ServerNews news(client, on_problem, on_session);
  const RaceParts race{scenario, options, *client,   stop,      on_progress, vehicle,
                       shutter,  sensor,  estimator, snapshots, news,        firmware};
  Report report;
  report.timing = options.timing;
  report.control_period_s = seconds(std::max(Plant::kStep, from_seconds(client->session().control_period_s)));
  const Stamp begin = MonotonicClock().now();
  if (options.timing == Timing::kLockstep) {
    run_lockstep(race, &report);
  } else {
    run_real_time(race, &report);
  }
  if (firmware != nullptr && !firmware->ready() && !firmware->well()) return firmware->failure();
  news.listen(seconds(vehicle.race_time()));
  report.wall_s = seconds(MonotonicClock().now() - begin);
  vehicle.fill(&report);
  if (firmware != nullptr) report.firmware = firmware->name();
  if (report.outcome == Outcome::kFlightControllerLost) report.sentence += "; " + firmware->failure().message;
  report.link = client->statistics();
  report.snapshot = snapshots.take();
  report.problems = news.problems();
  report.sessions = news.sessions();
  if (const auto telemetry = client->telemetry()) report.identified = telemetry->identified;
  return report;
}

}  // namespace gatefield::simulator
