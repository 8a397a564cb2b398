#include "client/bridge/config/config.h"

#include <chrono>
#include <cstdint>
#include <utility>

#include "client/bridge/config/bridge.pb.h"
#include "client/bridge/config/fields.h"
#include "client/firmware/link/link.h"
#include "common/base/text.h"
#include "common/config/course.h"
#include "common/config/locate.h"
#include "common/config/text_file.h"
#include "common/config/vehicle.h"
#include "common/protocol/validate.h"

namespace gatefield::bridge {
namespace {

Eigen::Vector3d vector(const Point& point) { return {point.x(), point.y(), point.z()}; }

/// One of the file's sections failed.
Status in(const std::string& section, const Status& status) {
  return status ? Status() : Status(status.failure().within(section + ".", section + "."));
}

Status take(const NetworkSpec& spec, dds::NetworkOptions* network) {
  network->peers.assign(spec.peers().begin(), spec.peers().end());
  network->interfaces.assign(spec.interfaces().begin(), spec.interfaces().end());
  network->discovery_servers.assign(spec.discovery_servers().begin(), spec.discovery_servers().end());
  network->shared_memory = spec.shared_memory();
  network->security = spec.security();
  return dds::validate(*network);
}

Status take(const SessionSpec& spec, BridgeConfig* config) {
  sdk::Options& session = config->session;
  Stamp timeout = session.connect_timeout;
  if (Status status = take_fields(spec, {{"domain", &session.domain},
                                         {"name", &session.vehicle},
                                         {"server", &session.server},
                                         {"profile", &session.profile},
                                         {"speed_limit_m_s", &session.speed_limit_m_s},
                                         {"connect_timeout", &timeout},
                                         {"state_rate_hz", &config->loop.state_rate_hz},
                                         {"priority", &session.priority}});
      !status)
    return status;
  if (session.priority > protocol::kMaxPriority)
    return Error::invalid("priority", text(session.priority), "0 to " + text(protocol::kMaxPriority));
  constexpr std::uint32_t kLastDomain = 232;
  if (session.domain > kLastDomain) return Error::invalid("domain", text(session.domain), "0 to " + text(kLastDomain));
  if (Status status = protocol::validate_name("name", session.vehicle); !status) return status;
  if (spec.has_speed_limit_m_s() && !(session.speed_limit_m_s >= 0.5 && session.speed_limit_m_s <= 50))
    return Error::invalid("speed_limit_m_s", text(session.speed_limit_m_s) + " m/s", "0.5 to 50 m/s");
  if (!(seconds(timeout) >= 0.1 && seconds(timeout) <= 600))
    return Error::invalid("connect_timeout", text(seconds(timeout)) + " s", "0.1 to 600 s");
  session.connect_timeout = std::chrono::duration_cast<std::chrono::milliseconds>(timeout);
  if (Status status = in("network", take(spec.network(), &session.network)); !status) return status;
  return flight::validate(config->loop);
}

Status take(const SafetySpec& spec, flight::SupervisorOptions* options) {
  if (spec.arm_by() == SafetySpec::ITSELF) options->arm_by = flight::ArmBy::kItself;
  if (Status status = take_fields(spec, {{"needs_pilot", &options->needs_pilot},
                                         {"needs_field", &options->needs_field},
                                         {"needs_depth", &options->needs_depth},
                                         {"needs_firmware_failsafe", &options->needs_firmware_failsafe},
                                         {"state_settles", &options->state_settles},
                                         {"state_doubted", &options->state_doubted},
                                         {"round_trip_max", &options->round_trip_max},
                                         {"controller_silent", &options->controller_silent},
                                         {"pilot_silent", &options->pilot_silent},
                                         {"fence_ahead", &options->fence_ahead},
                                         {"battery_arm_v", &options->battery_arm_v},
                                         {"battery_land_v", &options->battery_land_v},
                                         {"battery_low", &options->battery_low},
                                         {"take_off_height_m", &options->take_off_height_m},
                                         {"take_off_speed_m_s", &options->take_off_speed_m_s},
                                         {"take_off_limit", &options->take_off_limit},
                                         {"outage_short", &options->outage_short},
                                         {"plan_settles", &options->plan_settles},
                                         {"hand_over", &options->hand_over},
                                         {"stopped_m_s", &options->stopped_m_s},
                                         {"brake_limit", &options->brake_limit},
                                         {"hold_limit", &options->hold_limit},
                                         {"descent_m_s", &options->descent_m_s},
                                         {"descent_limit", &options->descent_limit},
                                         {"level_thrust", &options->level_thrust},
                                         {"level_limit", &options->level_limit},
                                         {"arming_limit", &options->arming_limit},
                                         {"disarm_limit", &options->disarm_limit},
                                         {"give_back", &options->give_back},
                                         {"gate_margin_m", &options->gate_margin_m},
                                         {"tilt_apart_rad", &options->tilt_apart_rad}});
      !status)
    return status;
  if (Status status = in("state", take_fields(spec.state(), {{"lost_after", &options->state.lost_after},
                                                             {"jump_m", &options->state.jump_m},
                                                             {"jump_rad", &options->state.jump_rad}}));
      !status)
    return status;
  if (spec.has_fence()) options->fence = flight::Fence{vector(spec.fence().low()), vector(spec.fence().high())};
  return flight::validate(*options);
}

Status take(const ThrustSpec& spec, flight::ThrustOptions* options) {
  if (Status status = take_fields(spec, {{"hover_throttle", &options->hover_throttle},
                                         {"exponent", &options->exponent},
                                         {"reference_v", &options->reference_v},
                                         {"throttle_min", &options->throttle_min},
                                         {"throttle_max", &options->throttle_max},
                                         {"lag_s", &options->lag_s},
                                         {"trusted_factor", &options->trusted_factor}});
      !status)
    return status;
  return flight::validate(*options);
}

Status take(const RadioSpec& spec, RadioSwitches* radio) {
  return take_fields(spec, {{"arm", &radio->arm},
                            {"take_over", &radio->take_over},
                            {"kill", &radio->kill},
                            {"threshold_us", &radio->threshold_us}});
}

Status take(const MavlinkSpec& spec, MavlinkConfig* config) {
  if (spec.dialect() == MavlinkSpec::ARDUPILOT) config->dialect = Dialect::kArduPilot;
  if (spec.dialect() == MavlinkSpec::PLAIN) config->dialect = Dialect::kPlain;
  if (spec.stamps() == MavlinkSpec::ARRIVAL) config->stamps = Stamps::kArrival;
  if (Status status = take_fields(spec, {{"link", &config->link},
                                         {"own_system", &config->own_system},
                                         {"own_component", &config->own_component},
                                         {"vehicle_system", &config->vehicle_system},
                                         {"setpoint_rate_hz", &config->setpoint_rate_hz},
                                         {"state_rate_hz", &config->state_rate_hz},
                                         {"link_delay", &config->link_delay},
                                         {"arm_by_command", &config->arm_by_command},
                                         {"may_set_parameters", &config->may_set_parameters},
                                         {"connect_timeout", &config->connect_timeout}});
      !status)
    return status;
  TimeSyncOptions& clock = config->time_sync;
  if (Status status = in("time_sync", take_fields(spec.time_sync(), {{"ask_every", &clock.ask_every},
                                                                     {"longest_round_trip", &clock.longest_round_trip},
                                                                     {"most_drift_ppm", &clock.most_drift_ppm}}));
      !status)
    return status;
  OdometerOptions& state = config->state;
  if (spec.state().from() == OdometrySpec::ODOMETRY) state.from = StateFrom::kOdometry;
  if (spec.state().from() == OdometrySpec::LOCAL_POSITION) state.from = StateFrom::kLocalPosition;
  if (spec.state().has_p_wl()) state.frame.p_WL = vector(spec.state().p_wl());
  if (Status status =
          in("state", take_fields(spec.state(), {{"yaw_WL_rad", &state.frame.yaw_WL_rad}, {"oldest", &state.oldest}}));
      !status)
    return status;
  if (Status status = in("radio", take(spec.radio(), &config->radio)); !status) return status;
  return validate(*config);
}

Status take(const BetaflightSpec& spec, betaflight::Options* options) {
  std::string link;
  if (spec.receiver() == BetaflightSpec::OVERRIDE) options->receiver = betaflight::Options::Receiver::kOverride;
  if (Status status = take_fields(spec, {{"link", &link},
                                         {"channels_hz", &options->channels_hz},
                                         {"arm_aux", &options->arm_aux},
                                         {"arm_us", &options->arm_us},
                                         {"yaw_reversed", &options->yaw_reversed}});
      !status)
    return status;
  auto address = firmware::parse_address(link);
  if (!address) return address.failure().within("link: ", "link.");
  options->link = std::move(address).value();
  if (spec.has_kill()) {
    betaflight::Switch& kill = options->kill.emplace();
    if (Status status = in(
            "kill", take_fields(spec.kill(), {{"aux", &kill.aux}, {"from_us", &kill.from_us}, {"to_us", &kill.to_us}}));
        !status)
      return status;
  }
  return betaflight::validate(*options);
}

Status take(const TimeSpec& spec, sources::TimeOptions* options) {
  if (spec.from() == TimeSpec::ARRIVAL) options->from = sources::TimeOptions::From::kArrival;
  return take_fields(spec, {{"delay", &options->delay}, {"oldest", &options->oldest}});
}

Status take(const OutsideStatesSpec& spec, sources::StateOptions* options) {
  if (Status status = take_fields(spec, {{"odometry", &options->odometry},
                                         {"pose", &options->pose},
                                         {"frame_id", &options->frame_id},
                                         {"yaw_WO_rad", &options->yaw_WO_rad},
                                         {"velocity_window", &options->velocity_window}});
      !status)
    return status;
  if (spec.has_p_wo()) options->p_WO = vector(spec.p_wo());
  if (spec.has_p_mb()) options->p_MB = vector(spec.p_mb());
  if (spec.has_rpy_mb_rad()) options->rpy_MB_rad = vector(spec.rpy_mb_rad());
  if (Status status = in("time", take(spec.time(), &options->time)); !status) return status;
  return sources::validate(*options);
}

Status take(const OutsideDepthSpec& spec, sources::DepthOptions* options) {
  options->image = spec.image();
  if (Status status = in("time", take(spec.time(), &options->time)); !status) return status;
  return sources::validate(*options);
}

Status take_sources(const BridgeFile& file, sources::Options* options) {
  if (file.has_states())
    if (Status status = in("states", take(file.states(), &options->states.emplace())); !status) return status;
  if (file.has_depth()) return in("depth", take(file.depth(), &options->depth.emplace()));
  return {};
}

Status take(const Px4Spec& spec, Px4Config* config) {
  std::string release;
  int own_component = config->own_component;
  if (spec.stamps() == MavlinkSpec::ARRIVAL) config->stamps = Stamps::kArrival;
  if (spec.radio_from() == Px4Spec::MANUAL_CONTROL) config->radio_from = RadioFrom::kManualControl;
  if (Status status = take_fields(spec, {{"release", &release},
                                         {"domain", &config->bus.domain},
                                         {"namespace", &config->bus.name_space},
                                         {"own_system", &config->own_system},
                                         {"own_component", &own_component},
                                         {"vehicle_system", &config->vehicle_system},
                                         {"setpoint_rate_hz", &config->setpoint_rate_hz},
                                         {"link_delay", &config->link_delay},
                                         {"arm_by_command", &config->arm_by_command},
                                         {"connect_timeout", &config->connect_timeout}});
      !status)
    return status;
  const auto known = px4::release_names().find(release);
  if (known == px4::release_names().end()) {
    std::string names;
    for (const auto& [name, number] : px4::release_names()) names += (names.empty() ? "" : ", ") + name;
    return Error::invalid("release", "'" + shown(release, 20) + "'", "one of " + names, ErrorCode::kUnknownName);
  }
  config->bus.release = known->second;
  for (const TopicVersion& one : spec.versions()) config->bus.versions[one.topic()] = one.version();
  if (own_component < 1 || own_component > UINT16_MAX)
    return Error::invalid("own_component", text(own_component), "1 to 65535");
  config->own_component = static_cast<std::uint16_t>(own_component);
  if (Status status = in("clock", take_fields(spec.clock(), {{"most_error", &config->clock.most_error}})); !status)
    return status;
  OdometerOptions& state = config->state;
  if (spec.state().has_p_wl()) state.frame.p_WL = vector(spec.state().p_wl());
  if (Status status =
          in("state", take_fields(spec.state(), {{"yaw_WL_rad", &state.frame.yaw_WL_rad}, {"oldest", &state.oldest}}));
      !status)
    return status;
  if (Status status = in("radio", take(spec.radio(), &config->radio)); !status) return status;
  if (Status status = in("network", take(spec.network(), &config->bus.network)); !status) return status;
  if (!config->bus.network.security.empty())
    return Error::invalid("network.security", "\"" + config->bus.network.security + "\"",
                          "none: PX4's topics are open to all in its domain");
  return validate(*config);
}

/// Somebody has to be able to arm, and in one way only.
/// @param section  of the file   @param arm_channel  of the person's arm switch; 0: none
Status check_arming(const flight::SupervisorOptions& safety, const std::string& section, int arm_channel,
                    bool arm_by_command) {
  const bool by_switch = safety.arm_by == flight::ArmBy::kSwitch;
  if (by_switch && arm_channel == 0)
    return Error::invalid(section + ".radio.arm", "0",
                          "the channel of the person's arm switch; in simulators safety.arm_by: ITSELF");
  if (!by_switch && !arm_by_command)
    return Error::invalid(section + ".arm_by_command", "false", "true where safety.arm_by is ITSELF");
  return {};
}

/// A bridge that is the receiver itself has no person's switch to wait for.
Status check_arming(const flight::SupervisorOptions& safety, const betaflight::Options& betaflight) {
  if (betaflight.receiver == betaflight::Options::Receiver::kOverride) return {};
  if (safety.arm_by == flight::ArmBy::kSwitch)
    return Error::invalid("safety.arm_by", "SWITCH",
                          "a person's radio (betaflight.receiver: OVERRIDE), or safety.arm_by: ITSELF in simulators");
  if (safety.needs_pilot)
    return Error::invalid("safety.needs_pilot", "true",
                          "false where the bridge is the receiver: no person's radio is heard");
  return {};
}

/// PX4 does not tell its parameters over DDS, so nobody but a person can say that its failsafe is good.
Status check_failsafe(const flight::SupervisorOptions& safety) {
  if (!safety.needs_firmware_failsafe) return {};
  return Error::invalid("safety.needs_firmware_failsafe", "true",
                        "false: PX4's parameters can't be read over DDS. Look that COM_OF_LOSS_T is at most 2 s and "
                        "COM_OBL_RC_ACT not 5, and say so by setting this to false");
}

Status take_firmware(const BridgeFile& file, Firmware firmware, bool flies, BridgeConfig* config) {
  flight::ThrustOptions thrust;
  if (Status status = in("thrust", take(file.thrust(), &thrust)); !status) return status;
  const auto missing = [](const std::string& section, const std::string& content = "link: \"...\"") {
    return Error::invalid(section, "missing", "a section " + section + " { " + content + " }");
  };
  if (firmware == Firmware::kBetaflight) {
    if (!file.has_betaflight()) return missing("betaflight");
    auto& options = config->firmware.emplace<betaflight::Options>();
    options.thrust = thrust;
    if (Status status = in("betaflight", take(file.betaflight(), &options)); !status || !flies) return status;
    if (!file.has_states())
      return Error::invalid("states", "missing",
                            "a section states { odometry: \"/...\" } or { pose: \"/...\" }: Betaflight knows no "
                            "position, so somebody else has to (motion capture, VIO)");
    return check_arming(config->safety, options);
  }
  if (firmware == Firmware::kPx4) {
    if (!file.has_px4()) return missing("px4", "release: \"1.16\"");
    auto& px4 = config->firmware.emplace<Px4Config>();
    px4.thrust = thrust;
    px4.quadrotor = config->session.quadrotor;
    if (Status status = in("px4", take(file.px4(), &px4)); !status) return status;
    if (Status status = check_failsafe(config->safety); !status) return status;
    return check_arming(config->safety, "px4", px4.radio.arm, px4.arm_by_command);
  }
  if (!file.has_mavlink()) return missing("mavlink");
  auto& mavlink = config->firmware.emplace<MavlinkConfig>();
  mavlink.thrust = thrust;
  mavlink.quadrotor = config->session.quadrotor;
  if (Status status = in("mavlink", take(file.mavlink(), &mavlink)); !status) return status;
  return check_arming(config->safety, "mavlink", mavlink.radio.arm, mavlink.arm_by_command);
}

Status take_vehicle_and_course(const BridgeFile& file, const std::filesystem::path& folder, BridgeConfig* config) {
  const auto vehicle_file = config::find_config("vehicles", file.vehicle(), folder);
  if (!vehicle_file) return vehicle_file.failure();
  auto vehicle = config::load_vehicle(*vehicle_file);
  if (!vehicle) return vehicle.failure();
  const auto course_file = config::find_config("courses", file.course(), folder);
  if (!course_file) return course_file.failure();
  auto track = config::load_track(*course_file);
  if (!track) return track.failure();
  config->session.quadrotor = vehicle->quadrotor;
  config->session.camera = vehicle->camera;
  config->session.actuation = config::driven_by(*vehicle, Actuation::Kind::kBodyRates);
  config->session.course = track->course;
  config->notes = vehicle->notes;
  return {};
}

}  // namespace

const std::map<std::string, Firmware>& firmware_names() {
  static const std::map<std::string, Firmware> names{
      {"betaflight", Firmware::kBetaflight}, {"mavlink", Firmware::kMavlink}, {"px4", Firmware::kPx4}};
  return names;
}

Result<BridgeConfig> load_config(const std::filesystem::path& file, Firmware firmware, bool flies) {
  BridgeFile spec;
  if (Status status = config::load_text(file, &spec); !status) return status.failure();
  BridgeConfig config;
  if (Status status = take_vehicle_and_course(spec, file.parent_path(), &config); !status) return status.failure();
  for (const Status& status :
       {in("session", take(spec.session(), &config)), in("safety", take(spec.safety(), &config.safety)),
        take_sources(spec, &config.sources), take_firmware(spec, firmware, flies, &config)})
    if (!status) return config::in_file(file, status.failure());
  return config;
}

}  // namespace gatefield::bridge
