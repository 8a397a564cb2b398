#include "client/simulator/px4_in_loop.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/simulator/px4_lockstep.h"
#include "client/simulator/px4_real_time.h"
#include "client/simulator/simulation.h"
#include "common/base/text.h"

namespace gatefield::simulator {
namespace {

using namespace std::chrono_literals;
using flight::Wanted;

constexpr Stamp kSettle = 500ms;        // of quiet setpoints before it is asked to arm, and between two tries
constexpr Stamp kArmPatience = 5s;      // then it is asked anew
constexpr Stamp kHovers = 200ms;        // of motors that hold the weight
constexpr Stamp kTurn = 120ms;          // of a turn that is asked for while the vehicle is held, and of none before
constexpr Stamp kTurnPatience = 500ms;  // until its motors push that way
constexpr int kTurnSetpoints = 10;      // that have gone out by then, and messages of motors that came
constexpr Stamp kStatusLimit = 2500ms;  // of PX4's word, which comes every second
constexpr Stamp kStop = 300ms;          // of asking for stopped motors, after the race
constexpr double kTurn_rad_s = 0.4;
constexpr const char* kAxisNames[] = {"x (roll)", "y (pitch)", "z (yaw)"};

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

Result<std::unique_ptr<Px4Exchange>> open_exchange(const Px4Options& options, std::uint64_t seed) {
  if (firmware::is_board(options.hil)) return Px4RealTime::open(options, seed);
  return Px4Lockstep::open(options, seed);
}

}  // namespace

Result<std::unique_ptr<Px4InLoop>> Px4InLoop::open(const Px4Options& options, const config::Scenario& scenario) {
  if (Status status = validate(options); !status) return status.failure();
  if (Status status = check_firmware_scenario(scenario); !status) return status.failure();
  const auto found = places(scenario.vehicle.quadrotor);
  if (!found) return found.failure();
  auto exchange = open_exchange(options, scenario.seed);
  if (!exchange) return exchange.failure();
  std::unique_ptr<Px4InLoop> loop(new Px4InLoop(options, scenario, *found, std::move(exchange).value()));
  if (Status status = loop->connect(start_state(scenario)); !status) return status.failure();
  return loop;
}

Px4InLoop::Px4InLoop(const Px4Options& options, const config::Scenario& scenario, const Places& places,
                     std::unique_ptr<Px4Exchange> exchange)
    : options_(options),
      model_(scenario.vehicle.quadrotor),
      places_(places),
      hover_(hover_setpoint(model_)),
      exchange_(std::move(exchange)) {}

Px4InLoop::~Px4InLoop() {
  if (phase_ == Phase::kStanding || trouble_ == Trouble::kLink) return;
  for (const Stamp end = now() + kStop; now() < end && trouble_ != Trouble::kLink;) {
    if (due(now())) {
      bridge_.vehicle->flight_controller().want(now(), Wanted::kKilled);
      bridge_.vehicle->actuator().hold(now());
    }
    advance(last_);
    exchange_->rest();
  }
}

Status Px4InLoop::connect(const QuadrotorState& held) {
  if (Status status = exchange_->begin(held); !status) return status;
  return exchange_->meanwhile(held, [this]() -> Status {
    auto bridge = open_px4_bridge(options_, model_, exchange_.get());
    if (!bridge) return bridge.failure();
    bridge_ = std::move(bridge).value();
    return {};
  });
}

void Px4InLoop::advance(const QuadrotorState& state) noexcept {
  last_ = state;
  exchange_->advance(state);
  if (exchange_->broken()) trouble_ = Trouble::kLink;
}

bool Px4InLoop::due(Stamp now) noexcept {
  if (now < next_command_) return false;
  next_command_ = std::max(next_command_ + bridge_.vehicle->actuator().period(), now);  // who was late owes nothing
  return true;
}

void Px4InLoop::stand(const QuadrotorState& held) noexcept {
  const Stamp now = this->now();
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
  (void)bridge_.vehicle->states()->newest(now);  // hears what came
  const auto status = bridge_.vehicle->flight_controller().newest(now);
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
      if (now - phase_since_ > kHovers) enter(Phase::kSteady, now);
      break;
    case Phase::kSteady:
      if (lasted(now, kTurn)) enter(Phase::kTurning, now);
      break;
    case Phase::kTurning:
      turn(now);
      break;
    case Phase::kReady:
      break;
  }
  sdk::Setpoint setpoint = hover_;
  ++asked_;
  if (phase_ == Phase::kTurning) setpoint.body_rates_rad_s[static_cast<Eigen::Index>(axis_)] = kTurn_rad_s;
  bridge_.vehicle->flight_controller().want(now, phase_ == Phase::kStanding ? Wanted::kDisarmed : Wanted::kArmed);
  if (phase_ >= Phase::kSpinningUp) {
    bridge_.vehicle->actuator().apply(now, setpoint);
  } else {
    bridge_.vehicle->actuator().hold(now);
  }
}

