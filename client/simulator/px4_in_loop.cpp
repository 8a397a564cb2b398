#include "client/simulator/px4_in_loop.h"

#include <algorithm>
#include <cmath>
#include <thread>
#include <tuple>
#include <utility>

#include "client/bridge/mavlink/vehicle.h"
#include "client/bridge/px4/vehicle.h"
#include "client/simulator/plant.h"
#include "client/simulator/simulation.h"
#include "common/base/text.h"

namespace gatefield::simulator {
namespace {

using namespace std::chrono_literals;
using flight::Wanted;

const MonotonicClock kWall;

constexpr Stamp kSettle = 500ms;        // of quiet setpoints before it is asked to arm, and between two tries
constexpr Stamp kArmPatience = 3s;      // then it is asked anew
constexpr Stamp kHovers = 200ms;        // of motors that hold the weight
constexpr Stamp kTurn = 120ms;          // of a turn that is asked for while the vehicle is held
constexpr Stamp kStatusLimit = 2500ms;  // of PX4's word, which comes every second
constexpr Stamp kStop = 300ms;          // of asking for stopped motors, after the race
constexpr Stamp kSlip = 100ms;          // a machine later than this is not made up for
constexpr Stamp kConnect = 30s;         // until the bridge hears it
constexpr Stamp kLook = 200us;          // how often somebody looks who waits for the simulation's time
constexpr double kTurn_rad_s = 0.4;
constexpr double kSetpoints_hz = 250.0;
constexpr const char* kAxisNames[] = {"x (roll)", "y (pitch)", "z (yaw)"};

/// The throttle that hovers, and how thrust goes with throttle there: PX4 makes the output o of a throttle u by
///   u = f o^2 + (1 - f) o
/// (its parameter reference, THR_MDL_FAC), and T = T_max o^2.
flight::ThrustOptions thrust_options(const QuadrotorModel& model, double factor) {
  flight::ThrustOptions thrust;
  const double output = std::sqrt(hover_thrust_n(model)[0] / model.thrust_max_n);
  const double throttle = factor * output * output + (1.0 - factor) * output;
  thrust.hover_throttle = std::clamp(throttle, 0.03, 0.9);
  thrust.exponent = std::clamp(2.0 * throttle / (output * (2.0 * factor * output + 1.0 - factor)), 1.0, 2.5);
  return thrust;
}

/// PX4's motors 1 to 4 are front right, rear left, front left, rear right.
Result<std::array<std::size_t, kRotors>> places(const QuadrotorModel& model) {
  const auto found = corners(model);
  if (!found) return found.failure();
  std::array<std::size_t, kRotors> places{};
  std::ranges::transform(*found, places.begin(), [](Corner corner) -> std::size_t {
    switch (corner) {
      case kFrontRight:
        return 0;
      case kRearLeft:
        return 1;
      case kFrontLeft:
        return 2;
      case kRearRight:
        break;
    }
    return 3;
  });
  return places;
}

firmware::SensorOptions seeded(firmware::SensorOptions sensors, std::uint64_t seed) {
  sensors.seed = seed;
  return sensors;
}

/// The simulation's clock for somebody who wants one of his own.
class View final : public flight::LoopClock {
 public:
  explicit View(SteppedClock* clock) : clock_(*clock) {}
  Stamp now() const noexcept override { return clock_.now(); }
  Stamp sleep_until(Stamp deadline) noexcept override { return clock_.sleep_until(deadline); }

