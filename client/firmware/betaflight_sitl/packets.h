#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

/// What Betaflight, built for a computer (target SITL), says to a simulator and hears from it over UDP. Read in
/// src/main/target/SITL (later src/platform/SIMULATOR) of 4.4 to 2026.6, and seen with 4.5 and 2025.12; all numbers are
/// little endian.
///
///   state, to port 9003, 144 bytes    f64 time, gyro[3] rad/s, acceleration[3] m/s^2, attitude[4] w first,
///                                     velocity[3], position[3], pressure Pa
///   channels, to port 9004, 40 bytes  f64 time, u16[16] microseconds, in the order of its receiver; since 4.5
///   motors, to port 9002, 16 bytes    f32[4], 0 to 1
///
/// The firmware runs on the machine's own clock. Times of state packets that advance stretch that clock (by the ratio
/// of stamps to the machine's time between two packets, which is noise on a busy machine), so they stay the same here.
/// It answers a state packet with motors once, when its loop has run; when no state came for 0.5 s, the next one is
/// taken as the first. 4.4 takes the first 136 bytes of a state.
///
/// Lockstep: with the library gatefield-betaflight-clock loaded into it (LD_PRELOAD; clock/lockstep_clock.cpp), its
/// time is that of the states. A state whose stamp is later than the last one's by up to 0.1 s lets it run on for just
/// that long; what it comes to at the end goes out as motors with the state's stamp behind them, 24 bytes, and it
/// stands until the next state. The same stamp again, or silence for 5 s, gives it the machine's clock back.
///
/// Signs and order changed with 2026.6. With w, f the body's rates and specific force in FLU:
///                   until 2025.12                            since 2026.6
///   gyro            (w_x, -w_y, -w_z), FRD                   (w_x, -w_y, w_z)
///   acceleration    -f                                       -f
///   attitude        q_NF, NED and FRD                        (w, x, -y, -z) of q_WB, ENU and FLU
///   motors          front right, rear left, front left,      rear right, front right, rear left, front left
///                   rear right
/// Thread-safe: yes (pure).   Real-time safe: yes.
namespace gatefield::firmware::betaflight_sitl {

inline constexpr std::uint16_t kStatePort = 9003, kMotorsPort = 9002, kChannelsPort = 9004, kMspPort = 5761;

enum class Wire : std::uint8_t { kUntil2025, kSince2026 };

struct State {
  Eigen::Vector3d body_rates_rad_s = Eigen::Vector3d::Zero();     ///< FLU
  Eigen::Vector3d specific_force_m_s2 = Eigen::Vector3d::Zero();  ///< FLU; (0, 0, 9.81) at rest
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();       ///< ENU, FLU
  double pressure_pa = 101325.0;
};

inline constexpr std::size_t kStateBytes = 144, kChannelsBytes = 40, kMotorsBytes = 16, kStampedMotorsBytes = 24;
/// What every state's stamp is, but in lockstep.
inline constexpr double kConstantStamp_s = 1.0;
std::array<std::uint8_t, kStateBytes> encode(const State& state, Wire wire, double stamp_s = kConstantStamp_s) noexcept;
/// Nothing when it has another size, or holds what is not finite.
std::optional<State> read_state(std::span<const std::uint8_t> packet, Wire wire) noexcept;
/// @pre it is a state
double read_stamp_s(std::span<const std::uint8_t> packet) noexcept;

/// Outputs of the motors, 0 to 1, by place: rear right, front right, rear left, front left, which is the order in which
/// Betaflight numbers them.
using Motors = std::array<double, 4>;
std::array<std::uint8_t, kMotorsBytes> encode(const Motors& motors, Wire wire) noexcept;
/// Nothing when it has another size, or a value is not finite or beyond 0 to 1.
std::optional<Motors> read_motors(std::span<const std::uint8_t> packet, Wire wire) noexcept;

/// Motors of lockstep, and the stamp of the state that they answer.
struct StampedMotors {
  Motors motors{};
  double stamp_s = 0.0;
};
std::array<std::uint8_t, kStampedMotorsBytes> encode(const StampedMotors& motors, Wire wire) noexcept;
/// Nothing when it has another size, or is not finite, or a motor is beyond 0 to 1.
std::optional<StampedMotors> read_stamped_motors(std::span<const std::uint8_t> packet, Wire wire) noexcept;

/// Pulses of a receiver, microseconds.
using Channels = std::array<std::uint16_t, 16>;
std::array<std::uint8_t, kChannelsBytes> encode(const Channels& channels) noexcept;
/// Nothing when it has another size.
std::optional<Channels> read_channels(std::span<const std::uint8_t> packet) noexcept;

}  // namespace gatefield::firmware::betaflight_sitl
