#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "client/firmware/link/link.h"
#include "client/firmware/mavlink/frame_reader.h"
#include "client/firmware/px4_hil/hil_motors.h"
#include "client/firmware/px4_hil/hil_options.h"
#include "client/firmware/px4_hil/sensors.h"
#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::firmware {

/// A firmware that takes its sensors from a simulator over MAVLink (PX4's simulator_mavlink; "Simulation",
/// docs.px4.io), in lockstep: HIL_SENSOR and HIL_GPS out, HIL_ACTUATOR_CONTROLS in. PX4 connects to us. Its time is
/// that of HIL_SENSOR, and it answers each with one message of motors.
///
/// PX4's motors of an X frame are front right, rear left, front left, rear right, the first two turning
/// counter-clockwise seen from above: they push the body about -z (FLU).
///
/// While it boots it answers nothing, and needs samples at about the pace of real time; exchange() gives motors that
/// are off then. After its first answer each exchange waits at most answer_timeout of the clock: a firmware that hangs
/// is told, and the flight ends there.
/// Thread-safe: no.   Real-time safe: no (it waits).
class HilLink {
 public:
  /// Listens, and waits until the firmware has connected.
  /// Errors: those of validate(options) and open(); kNoAnswer with field "address" when nobody connects.
  static Result<std::unique_ptr<HilLink>> open(const HilOptions& options);
  /// Over a link that is there, with a clock for the time limits. @pre validate(options), !is_board(options)
  HilLink(const HilOptions& options, std::unique_ptr<Link> link, std::unique_ptr<Clock> clock);

  /// Sends a sample and waits for the motors that answer it.
  /// Errors: kNotAnswering when nothing comes in time or the firmware hung up; kInvalid for outputs that are no numbers
  /// or out of range.
  Result<HilMotors> exchange(const mavlink::HilSensor& sensor, const std::optional<mavlink::HilGps>& gps,
                             const std::optional<mavlink::HilStateQuaternion>& truth = std::nullopt);

  bool answered() const noexcept { return motors_.answers > 0; }
  const mavlink::ReaderCounts& counts() const noexcept { return reader_.counts(); }
  std::uint16_t local_port() const noexcept { return link_->local_port(); }

 private:
  Status send(const mavlink::Message& message);
  Status receive();
  Error hung(Stamp waited) const;

  HilOptions options_;
  std::unique_ptr<Link> link_;
  std::unique_ptr<Clock> clock_;
  mavlink::FrameReader reader_;
  HilMotors motors_;
  Stamp begin_{0};
  std::array<std::uint8_t, Link::kMaxMessage> buffer_{};
  std::uint8_t sequence_ = 0;
};

}  // namespace gatefield::firmware
