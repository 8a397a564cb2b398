#include "common/dds/px4/messages.h"

#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "common/base/text.h"

namespace gatefield::px4 {
namespace {

constexpr float kFarthest_m = 1e5F, kFastest_m_s = 200.0F, kFastestTurn_rad_s = 100.0F, kStrongest_m_s2 = 1000.0F;
constexpr float kMostVolts = 200.0F;
constexpr std::uint64_t kLastStamp_us = 9'000'000'000'000'000;
constexpr double kUnitWithin = 1e-2;  // of single precision and a filter that normalises now and then
constexpr std::uint8_t kMostResult = 9;
constexpr float kMostKnob = 1.001F;

template <typename Message>
std::string path(std::string_view field) {
  return std::string(Message::kTopic) + "." + std::string(field);
}

template <typename Message>
Status check_stamp(std::string_view field, std::uint64_t stamp_us) {
  if (stamp_us > 0 && stamp_us <= kLastStamp_us) return {};
  return Error::invalid(path<Message>(field), text(stamp_us) + " us", "1 to " + text(kLastStamp_us) + " us");
}

template <typename Message>
Status check_each(std::string_view field, std::span<const float> values, float most, std::string_view unit) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!(std::abs(values[i]) <= most))
      return Error::invalid(
          path<Message>(field) + "[" + text(i) + "]", text(static_cast<double>(values[i])) + " " + std::string(unit),
          text(static_cast<double>(-most)) + " to " + text(static_cast<double>(most)) + " " + std::string(unit));
  return {};
}

template <typename Message>
Status check_within(std::string_view field, int value, int least, int most, const std::string& meaning) {
  if (value >= least && value <= most) return {};
  return Error::invalid(path<Message>(field), text(value), text(least) + " to " + text(most) + meaning);
}

}  // namespace

Status validate(const VehicleOdometry& message) {
  using M = VehicleOdometry;
  for (const auto& [field, stamp] :
       {std::pair("timestamp", message.timestamp), std::pair("timestamp_sample", message.timestamp_sample)})
    if (Status status = check_stamp<M>(field, stamp); !status) return status;
  if (Status status = check_within<M>("pose_frame", message.pose_frame, 1, 2, " (NED, FRD)"); !status) return status;
  if (Status status = check_within<M>("velocity_frame", message.velocity_frame, 1, 3, " (NED, FRD, the body's FRD)");
      !status)
    return status;
  if (Status status = check_each<M>("position", message.position, kFarthest_m, "m"); !status) return status;
  if (Status status = check_each<M>("velocity", message.velocity, kFastest_m_s, "m/s"); !status) return status;
  if (Status status = check_each<M>("angular_velocity", message.angular_velocity, kFastestTurn_rad_s, "rad/s"); !status)
    return status;
  double squares = 0.0;
  for (const float number : message.q) squares += static_cast<double>(number) * static_cast<double>(number);
  if (!(std::abs(std::sqrt(squares) - 1.0) <= kUnitWithin))
    return Error::invalid(path<M>("q"), "a quaternion of length " + text(std::sqrt(squares)), "length 1 (w, x, y, z)");
  return check_within<M>("quality", message.quality, -1, 100, " %");
}

Status validate(const VehicleStatus& message) {
  using M = VehicleStatus;
  if (Status status = check_stamp<M>("timestamp", message.timestamp); !status) return status;
  if (Status status = check_within<M>("arming_state", message.arming_state, 1, 2, " (disarmed, armed)"); !status)
    return status;
  if (Status status = check_within<M>("nav_state", message.nav_state, 0, kNavStates - 1, ""); !status) return status;
  return check_within<M>("system_id", message.system_id, 1, 255, "");
}

Status validate(const VehicleCommandAck& message) {
  if (Status status = check_stamp<VehicleCommandAck>("timestamp", message.timestamp); !status) return status;
  return check_within<VehicleCommandAck>("result", message.result, 0, kMostResult, "");
}

Status validate(const VehicleLandDetected& message) {
  return check_stamp<VehicleLandDetected>("timestamp", message.timestamp);
}

Status validate(const SensorCombined& message) {
  using M = SensorCombined;
  if (Status status = check_stamp<M>("timestamp", message.timestamp); !status) return status;
  if (Status status = check_each<M>("gyro_rad", message.gyro_rad, kFastestTurn_rad_s, "rad/s"); !status) return status;
  return check_each<M>("accelerometer_m_s2", message.accelerometer_m_s2, kStrongest_m_s2, "m/s2");
}

Status validate(const TimesyncStatus& message) {
  using M = TimesyncStatus;
  if (Status status = check_stamp<M>("timestamp", message.timestamp); !status) return status;
  constexpr auto kMost = static_cast<std::int64_t>(kLastStamp_us);
  for (const auto& [field, offset] :
       {std::pair("observed_offset", message.observed_offset), std::pair("estimated_offset", message.estimated_offset)})
    if (offset < -kMost || offset > kMost)
      return Error::invalid(path<M>(field), text(offset) + " us", text(-kMost) + " to " + text(kMost) + " us");
  return {};
}

Status validate(const ManualControlSetpoint& message) {
  using M = ManualControlSetpoint;
  if (Status status = check_stamp<M>("timestamp", message.timestamp); !status) return status;
  for (std::size_t i = 0; i < message.aux.size(); ++i)
    if (!std::isnan(message.aux[i]) && !(std::abs(message.aux[i]) <= kMostKnob))
      return Error::invalid(path<M>("aux" + text(i + 1)), text(static_cast<double>(message.aux[i])),
                            "-1 to 1, or NaN for none");
  return {};
}

Status validate(const InputRc& message) {
  using M = InputRc;
  if (Status status = check_stamp<M>("timestamp", message.timestamp); !status) return status;
  return check_within<M>("channel_count", message.channel_count, 0, static_cast<int>(M::kChannels), "");
}

Status validate(const BatteryStatus& message) {
  using M = BatteryStatus;
  if (Status status = check_stamp<M>("timestamp", message.timestamp); !status) return status;
  if (message.voltage_v >= 0.0F && message.voltage_v <= kMostVolts) return {};
  return Error::invalid(path<M>("voltage_v"), text(static_cast<double>(message.voltage_v)) + " V", "0 to 200 V");
}

}  // namespace gatefield::px4
