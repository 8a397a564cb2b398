#include "tests/support/betaflight_controller.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gatefield::test {
namespace {

namespace msp = firmware::msp;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kCentre_deg_s = 200, kEnd_deg_s = 670, kMinCheck_us = 1050;
constexpr double kCountsPerG = 2048.0, kCountsPerDegreeASecond = 16.4;
constexpr std::size_t kArmChannel = 4;
constexpr std::array<std::size_t, 4> kPlaces{0, 1, 3, 2};  // of roll, pitch, yaw, throttle: the usual AETR

class Writer {
 public:
  Writer& u8(int value) {
    bytes.push_back(static_cast<std::uint8_t>(value));
    return *this;
  }
  Writer& u16(int value) { return u8(value & 0xFF).u8(value >> 8 & 0xFF); }
  Writer& u32(std::uint32_t value) { return u16(static_cast<int>(value & 0xFFFF)).u16(static_cast<int>(value >> 16)); }
  std::vector<std::uint8_t> bytes;
};

std::map<std::uint16_t, std::vector<std::uint8_t>> settings() {
  Writer tuning, ranges;
  tuning.u8(kCentre_deg_s / 10).u8(0);
  for (int axis = 0; axis < 3; ++axis) tuning.u8(kEnd_deg_s / 10);
  tuning.u8(0).u8(50).u8(0).u16(0).u8(0).u8(kCentre_deg_s / 10).u8(kCentre_deg_s / 10).u8(0).u8(0).u8(100);
  for (int axis = 0; axis < 3; ++axis) tuning.u16(1998);
  tuning.u8(3);
  ranges.u8(msp::kModeArm).u8(0).u8((1700 - 900) / 25).u8((2100 - 900) / 25);
  for (int i = 0; i < 19; ++i) ranges.u32(0);
  return {
      {msp::command::kApiVersion, {0, 1, 46}},
      {msp::command::kFcVariant, {'B', 'T', 'F', 'L'}},
      {msp::command::kFcVersion, {4, 5, 1}},
      {msp::command::kRcTuning, tuning.bytes},
      {msp::command::kRxConfig, Writer().u8(0).u16(1900).u16(1500).u16(kMinCheck_us).u8(0).u16(885).u16(2115).bytes},
      {msp::command::kRxMap, {0, 1, 3, 2, 4, 5, 6, 7}},
      {msp::command::kRcDeadband, {0, 0, 0, 0, 0}},
      {msp::command::kFailsafeConfig, Writer().u8(5).u8(10).u16(1000).u8(0).u16(100).u8(1).bytes},
      {msp::command::kMixerConfig, {3, 0}},
      {msp::command::kFeatureConfig, Writer().u32(msp::kFeatureRxMsp | msp::kFeatureAirmode).bytes},
      {msp::command::kModeRanges, ranges.bytes},
      {msp::command::kBoxIds, {msp::kModeArm, msp::kModeAngle, msp::kModeFailsafe, msp::kModeAirmode}},
  };
}

std::vector<std::uint16_t> words_of(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint16_t> words;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2)
    words.push_back(static_cast<std::uint16_t>(bytes[i] | bytes[i + 1] << 8));
  return words;
}

double rate_rad_s(int pulse_us) {
  const double x = std::clamp((pulse_us - 1500) / 500.0, -1.0, 1.0);
  return (x * kCentre_deg_s + (kEnd_deg_s - kCentre_deg_s) * std::abs(x) * x) * kDegree;
}

}  // namespace

BetaflightController::BetaflightController(std::unique_ptr<firmware::Link> link, const RateController::Options& options)
    : answers(settings()), link_(std::move(link)), loop_(options) {}

void BetaflightController::serve(Stamp now, int commands) {
  if (radio_us) hear_radio(now);
  for (int taken = 0; taken < commands;) {
    const auto question = reader_.next();
    if (question) {
      ++taken;
      answer(now, *question);
      continue;
    }
    const std::size_t got = link_->receive(reader_.room()).bytes;
    if (got == 0) return;
    reader_.filled(got);
  }
}

