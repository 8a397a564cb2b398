#pragma once

#include <cstdint>
#include <memory>

#include "client/firmware/link/link.h"
#include "client/firmware/mavlink/frame_reader.h"
#include "client/firmware/px4_hil/sensors.h"
#include "tests/support/mavlink_controller.h"

namespace gatefield::test {

/// The simulator's side of a MavlinkController: its gyro is HIL_SENSOR's, its motors go out as HIL_ACTUATOR_CONTROLS,
/// one for each sample, and its estimator is HIL_STATE_QUATERNION's truth. Speaks first, as PX4 does.
class HilFirmware {
 public:
  HilFirmware(std::unique_ptr<firmware::Link> simulator, MavlinkController* controller)
      : link_(std::move(simulator)), controller_(*controller) {}

  /// Takes up what the simulator sent. @param now  the controller's
  void serve(Stamp now);

  bool hangs = false;  ///< it takes samples and answers none
  std::uint64_t samples() const { return samples_; }
  /// Of the newest sample, by which it lives.
  Stamp time() const { return std::chrono::microseconds(last_us_); }

 private:
  void take(Stamp now, const mavlink::HilSensor& sensor);
  void take(const mavlink::HilStateQuaternion& truth);

  const std::unique_ptr<firmware::Link> link_;
  MavlinkController& controller_;
  mavlink::FrameReader reader_;
  firmware::Site site_;
  std::uint64_t last_us_ = 0, samples_ = 0;
  std::uint8_t sequence_ = 0;
  bool greeted_ = false;
};

}  // namespace gatefield::test