 private:
  SteppedClock& clock_;
};

Status check(const px4::BusOptions& bus) { return px4::validate(bus); }

Status check(const std::string& link) {
  const auto address = firmware::parse_address(link);
  return address ? Status() : Status(address.failure().within("", "setpoints."));
}

}  // namespace

Status validate(const Px4Options& options) {
  if (Status status = firmware::validate(options.hil); !status) return status.failure().within("PX4's sensors: ");
  if (!options.hil.lockstep)
    return Error::invalid("hil.lockstep", "false", "true: PX4's time is the simulation's here");
  if (Status status = firmware::validate(options.sensors); !status) return status.failure().within("PX4's sensors: ");
  if (Status status = std::visit([](const auto& way) { return check(way); }, options.setpoints); !status)
    return status.failure().within("PX4's setpoints: ");
  for (const auto& [field, value, least, most] :
       {std::tuple("thrust_model_factor", options.thrust_model_factor, 0.0, 1.0),
        std::tuple("pace", options.pace, 0.01, 20.0), std::tuple("arm_limit", seconds(options.arm_limit), 1.0, 300.0)})
    if (!(value >= least && value <= most))
      return Error::invalid(field, text(value), text(least) + " to " + text(most));
  return {};
}

Stamp SteppedClock::sleep_until(Stamp deadline) noexcept {
  for (Stamp time = now();; time = now()) {
    if (time >= deadline) return time;
    std::this_thread::sleep_for(kLook);
  }
}

Result<std::unique_ptr<Px4InLoop>> Px4InLoop::open(const Px4Options& options, const config::Scenario& scenario) {
  if (Status status = validate(options); !status) return status.failure();
  if (Status status = check_firmware_scenario(scenario); !status) return status.failure();
  const auto found = places(scenario.vehicle.quadrotor);
  if (!found) return found.failure();
  auto hil = firmware::HilLink::open(options.hil);
  if (!hil) return hil.failure();
  std::unique_ptr<Px4InLoop> loop(new Px4InLoop(options, scenario, *found, std::move(hil).value()));
  const QuadrotorState held = start_state(scenario);
  if (Status status = loop->boot(held); !status) return status.failure();
  if (Status status = loop->connect(held); !status) return status.failure();
  return loop;
}

Px4InLoop::Px4InLoop(const Px4Options& options, const config::Scenario& scenario, const Places& places,
                     std::unique_ptr<firmware::HilLink> hil)
    : options_(options),
      model_(scenario.vehicle.quadrotor),
      places_(places),
      hover_(hover_setpoint(model_)),
      hil_(std::move(hil)),
      sensors_(seeded(options.sensors, scenario.seed), firmware::Site{}) {}

Px4InLoop::~Px4InLoop() {
  if (phase_ == Phase::kStanding || trouble_ == Trouble::kLink) return;
  for (const Stamp end = clock_.now() + kStop; clock_.now() < end && trouble_ != Trouble::kLink;) {
    if (due(clock_.now())) {
      vehicle_->flight_controller().want(clock_.now(), Wanted::kKilled);
      vehicle_->actuator().hold(clock_.now());
    }
    advance(last_);
  }
}

/// Until its first motors it needs samples at the pace of the real world.
Status Px4InLoop::boot(const QuadrotorState& held) {
  while (!hil_->answered() && !broken_) advance(held);
  return broken_ ? Status(*broken_) : Status();
}

/// The bridge waits for answers, which need PX4's time to go on.
Status Px4InLoop::connect(const QuadrotorState& held) {
  std::jthread time([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (broken_) std::this_thread::sleep_for(Plant::kStep);  // who waits for answers has to come to the end of it
      advance(held);
    }
  });
  const Status joined = std::visit([this](const auto& way) { return join(way); }, options_.setpoints);
  time.request_stop();
  time.join();
  if (broken_) return *broken_;
  return joined ? Status() : Status(joined.failure().within("PX4's setpoints: "));
}

Status Px4InLoop::join(const px4::BusOptions& bus) {
  bridge::Px4Config config;
  config.bus = bus;
  config.arm_by_command = true;
  config.setpoint_rate_hz = kSetpoints_hz;
  config.stamps = bridge::Stamps::kArrival;
  config.thrust = thrust_options(model_, options_.thrust_model_factor);
  config.quadrotor = model_;
  config.connect_timeout = kConnect;
  auto vehicle = bridge::Px4Vehicle::open(config, nullptr, std::make_unique<View>(&clock_));
  if (!vehicle) return vehicle.failure();
  take(std::move(vehicle).value());
  return {};
}

Status Px4InLoop::join(const std::string& link) {
  bridge::MavlinkConfig config;
  config.link = link;
  config.arm_by_command = true;
  config.setpoint_rate_hz = kSetpoints_hz;
  config.thrust = thrust_options(model_, options_.thrust_model_factor);
  config.quadrotor = model_;
  config.connect_timeout = kConnect;
  auto opened = firmware::open(*firmware::parse_address(link), config.connect_timeout);
  if (!opened) return opened.failure();
  auto vehicle =
      std::make_unique<bridge::MavlinkVehicle>(config, std::move(opened).value(), std::make_unique<View>(&clock_));
  if (Status status = vehicle->connect(); !status) return status;
  take(std::move(vehicle));
  return {};
}

