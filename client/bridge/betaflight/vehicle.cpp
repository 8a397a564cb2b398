#include "client/bridge/betaflight/vehicle.h"

#include <algorithm>
#include <cmath>

#include "client/bridge/betaflight/attitude.h"
#include "common/base/text.h"

namespace gatefield::bridge::betaflight {
namespace {

using namespace std::chrono_literals;

constexpr auto kOpenTimeout = 3s;
constexpr auto kAskTimeout = 1s;
constexpr std::size_t kFewestChannels = 8;
constexpr int kFirstAux = 4;

/// What is asked for, one a period.
constexpr std::array kQuestions{
    msp::command::kStatus, msp::command::kAttitude, msp::command::kStatus, msp::command::kRawImu,
    msp::command::kStatus, msp::command::kRc,       msp::command::kStatus, msp::command::kBatteryState,
    msp::command::kStatus, msp::command::kAttitude, msp::command::kStatus, msp::command::kRawImu,
    msp::command::kStatus, msp::command::kAttitude, msp::command::kStatus, msp::command::kRc};
constexpr std::uint64_t kAsksFirst = 4;  // every so many periods

/// All channels that a mode looks at must be sent: those that are not would be 0, which is no valid pulse.
std::size_t channels_needed(const Settings& settings, const Options& options) {
  int last_aux = options.arm_aux - 1;
  for (std::size_t i = 0; i < settings.ranges.count; ++i) last_aux = std::max(last_aux, settings.ranges.ranges[i].aux);
  return std::clamp<std::size_t>(static_cast<std::size_t>(kFirstAux + last_aux + 1), kFewestChannels,
                                 msp::kMaxChannels);
}

bool on(const Switch& wanted, const msp::Channels& radio) noexcept {
  const auto place = static_cast<std::size_t>(kFirstAux + wanted.aux - 1);
  if (place >= radio.count) return false;
  return radio.microseconds[place] >= wanted.from_us && radio.microseconds[place] < wanted.to_us;
}

const char* name(msp::RcTuning::RatesType type) {
  switch (type) {
    case msp::RcTuning::RatesType::kBetaflight:
      return "BETAFLIGHT";
    case msp::RcTuning::RatesType::kRaceflight:
      return "RACEFLIGHT";
    case msp::RcTuning::RatesType::kKiss:
      return "KISS";
    case msp::RcTuning::RatesType::kActual:
      return "ACTUAL";
    case msp::RcTuning::RatesType::kQuick:
      return "QUICK";
  }
  return "";
}

}  // namespace

BetaflightVehicle::BetaflightVehicle(const Options& options, const QuadrotorModel& model, Settings settings,
                                     std::unique_ptr<msp::Connection> connection)
    : options_(options),
      settings_(std::move(settings)),
      channels_(settings_, options_),
      period_(from_seconds(1.0 / options_.channels_hz)),
      channel_count_(channels_needed(settings_, options_)),
      connection_(std::move(connection)),
      thrust_(options_.thrust, model),
      failsafe_(judge_failsafe(settings_, options_, &failsafe_complaint_)) {}

void BetaflightVehicle::apply(Stamp now, const sdk::Setpoint& setpoint) noexcept {
  const bool finite = setpoint.body_rates_rad_s.allFinite() && std::isfinite(setpoint.collective_thrust_n);
  const bool flies = finite && arms() && status_ && status_->armed;
  if (!flies) return hold(now);
  step(now, channels_.flying(setpoint.body_rates_rad_s, thrust_.command(now, setpoint.collective_thrust_n), true));
}

void BetaflightVehicle::hold(Stamp now) noexcept { step(now, channels_.standing(arm_switch())); }

/// The firmware takes no arm switch that went on while something stood against arming: it would have to go off first.
bool BetaflightVehicle::arm_switch() const noexcept {
  if (!arms() || !status_) return false;
  return status_->armed || firmware_->arming_disabled == 0;
}

void BetaflightVehicle::step(Stamp now, const Channels::Pulses& pulses) noexcept {
  hear(now);
  const bool asks_first = ++periods_ % kAsksFirst == 0;
  if (asks_first) ask_next();
  if (wanted_ != flight::Wanted::kReleased && !send_channels(pulses)) ++skipped_;
  if (!asks_first) ask_next();
}

bool BetaflightVehicle::send_channels(const Channels::Pulses& pulses) noexcept {
  if (sink_ != nullptr) return sink_->send(pulses);
  const auto bytes = msp::raw_rc(pulses);
  return connection_->send(msp::command::kSetRawRc, std::span(bytes).first(2 * channel_count_));
}

void BetaflightVehicle::ask_next() noexcept {
  if (connection_->send(kQuestions[questions_ % kQuestions.size()], {})) ++questions_;
}

std::optional<flight::ControllerStatus> BetaflightVehicle::newest(Stamp now) noexcept {
  hear(now);
  return status_;
}

void BetaflightVehicle::hear(Stamp now) noexcept {
  while (const auto frame = connection_->next()) {
    if (frame->way == msp::Way::kAnswer) hear(now, *frame);
  }
}

void BetaflightVehicle::hear(Stamp now, const msp::Frame& frame) noexcept {
  switch (frame.command) {
    case msp::command::kStatus:
      if (const auto status = msp::read_status(frame.payload)) on_status(now, *status);
      break;
    case msp::command::kAttitude:
      if (const auto attitude = msp::read_attitude(frame.payload); attitude && status_)
        status_->q_WB = PlainQuaternion(enu_flu(*attitude));
      break;
    case msp::command::kRawImu:
      if (const auto imu = msp::read_raw_imu(frame.payload)) {
        imu_ = imu;
        if (status_ && !status_->armed) learn_gravity(*imu);
        if (status_ && counts_per_m_s2_) status_->specific_force_z_m_s2 = imu->acceleration[2] / *counts_per_m_s2_;
      }
      break;
    case msp::command::kBatteryState:
      if (const auto battery = msp::read_battery(frame.payload); battery && status_) {
        const bool measured = battery->cells > 0 && battery->state <= msp::Battery::State::kCritical;
        status_->battery_v = measured ? std::optional(battery->voltage_v) : std::nullopt;
        if (measured) thrust_.on_battery(battery->voltage_v);
      }
      break;
    case msp::command::kRc:
      radio_ = msp::read_rc(frame.payload);
      radio_at_ = now;
      break;
    default:
      break;
  }
}

void BetaflightVehicle::on_status(Stamp now, const msp::Status& status) noexcept {
  firmware_ = status;
  if (!status_) status_.emplace();
  status_->stamp = now;
  status_->armed = mode(msp::kModeArm);
  status_->own_failsafe = mode(msp::kModeFailsafe);
  status_->follows_us =
      options_.receiver == Options::Receiver::kOverride ? mode(msp::kModeMspOverride) : !status_->own_failsafe;
  status_->pilot = pilot_switches();
  status_->pilot_stamp = radio_at_;
  status_->failsafe = failsafe_;
}

/// The unit of the accelerometer depends on the sensor, and says itself while the vehicle stands: 1 g is its mean.
void BetaflightVehicle::learn_gravity(const msp::RawImu& imu) noexcept {
  constexpr double kStill_rad_s = 0.1, kFewestCounts = 50;
  constexpr int kSamples = 20;
  const auto norm = [](const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); };
  if (norm(imu.gyro_rad_s) > kStill_rad_s || norm(imu.acceleration) < kFewestCounts) return;
  const double counts = norm(imu.acceleration) / kGravity_m_s2;
  gravity_samples_ = std::min(gravity_samples_ + 1, kSamples);
  const double before = counts_per_m_s2_.value_or(counts);
  counts_per_m_s2_ = before + (counts - before) / gravity_samples_;
}

