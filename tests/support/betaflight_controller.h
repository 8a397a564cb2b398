#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/firmware/link/link.h"
#include "client/firmware/msp/frame.h"
#include "client/firmware/msp/messages.h"
#include "tests/support/rate_controller.h"

namespace gatefield::test {

/// RateController behind MSP, as a board with Betaflight would be: it answers questions about itself, takes channels
/// from SET_RAW_RC, and arms by a switch on AUX1. Rates are ACTUAL with 200 deg/s at the centre and 670 at the end,
/// throttle is linear from 1050.
class BetaflightController {
 public:
  explicit BetaflightController(std::unique_ptr<firmware::Link> link, const RateController::Options& options = {});

  /// Takes up what was sent, at most `commands` of it, and answers.
  void serve(Stamp now, int commands = 100);
  /// As they come over MSP, or another way.
  void take_channels(Stamp now, std::span<const std::uint16_t> channels);
  RateController& loop() { return loop_; }

  /// Answers that never change, whole payloads by command: what a test bends.
  std::map<std::uint16_t, std::vector<std::uint8_t>> answers;
  /// What the sensors say; FLU.
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_g{0, 0, 1};
  double roll_deg = 0.0, pitch_nose_down_deg = 0.0, yaw_deg = 0.0;  ///< yaw clockwise, 0 to 359
  double battery_v = 16.0;
  /// A person's radio, as roll, pitch, yaw, throttle, AUX1, AUX2: then that is the receiver, and its AUX2 the mode MSP
  /// OVERRIDE (kModeMspOverride as the fifth of kBoxIds), which takes the sticks from SET_RAW_RC. Empty: MSP is.
  std::optional<std::array<std::uint16_t, 6>> radio_us;
  std::array<std::uint16_t, 8> motors_us{1000, 1000, 1000, 1000};  ///< SET_MOTOR's, while it is disarmed
  std::uint32_t reasons = 0;                                       ///< not to arm, beside its own
  bool silent = false;                                             ///< it hears and acts, but does not answer

  const std::vector<std::uint16_t>& channels() const { return channels_; }
  std::uint64_t channel_sets() const { return channel_sets_; }
  std::uint64_t commands() const { return commands_; }

 private:
  void answer(Stamp now, const firmware::msp::Frame& question);
  void hear_radio(Stamp now);
  void follow_channels(Stamp now);
  std::vector<std::uint8_t> status(Stamp now) const;

  const std::unique_ptr<firmware::Link> link_;
  firmware::msp::FrameReader reader_;
  RateController loop_;
  std::vector<std::uint16_t> channels_;  // as they are flown, in the order of the receiver
  std::array<std::uint16_t, 4> override_us_{1500, 1500, 1000, 1500};
  bool overridden_ = false;
  std::uint64_t channel_sets_ = 0, commands_ = 0;
};

}  // namespace gatefield::test
