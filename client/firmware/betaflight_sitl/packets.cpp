#include "client/firmware/betaflight_sitl/packets.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "client/flight/frames.h"

namespace gatefield::firmware::betaflight_sitl {
namespace {

static_assert(std::endian::native == std::endian::little, "packets are copied as they lie in memory");

constexpr std::size_t kTime = 0, kGyro = 1, kAcceleration = 4, kAttitude = 7, kPressure = 17;
constexpr std::size_t kStateNumbers = 18;
using Numbers = std::array<double, kStateNumbers>;

/// Where in a packet the output of each motor lies.
constexpr std::array<std::size_t, 4> kPlacesUntil2025{3, 0, 1, 2}, kPlacesSince2026{0, 1, 2, 3};
const std::array<std::size_t, 4>& places(Wire wire) noexcept {
  return wire == Wire::kUntil2025 ? kPlacesUntil2025 : kPlacesSince2026;
}

/// Changes of sign are their own inverse.
Eigen::Vector3d turned_rates(const Eigen::Vector3d& w, Wire wire) noexcept {
  return {w.x(), -w.y(), wire == Wire::kUntil2025 ? -w.z() : w.z()};
}

Eigen::Quaterniond half_turned(const Eigen::Quaterniond& q) noexcept { return {q.w(), q.x(), -q.y(), -q.z()}; }

template <typename T, std::size_t kCount>
auto bytes_of(const std::array<T, kCount>& numbers) noexcept {
  return std::bit_cast<std::array<std::uint8_t, sizeof(T) * kCount>>(numbers);
}

}  // namespace

std::array<std::uint8_t, kStateBytes> encode(const State& state, Wire wire, double stamp_s) noexcept {
  Numbers numbers{};
  numbers[kTime] = stamp_s;
  const Eigen::Vector3d gyro = turned_rates(state.body_rates_rad_s, wire);
  const auto attitude =
      flight::wxyz(wire == Wire::kUntil2025 ? flight::ned_frd_from_enu_flu(state.q_WB) : half_turned(state.q_WB));
  for (std::size_t i = 0; i < 3; ++i) {
    numbers[kGyro + i] = gyro[static_cast<Eigen::Index>(i)];
    numbers[kAcceleration + i] = -state.specific_force_m_s2[static_cast<Eigen::Index>(i)];
  }
  for (std::size_t i = 0; i < 4; ++i) numbers[kAttitude + i] = attitude[i];
  numbers[kPressure] = state.pressure_pa;
  return bytes_of(numbers);
}

std::optional<State> read_state(std::span<const std::uint8_t> packet, Wire wire) noexcept {
  if (packet.size() != kStateBytes) return std::nullopt;
  Numbers numbers{};
  std::memcpy(numbers.data(), packet.data(), kStateBytes);
  for (const double number : numbers)
    if (!std::isfinite(number)) return std::nullopt;
  State state;
  state.body_rates_rad_s = turned_rates({numbers[kGyro], numbers[kGyro + 1], numbers[kGyro + 2]}, wire);
  state.specific_force_m_s2 = {-numbers[kAcceleration], -numbers[kAcceleration + 1], -numbers[kAcceleration + 2]};
  const Eigen::Quaterniond q =
      flight::from_wxyz({numbers[kAttitude], numbers[kAttitude + 1], numbers[kAttitude + 2], numbers[kAttitude + 3]});
  state.q_WB = wire == Wire::kUntil2025 ? flight::enu_flu_from_ned_frd(q) : half_turned(q);
  state.pressure_pa = numbers[kPressure];
  return state;
}

double read_stamp_s(std::span<const std::uint8_t> packet) noexcept {
  double stamp_s = 0.0;
  std::memcpy(&stamp_s, packet.data() + kTime * sizeof(double), sizeof(stamp_s));
  return stamp_s;
}

std::array<std::uint8_t, kMotorsBytes> encode(const Motors& motors, Wire wire) noexcept {
  std::array<float, 4> numbers{};
  for (std::size_t i = 0; i < motors.size(); ++i) numbers[places(wire)[i]] = static_cast<float>(motors[i]);
  return bytes_of(numbers);
}

std::optional<Motors> read_motors(std::span<const std::uint8_t> packet, Wire wire) noexcept {
  if (packet.size() != kMotorsBytes) return std::nullopt;
  std::array<float, 4> numbers{};
  std::memcpy(numbers.data(), packet.data(), kMotorsBytes);
  Motors motors{};
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const float output = numbers[places(wire)[i]];
    if (!(output >= 0.0f && output <= 1.0f)) return std::nullopt;
    motors[i] = output;
  }
  return motors;
}

std::array<std::uint8_t, kStampedMotorsBytes> encode(const StampedMotors& motors, Wire wire) noexcept {
  std::array<std::uint8_t, kStampedMotorsBytes> packet{};
  const auto plain = encode(motors.motors, wire);
  std::copy(plain.begin(), plain.end(), packet.begin());
  std::memcpy(packet.data() + kMotorsBytes, &motors.stamp_s, sizeof(motors.stamp_s));
  return packet;
}

std::optional<StampedMotors> read_stamped_motors(std::span<const std::uint8_t> packet, Wire wire) noexcept {
  if (packet.size() != kStampedMotorsBytes) return std::nullopt;
  const auto motors = read_motors(packet.first(kMotorsBytes), wire);
  double stamp_s = 0.0;
  std::memcpy(&stamp_s, packet.data() + kMotorsBytes, sizeof(stamp_s));
  if (!motors || !std::isfinite(stamp_s)) return std::nullopt;
  return StampedMotors{*motors, stamp_s};
}

std::array<std::uint8_t, kChannelsBytes> encode(const Channels& channels) noexcept {
  std::array<std::uint8_t, kChannelsBytes> packet{};
  std::memcpy(packet.data(), &kConstantStamp_s, sizeof(kConstantStamp_s));
  std::memcpy(packet.data() + sizeof(kConstantStamp_s), channels.data(), sizeof(channels));
  return packet;
}

std::optional<Channels> read_channels(std::span<const std::uint8_t> packet) noexcept {
  if (packet.size() != kChannelsBytes) return std::nullopt;
  Channels channels{};
  std::memcpy(channels.data(), packet.data() + sizeof(double), sizeof(channels));
  return channels;
}

}  // namespace gatefield::firmware::betaflight_sitl
