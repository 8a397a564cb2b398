#pragma once

#include <cstdint>
#include <memory>

#include "client/firmware/link/link.h"
#include "client/firmware/mavlink/constants.h"
#include "client/firmware/mavlink/frame_reader.h"
#include "client/firmware/px4_hil/sensors.h"
#include "tests/support/mavlink_controller.h"

namespace gatefield::test {

/// The simulator's side of a MavlinkController: its gyro is HIL_SENSOR's, and its motors go out as
/// HIL_ACTUATOR_CONTROLS.
///
/// In lockstep it answers each sample, speaks first, as PX4's SITL does, and its estimator is HIL_STATE_QUATERNION's
/// truth. By its own clock, as a board with PX4: samples count when they come, motors go out at most every kOutputs,
/// and nobody is told the truth.
class HilFirmware {
 public:
  enum class Clock : std::uint8_t { kLockstep, kOwn };
  static constexpr Stamp kOutputs{std::chrono::milliseconds(5)};

  HilFirmware(std::unique_ptr<firmware::Link> simulator, MavlinkController* controller, Clock clock = Clock::kLockstep)
      : link_(std::move(simulator)), controller_(*controller), clock_(clock), greeted_(clock == Clock::kOwn) {}

  /// Takes up what the simulator sent. @param now  the controller's
  void serve(Stamp now);

  bool hangs = false;          ///< it takes samples and answers none
  bool thrust_linear = false;  ///< its outputs are roots of the thrust that is asked for (THR_MDL_FAC 1)
  std::uint64_t flags = firmware::mavlink::kHilLockstep;  ///< of HIL_ACTUATOR_CONTROLS
  std::uint64_t truths() const { return truths_; }
  std::uint64_t samples() const { return samples_; }
  /// Of the newest sample, by which it lives.
  Stamp time() const { return std::chrono::microseconds(last_us_); }

 private:
  void take(Stamp now, const mavlink::HilSensor& sensor);
  void take(const mavlink::HilStateQuaternion& truth);

  const std::unique_ptr<firmware::Link> link_;
  MavlinkController& controller_;
  const Clock clock_;
  mavlink::FrameReader reader_;
  firmware::Site site_;
  std::uint64_t last_us_ = 0, samples_ = 0, truths_ = 0;
  Stamp last_{0}, answered_{0};
  std::uint8_t sequence_ = 0;
  bool greeted_;
};

}  // namespace gatefield::test