void BetaflightController::answer(Stamp now, const msp::Frame& question) {
  ++commands_;
  std::vector<std::uint8_t> payload;
  msp::Way way = msp::Way::kAnswer;
  switch (question.command) {
    case msp::command::kSetRawRc:
      take_channels(now, words_of(question.payload));
      break;
    case msp::command::kSetMotor:
      for (std::size_t i = 0; i < motors_us.size() && 2 * i + 1 < question.payload.size() && !loop_.armed(); ++i)
        motors_us[i] = static_cast<std::uint16_t>(question.payload[2 * i] | question.payload[2 * i + 1] << 8);
      break;
    case msp::command::kStatus:
      payload = status(now);
      break;
    case msp::command::kAttitude:
      payload = Writer()
                    .u16(static_cast<int>(std::lround(roll_deg * 10)))
                    .u16(static_cast<int>(std::lround(pitch_nose_down_deg * 10)))
                    .u16(static_cast<int>(std::lround(yaw_deg)))
                    .bytes;
      break;
    case msp::command::kRawImu: {
      Writer imu;
      for (const double g : acceleration_g) imu.u16(static_cast<int>(std::lround(g * kCountsPerG)));
      for (const double rate : gyro_rad_s)
        imu.u16(static_cast<int>(std::lround(rate / kDegree * kCountsPerDegreeASecond)));
      payload = imu.u16(0).u16(0).u16(0).bytes;
      break;
    }
    case msp::command::kBatteryState:
      payload = Writer().u8(4).u16(1300).u8(160).u16(0).u16(0).u8(0).u16(static_cast<int>(battery_v * 100)).bytes;
      break;
    case msp::command::kRc: {
      Writer radio;
      for (std::size_t i = 0; i < channels_.size(); ++i) radio.u16(channels_[i < 4 ? kPlaces[i] : i]);
      payload = radio.bytes;
      break;
    }
    default:
      if (const auto known = answers.find(question.command); known != answers.end()) {
        payload = known->second;
      } else {
        way = msp::Way::kRefusal;
      }
  }
  if (silent) return;
  std::array<std::uint8_t, msp::kMaxFrame> buffer{};
  (void)link_->send(msp::encode({way, question.version, question.command, payload}, buffer));
}

void BetaflightController::take_channels(Stamp now, std::span<const std::uint16_t> channels) {
  if (radio_us) {
    if (channels.size() >= override_us_.size())
      std::copy_n(channels.begin(), override_us_.size(), override_us_.begin());
    return;
  }
  channels_.assign(channels.begin(), channels.end());
  if (channels_.size() <= kArmChannel) return;
  ++channel_sets_;
  follow_channels(now);
}

void BetaflightController::hear_radio(Stamp now) {
  constexpr std::size_t kOverrideChannel = 5;
  overridden_ = (*radio_us)[kOverrideChannel] >= 1700;
  channels_.assign(radio_us->begin(), radio_us->end());
  for (std::size_t i = 0; i < kPlaces.size(); ++i)
    channels_[kPlaces[i]] = overridden_ ? override_us_[kPlaces[i]] : (*radio_us)[i];
  follow_channels(now);
}

void BetaflightController::follow_channels(Stamp now) {
  const auto stick = [&](std::size_t i) { return static_cast<int>(channels_[kPlaces[i]]); };
  loop_.command(now, {rate_rad_s(stick(0)), rate_rad_s(stick(1)), -rate_rad_s(stick(2))},
                std::max(0.0, (stick(3) - kMinCheck_us) / static_cast<double>(2000 - kMinCheck_us)));
  const bool on = channels_[kArmChannel] >= 1700 && channels_[kArmChannel] < 2100;
  if (!on || reasons == 0) loop_.arm_switch(now, on);
}

std::vector<std::uint8_t> BetaflightController::status(Stamp now) const {
  constexpr std::uint32_t kThrottle = 1u << 7, kFailsafe = 1u << 1;
  std::uint32_t why = reasons;
  if (loop_.in_failsafe()) why |= kFailsafe;
  if (!loop_.may_arm(now) && !loop_.in_failsafe()) why |= kThrottle;
  const std::uint32_t modes = (loop_.armed() ? 1u : 0u) | (loop_.in_failsafe() ? 4u : 0u) | (overridden_ ? 16u : 0u);
  return Writer().u16(125).u16(0).u16(0x21).u32(modes).u8(0).u16(20).u16(0).u8(0).u8(26).u32(why).u8(0).u16(0).bytes;
}

}  // namespace gatefield::test