/// A turn that is asked for and does not come, since the vehicle is held: its motors have to push that way, no other.
void Px4InLoop::turn(Stamp now) noexcept {
  if (!lasted(now, kTurn)) return;
  const Eigen::Vector3d pushed = turning() - before_turn_;
  Eigen::Index strongest = 0;
  (void)pushed.cwiseAbs().maxCoeff(&strongest);
  if (strongest == static_cast<Eigen::Index>(axis_) && pushed[strongest] > 0.0) {
    ++axis_;
    enter(axis_ == kAxes ? Phase::kReady : Phase::kSteady, now);
  } else if (lasted(now, kTurnPatience)) {
    trouble_ = Trouble::kMixer;
  }
}

/// Time alone says little on a machine that was busy with something else.
bool Px4InLoop::lasted(Stamp now, Stamp span) const noexcept {
  const std::uint64_t answers = exchange_->motors().answers - answers_;
  return now - phase_since_ > span && asked_ >= kTurnSetpoints && answers >= kTurnSetpoints;
}

void Px4InLoop::enter(Phase phase, Stamp now) noexcept {
  phase_ = phase;
  phase_since_ = now;
  asked_ = 0;
  answers_ = exchange_->motors().answers;
  if (phase == Phase::kTurning) before_turn_ = turning();
}

PlainVector4 Px4InLoop::thrust_n() const noexcept {
  PlainVector4 thrust;
  for (std::size_t rotor = 0; rotor < places_.size(); ++rotor) {
    const double output = exchange_->motors().outputs[places_[rotor]];
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
  const Stamp now = this->now();
  if (!std::exchange(flying_, true)) bridge_.thrust->begin();
  if (due(now)) {
    (void)bridge_.vehicle->states()->newest(now);
    bridge_.vehicle->flight_controller().want(now, Wanted::kArmed);
    bridge_.thrust->on_state(now, truth, exchange_->specific_force_B().z());
    bridge_.vehicle->actuator().apply(now, setpoint);
  }
  advance(truth);
  watch(now);
  return thrust_n();
}

void Px4InLoop::watch(Stamp now) noexcept {
  if (!well()) return;
  const auto status = bridge_.vehicle->flight_controller().newest(now);
  if (!status || now - status->stamp > kStatusLimit) {
    trouble_ = Trouble::kNoStatus;
  } else if (!status->armed) {
    trouble_ = Trouble::kDisarmed;
  } else if (!status->follows_us) {
    trouble_ = Trouble::kNotFollowing;
  }
}

Error Px4InLoop::failure() const {
  const auto told = [this](const std::string& what) {
    return firmware_lost(bridge_.name, what, bridge_.vehicle->complaints());
  };
  switch (trouble_) {
    case Trouble::kNone:
      break;
    case Trouble::kLink:
      return *exchange_->broken();
    case Trouble::kNotArmed:
      return told("it did not arm and hover within " + text(seconds(options_.arm_limit)) + " s" +
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