template <typename Concrete>
void Px4InLoop::take(std::unique_ptr<Concrete> vehicle) {
  thrust_ = &vehicle->thrust();
  name_ = vehicle->description().front();
  vehicle_ = std::move(vehicle);
}

/// A step of time, and of PX4 when its sample is due.
void Px4InLoop::advance(const QuadrotorState& state) noexcept {
  last_ = state;
  const Stamp now = clock_.now();
  if (now >= next_sample_ && !broken_) {
    next_sample_ += kSample;
    keep_pace();
    if (sampled_) {
      const Eigen::Vector3d acceleration_W = (state.v_WB - sampled_->v_WB) / seconds(now - sampled_->at);
      specific_force_B_ = simulator::specific_force_B(state, acceleration_W);
    }
    sampled_ = {now, state.v_WB};
    const firmware::Motion motion{state.p_WB, state.v_WB, state.q_WB, state.w_WB_B, specific_force_B_};
    const auto sample = sensors_.sample(now, motion);
    auto motors = hil_->exchange(sample, sensors_.satellites(now, motion), sensors_.truth(now, motion));
    if (motors) {
      motors_ = *motors;
    } else {
      broken_ = motors.failure();
      trouble_ = Trouble::kLink;
    }
  }
  clock_.advance(Plant::kStep);
}

void Px4InLoop::keep_pace() noexcept {
  const Stamp now = clock_.now(), wall = kWall.now();
  const Stamp due = paced_wall_ + from_seconds(seconds(now - paced_at_) / options_.pace);
  if (paced_wall_ == Stamp{0} || wall - due > kSlip) {
    paced_at_ = now;
    paced_wall_ = wall;
  } else if (wall < due) {
    std::this_thread::sleep_for(due - wall);
  }
}

bool Px4InLoop::due(Stamp now) noexcept {
  if (now < next_command_) return false;
  next_command_ = std::max(next_command_ + vehicle_->actuator().period(), now);  // who was late owes nothing
  return true;
}

void Px4InLoop::stand(const QuadrotorState& held) noexcept {
  const Stamp now = clock_.now();
  if (!std::exchange(begun_, true)) begin_ = phase_since_ = next_command_ = now;
  QuadrotorState still = held;
  still.v_WB.setZero();
  still.w_WB_B.setZero();
  if (due(now)) arm(now);
  advance(still);
  if (!well()) return;
  if (phase_ > Phase::kArming) watch(now);
  if (well() && !ready() && now - begin_ > options_.arm_limit) trouble_ = Trouble::kNotArmed;
}

void Px4InLoop::arm(Stamp now) noexcept {
  (void)vehicle_->states()->newest(now);  // hears what came
  const auto status = vehicle_->flight_controller().newest(now);
  const bool flies_us = status && status->armed && status->follows_us;
  const double hover_share = thrust_n().sum() / (model_.mass_kg * kGravity_m_s2);
  switch (phase_) {
    case Phase::kStanding:
      if (now - phase_since_ > kSettle && status && !status->armed) enter(Phase::kArming, now);
      break;
    case Phase::kArming:
      if (flies_us) {
        enter(Phase::kSpinningUp, now);
      } else if (now - phase_since_ > kArmPatience) {
        enter(Phase::kStanding, now);
      }
      break;
    case Phase::kSpinningUp:
      if (!(hover_share > 0.5 && hover_share < 1.5)) phase_since_ = now;
      if (now - phase_since_ > kHovers) enter(Phase::kTurning, now);
      break;
    case Phase::kTurning:
      turn(now);
      break;
    case Phase::kReady:
      break;
  }
  sdk::Setpoint setpoint = hover_;
  if (phase_ == Phase::kTurning) setpoint.body_rates_rad_s[static_cast<Eigen::Index>(axis_)] = kTurn_rad_s;
  vehicle_->flight_controller().want(now, phase_ == Phase::kStanding ? Wanted::kDisarmed : Wanted::kArmed);
  if (phase_ >= Phase::kSpinningUp) {
    vehicle_->actuator().apply(now, setpoint);
  } else {
    vehicle_->actuator().hold(now);
  }
}

