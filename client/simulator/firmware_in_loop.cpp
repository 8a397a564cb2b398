#include "client/simulator/firmware_in_loop.h"

#include <algorithm>
#include <cmath>
#include <thread>
#include <tuple>
#include <utility>

#include "client/simulator/plant.h"
#include "common/base/text.h"

namespace gatefield::simulator {
namespace {

using namespace std::chrono_literals;
namespace sitl = firmware::betaflight_sitl;
using flight::Wanted;

const MonotonicClock kClock;

constexpr auto kSettle = 300ms;        // of channels with the switch off, before it is thrown
constexpr auto kArmPatience = 1s;      // of a thrown switch; then off and on again
constexpr auto kSpinUp = 100ms;        // from armed to motors that hover
constexpr auto kDisarm = 300ms;        // of channels with the switch off, after the race
constexpr auto kStatusLimit = 1500ms;  // it is asked for many times in this
constexpr auto kChannelsPeriod = 2ms;  // over UDP; MSP, 100 times a second
constexpr auto kAskPatience = 10s;     // a firmware on a busy machine may be late with its first answers
constexpr double kIdle = 0.05;  // of a motor's output, about as the firmware comes; the rest is learned in flight

/// The first guess of the throttle that hovers, T = T_max o^2, o = idle + (1 - idle) throttle.
flight::ThrustOptions thrust_options(const QuadrotorModel& model) {
  flight::ThrustOptions thrust;
  const double output = std::sqrt(hover_thrust_n(model)[0] / model.thrust_max_n);
  thrust.hover_throttle = std::clamp((output - kIdle) / (1.0 - kIdle), 0.03, 0.9);
  thrust.exponent = 2.0;
  return thrust;
}

Result<std::unique_ptr<bridge::betaflight::BetaflightVehicle>> open_patiently(
    const bridge::betaflight::Options& options, const QuadrotorModel& model) {
  for (const Stamp end = kClock.now() + kAskPatience;;) {
    auto vehicle = bridge::betaflight::open(options, model, kClock);
    if (vehicle || vehicle.failure().field != "link" || kClock.now() > end) return vehicle;
  }
}

sitl::Wire wire_of(const firmware::msp::FirmwareVersion& version) {
  return version.major == 2026 ? sitl::Wire::kSince2026 : sitl::Wire::kUntil2025;
}

}  // namespace

Status validate(const FirmwareOptions& options) {
  const auto address = firmware::parse_address(options.address);
  if (!address) return address.failure().within("firmware address: ");
  if (address->kind == firmware::Address::Kind::kSerial)
    return Error::invalid("address", "'" + options.address + "'",
                          "tcp:HOST:PORT of its target SITL: Betaflight on a board takes no simulated sensors; a board "
                          "with PX4 does");
  if (address->kind != firmware::Address::Kind::kTcp)
    return Error::invalid("address", "'" + options.address + "'", "tcp:HOST:PORT, where the firmware serves MSP");
  for (const auto& [field, value, least, most] :
       {std::tuple("arm_limit", options.arm_limit, Stamp(1s), Stamp(60s)),
        std::tuple("silence_limit", options.silence_limit, Stamp(20ms), Stamp(5s)),
        std::tuple("answer_limit", options.answer_limit, Stamp(100ms), Stamp(60s))})
    if (value < least || value > most)
      return Error::invalid(field, text(seconds(value)) + " s",
                            text(seconds(least)) + " to " + text(seconds(most)) + " s");
  for (const auto& [field, value, most] : {std::tuple("gyro.noise_rad_s", options.gyro.noise_rad_s, 1.0),
                                           std::tuple("gyro.bias_rad_s", options.gyro.bias_rad_s, 0.5)})
    if (!(value >= 0 && value <= most))
      return Error::invalid(field, text(value) + " rad/s", "0 to " + text(most) + " rad/s");
  return {};
}

Result<std::unique_ptr<FirmwareInLoop>> FirmwareInLoop::open(const FirmwareOptions& options,
                                                             const config::Scenario& scenario,
                                                             protocol::Timing timing) {
  if (auto status = validate(options); !status) return status.failure();
  if (auto status = check_firmware_scenario(scenario); !status) return status.failure();
  const QuadrotorModel& told = scenario.vehicle.quadrotor;
  bridge::betaflight::Options bridge;
  bridge.link = *firmware::parse_address(options.address);
  bridge.thrust = thrust_options(told);
  bridge.receiver = bridge::betaflight::Options::Receiver::kUdp;
  auto vehicle = open_patiently(bridge, told);
  if (!vehicle) return vehicle.failure();
  const auto& settings = vehicle.value()->settings();
  const auto found = places(told, settings.mixer.yaw_reversed);
  if (!found) return found.failure();
  auto exchange = Exchange::open(
      {bridge.link.place, options.state_port, options.motors_port, options.channels_port, wire_of(settings.version)},
      kClock);
  if (!exchange) return exchange.failure();
  return std::unique_ptr<FirmwareInLoop>(new FirmwareInLoop(options, timing, told, *found, scenario.seed,
                                                            std::move(vehicle).value(), std::move(exchange).value()));
}

FirmwareInLoop::FirmwareInLoop(const FirmwareOptions& options, protocol::Timing timing, const QuadrotorModel& model,
                               const Places& places, std::uint64_t seed, std::unique_ptr<Vehicle> vehicle,
                               std::unique_ptr<Exchange> exchange)
    : options_(options),
      timing_(timing),
      model_(model),
      places_(places),
      vehicle_(std::move(vehicle)),
      exchange_(std::move(exchange)),
      name_(vehicle_->description().front()),
      hover_(hover_setpoint(model)),
      random_(seed, Stream("gatefield.firmware.gyro")),
      gyro_bias_rad_s_(drawn(options.gyro.bias_rad_s)) {
  if (bridge::betaflight::hears_udp(vehicle_->settings().version)) vehicle_->send_through(this, kChannelsPeriod);
}

FirmwareInLoop::~FirmwareInLoop() {
  if (phase_ == Phase::kStanding || !answers_) return;
  for (const Stamp end = now() + kDisarm; now() < end && answers_;) {
    hear();
    if (due(now())) {
      vehicle_->want(now(), Wanted::kDisarmed);
      vehicle_->hold(now());
    }
    tell(last_, Eigen::Vector3d::Zero());
    if (!lockstep()) std::this_thread::sleep_for(Plant::kStep);
  }
}

/// Motors lie rear right, front right, rear left, front left. Seen from above the rear right one turns clockwise unless
/// reversed, and pushes the body the other way, about +z; its neighbours turn against it.
Result<FirmwareInLoop::Places> FirmwareInLoop::places(const QuadrotorModel& model, bool yaw_reversed) {
  constexpr std::array kSpin{1, -1, -1, 1};
  const auto found = corners(model);
  if (!found) return found.failure();
  Places places{};
  for (std::size_t rotor = 0; rotor < places.size(); ++rotor) {
    places[rotor] = (*found)[rotor];
    if (model.rotor_spin[rotor] != (yaw_reversed ? -1 : 1) * kSpin[places[rotor]])
      return Error("the firmware's yaw_motors_reversed is " + std::string(yaw_reversed ? "ON" : "OFF") +
                       ", but the vehicle's rotors turn the other way; set yaw_motors_reversed = " +
                       (yaw_reversed ? "OFF" : "ON") + " in its command line, or turn torque_sign in the vehicle file",
                   ErrorCode::kInvalid, "yaw_motors_reversed");
  }
  return places;
}

bool FirmwareInLoop::send(const bridge::betaflight::Channels::Pulses& pulses) noexcept {
  sitl::Channels channels{};
  static_assert(std::tuple_size_v<sitl::Channels> <= std::tuple_size_v<bridge::betaflight::Channels::Pulses>);
  std::copy_n(pulses.begin(), channels.size(), channels.begin());
  return exchange_->send(channels);
}

Stamp FirmwareInLoop::now() const noexcept { return lockstep() ? time_ : kClock.now(); }

Eigen::Vector3d FirmwareInLoop::drawn(double deviation) noexcept {
  if (deviation == 0.0) return Eigen::Vector3d::Zero();
  const double x = random_.normal(), y = random_.normal(), z = random_.normal();
  return deviation * Eigen::Vector3d(x, y, z);
}

/// Lockstep: the motors at the end of the last step. Real time: those that came, in tell().
void FirmwareInLoop::hear() noexcept {
  if (!lockstep() || time_ == Stamp{0}) return;
  const auto motors = exchange_->end_step(options_.answer_limit);
  if (motors) motors_ = *motors;
  answers_ = motors.has_value();
}

void FirmwareInLoop::tell(const QuadrotorState& state, const Eigen::Vector3d& acceleration_W) noexcept {
  sitl::State sensed;
  sensed.body_rates_rad_s = state.w_WB_B + gyro_bias_rad_s_ + drawn(options_.gyro.noise_rad_s);
  sensed.q_WB = state.q_WB;
  sensed.specific_force_m_s2 = specific_force_B(state, acceleration_W);
  last_ = state;
  if (lockstep()) {
    exchange_->begin_step(sensed, Plant::kStep);
    time_ += Plant::kStep;
  } else if (const auto motors = exchange_->exchange(sensed)) {
    motors_ = *motors;
  }
}

bool FirmwareInLoop::due(Stamp now) noexcept {
  if (now < next_command_) return false;
  next_command_ = std::max(next_command_ + vehicle_->period(), now);  // who was late owes nothing
  return true;
}

void FirmwareInLoop::stand(const QuadrotorState& held) noexcept {
  const Stamp now = this->now();
  if (!std::exchange(begun_, true)) begin_ = phase_since_ = next_command_ = now;
  QuadrotorState still = held;
  still.w_WB_B.setZero();
  hear();
  if (due(now)) arm(now);
  tell(still, Eigen::Vector3d::Zero());
  if (!answers_) {
    trouble_ = Trouble::kSilent;
  } else if (ready()) {
    watch(now);
  } else if (now - begin_ > options_.arm_limit) {
    trouble_ = Trouble::kNotArmed;
  }
}

void FirmwareInLoop::arm(Stamp now) noexcept {
  const auto status = vehicle_->newest(now);
  const bool armed = status && status->armed;
  const Stamp spent = now - phase_since_;
  switch (phase_) {
    case Phase::kStanding:
      if (spent > kSettle && exchange_->received() > 0 && !armed && vehicle_->complaints().empty())
        enter(Phase::kArming, now);
      break;
    case Phase::kArming:
      if (armed) {
        enter(Phase::kSpinningUp, now);
      } else if (spent > kArmPatience) {
        enter(Phase::kStanding, now);
      }
      break;
    case Phase::kSpinningUp:
      if (spent > kSpinUp) enter(Phase::kReady, now);
      break;
    case Phase::kReady:
      break;
  }
  vehicle_->want(now, phase_ == Phase::kStanding ? Wanted::kDisarmed : Wanted::kArmed);
  if (phase_ >= Phase::kSpinningUp) {
    vehicle_->apply(now, hover_);
  } else {
    vehicle_->hold(now);
  }
}

void FirmwareInLoop::enter(Phase phase, Stamp now) noexcept {
  phase_ = phase;
  phase_since_ = now;
}

PlainVector4 FirmwareInLoop::step(const sdk::Setpoint& setpoint, const QuadrotorState& truth) noexcept {
  const Stamp now = this->now();
  if (!std::exchange(flying_, true)) {
    vehicle_->thrust().begin();
    last_ = truth;
  }
  const Eigen::Vector3d acceleration_W = (truth.v_WB - last_.v_WB) / seconds(Plant::kStep);
  hear();
  if (due(now)) {
    vehicle_->want(now, Wanted::kArmed);
    vehicle_->thrust().on_state(now, truth, specific_force_B(truth, acceleration_W).z());
    vehicle_->apply(now, setpoint);
  }
  tell(truth, acceleration_W);
  watch(now);
  PlainVector4 thrust_n;
  for (std::size_t rotor = 0; rotor < places_.size(); ++rotor) {
    const double output = motors_[places_[rotor]];
    thrust_n[static_cast<Eigen::Index>(rotor)] = model_.thrust_max_n * output * output;
  }
  return thrust_n;
}

void FirmwareInLoop::watch(Stamp now) noexcept {
  if (!well()) return;
  const auto status = vehicle_->newest(now);
  if (status && std::exchange(status_stamp_, status->stamp) != status->stamp) status_heard_ = kClock.now();
  if (lockstep() ? !answers_ : exchange_->silent_for() > options_.silence_limit) {
    trouble_ = Trouble::kSilent;
  } else if (!status || (now - status->stamp > kStatusLimit && kClock.now() - status_heard_ > kStatusLimit)) {
    trouble_ = Trouble::kNoStatus;
  } else if (!status->armed) {
    trouble_ = Trouble::kDisarmed;
  }
}

Error FirmwareInLoop::failure() const {
  const auto told = [this](const std::string& what) { return firmware_lost(name_, what, vehicle_->complaints()); };
  switch (trouble_) {
    case Trouble::kNone:
      break;
    case Trouble::kNotArmed:
      if (exchange_->received() == 0) return exchange_->silence();
      return told("it did not arm within " + text(seconds(options_.arm_limit)) + " s");
    case Trouble::kSilent:
      return exchange_->silence();
    case Trouble::kNoStatus:
      return told("it tells no status any more");
    case Trouble::kDisarmed:
      return told(
          "it disarmed in mid-race; look at its failsafe, and at runaway_takeoff_prevention (OFF in a simulator)");
  }
  return told("nothing is wrong");
}

}  // namespace gatefield::simulator