bool BetaflightVehicle::mode(std::uint8_t permanent) const noexcept {
  const auto place = std::find(settings_.boxes.begin(), settings_.boxes.end(), permanent) - settings_.boxes.begin();
  return firmware_ && place < std::min<std::ptrdiff_t>(32, static_cast<std::ptrdiff_t>(settings_.boxes.size())) &&
         (firmware_->modes >> place & 1u) != 0;
}

std::optional<flight::PilotSwitches> BetaflightVehicle::pilot_switches() const noexcept {
  if (options_.receiver != Options::Receiver::kOverride || !radio_) return std::nullopt;
  flight::PilotSwitches switches;
  switches.take_over = !mode(msp::kModeMspOverride);
  switches.kill = options_.kill && on(*options_.kill, *radio_);
  for (std::size_t i = 0; i < settings_.ranges.count; ++i) {
    const msp::ModeRange& range = settings_.ranges.ranges[i];
    if (range.mode == msp::kModeArm) switches.arm |= on({range.aux + 1, range.begin_us, range.end_us}, *radio_);
  }
  return switches;
}

std::vector<std::string> BetaflightVehicle::description() const {
  const auto& version = settings_.version;
  std::vector<std::string> lines{
      connection_->name() + ": Betaflight " + text(version.major) + "." + text(version.minor) + "." +
          text(version.patch),
      std::string("rates ") + name(settings_.tuning.type) + ", failsafe after " + fixed(settings_.failsafe.delay_s, 1) +
          " s, " +
          (options_.receiver == Options::Receiver::kOverride ? "a radio's MSP OVERRIDE gives the sticks"
                                                             : "the bridge is the receiver")};
  return lines;
}

std::vector<std::string> BetaflightVehicle::complaints() const {
  std::vector<std::string> sentences;
  if (const auto failure = connection_->failure()) sentences.push_back(failure->message);
  if (!failsafe_complaint_.empty()) sentences.push_back(failsafe_complaint_);
  if (!firmware_) {
    sentences.push_back(connection_->name() + ": the flight controller has not told its status yet");
    return sentences;
  }
  if (mode(msp::kModeArm)) return sentences;
  for (int bit = 0; bit < 32; ++bit) {
    const bool ours = bit == msp::kNotArmedThrottle || bit == msp::kNotArmedRxFailsafe;  // gone once channels are sent
    if ((firmware_->arming_disabled >> bit & 1u) != 0 && !(ours && questions_ < kQuestions.size()))
      sentences.push_back(std::string("the flight controller does not arm: ") + msp::why_not_armed(bit));
  }
  return sentences;
}

Result<Opened> open_connection(const Options& options, const Clock& clock) {
  auto link = firmware::open(options.link, kOpenTimeout);
  if (!link) return link.failure();
  auto connection = std::make_unique<msp::Connection>(std::move(link).value(), clock);
  auto settings = read_settings(*connection, kAskTimeout);
  if (!settings) return settings.failure();
  return Opened{std::move(connection), std::move(settings).value()};
}

Result<std::unique_ptr<BetaflightVehicle>> open(const Options& options, const QuadrotorModel& model,
                                                const Clock& clock) {
  auto opened = open_connection(options, clock);
  if (!opened) return opened.failure();
  const auto& most = model.body_rate_max_rad_s;
  if (auto status = check(opened->settings, options, {most.x(), most.y(), most.z()}); !status) return status.failure();
  Opened board = std::move(opened).value();
  return std::make_unique<BetaflightVehicle>(options, model, std::move(board.settings), std::move(board.connection));
}

}  // namespace gatefield::bridge::betaflight