/// A turn that is asked for and does not come, since the vehicle is held: its motors have to push that way, no other.
void Px4InLoop::turn(Stamp now) noexcept {
  if (now - phase_since_ <= kTurn) return;
  const Eigen::Vector3d pushed = turning() - before_turn_;
  Eigen::Index strongest = 0;
  (void)pushed.cwiseAbs().maxCoeff(&strongest);
  if (strongest != static_cast<Eigen::Index>(axis_) || !(pushed[strongest] > 0.0)) {
    trouble_ = Trouble::kMixer;
    return;
  }
  ++axis_;
  enter(axis_ == kAxes ? Phase::kReady : Phase::kTurning, now);
}

void Px4InLoop::enter(Phase phase, Stamp now) noexcept {
  phase_ = phase;
  phase_since_ = now;
  if (phase == Phase::kTurning) before_turn_ = turning();
}

PlainVector4 Px4InLoop::thrust_n() const noexcept {
  PlainVector4 thrust;
  for (std::size_t rotor = 0; rotor < places_.size(); ++rotor) {
    const double output = motors_.outputs[places_[rotor]];
    thrust[static_cast<Eigen::Index>(rotor)] = model_.thrust_max_n * output * output;
  }
  return thrust;
}

/// How the motors push about each axis, in newtons of thrust that differ: of the layout's signs, not of its arms.
Eigen::Vector3d Px4InLoop::turning() const noexcept {
  const PlainVector4 thrust = thrust_n();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t rotor = 0; rotor < places_.size(); ++rotor) {
    const auto& arm = model_.rotor_position_B_m[rotor];
    sum += thrust[static_cast<Eigen::Index>(rotor)] *
           Eigen::Vector3d(std::copysign(1.0, arm.y()), -std::copysign(1.0, arm.x()), model_.rotor_spin[rotor]);
  }
  return sum;
}

PlainVector4 Px4InLoop::step(const sdk::Setpoint& setpoint, const QuadrotorState& truth) noexcept {
  const Stamp now = clock_.now();
  if (!std::exchange(flying_, true)) thrust_->begin();
  if (due(now)) {
    (void)vehicle_->states()->newest(now);
    vehicle_->flight_controller().want(now, Wanted::kArmed);
    thrust_->on_state(now, truth, specific_force_B_.z());
    vehicle_->actuator().apply(now, setpoint);
  }
  advance(truth);
  watch(now);
  return thrust_n();
}

void Px4InLoop::watch(Stamp now) noexcept {
  if (!well()) return;
  const auto status = vehicle_->flight_controller().newest(now);
  if (!status || now - status->stamp > kStatusLimit) {
    trouble_ = Trouble::kNoStatus;
  } else if (!status->armed) {
    trouble_ = Trouble::kDisarmed;
  } else if (!status->follows_us) {
    trouble_ = Trouble::kNotFollowing;
  }
}

Error Px4InLoop::failure() const {
  const auto told = [this](const std::string& what) { return firmware_lost(name_, what, vehicle_->complaints()); };
  switch (trouble_) {
    case Trouble::kNone:
      break;
    case Trouble::kLink:
      return *broken_;
    case Trouble::kNotArmed:
      return told("it did not arm and hover within " + text(seconds(options_.arm_limit)) + " s of simulated time" +
                  (phase_ == Phase::kSpinningUp ? ": it is armed, but its motors do not hold the weight" : ""));
    case Trouble::kMixer:
      return told(
          "asked for a turn about +" + std::string(kAxisNames[axis_]) +
          ", its motors push another way; set its CA_ROTOR parameters to the vehicle's layout, KM to its signs");
    case Trouble::kNoStatus:
      return told("it tells no status any more");
    case Trouble::kDisarmed:
      return told("it disarmed in mid-race; look at its failsafes");
    case Trouble::kNotFollowing:
      return told("it left our setpoints in mid-race; look at its failsafes");
  }
  return told("nothing is wrong");
}

}  // namespace gatefield::simulator
