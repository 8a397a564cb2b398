#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "client/firmware/link/link.h"
#include "client/firmware/mavlink/frame_reader.h"
#include "client/firmware/px4_hil/sensors.h"
#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::firmware {

struct HilOptions {
  std::string address = "tcp-listen:127.0.0.1:4560";  ///< where PX4 connects to, parse_address(); or a serial port
  Stamp connect_timeout{std::chrono::seconds(30)};    ///< until it connects; 100 ms to 10 min
  Stamp boot_timeout{std::chrono::seconds(60)};       ///< from there to its first motor outputs; 1 s to 10 min
  Stamp answer_timeout{std::chrono::seconds(1)};      ///< from then on, for each answer; 10 ms to 60 s
  bool lockstep = true;  ///< each sample waits for its answer; false: the newest counts, for boards in real time
};
/// Says which field is wrong and why.
Status validate(const HilOptions& options);

/// What the firmware tells the motors.
struct HilMotors {
  static constexpr std::size_t kMotors = 4;
  std::array<double, kMotors> outputs{};  ///< 0 to 1, of the first four in the firmware's order; 0: off
  bool armed = false;
  std::uint64_t answers = 0;  ///< messages since the begin
};

/// A firmware that takes its sensors from a simulator over MAVLink (PX4's simulator_mavlink; "Simulation",
/// docs.px4.io): HIL_SENSOR and HIL_GPS out, HIL_ACTUATOR_CONTROLS in. PX4 connects to us. In lockstep its time is that
/// of HIL_SENSOR, and it answers each with one message of motors.
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
  /// Over a link that is there, with a clock for the time limits. @pre validate(options)
  HilLink(const HilOptions& options, std::unique_ptr<Link> link, std::unique_ptr<Clock> clock);

  /// Sends a sample and, in lockstep, waits for the motors that answer it.
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
  Status take(const mavlink::Message& message);
  Error hung(Stamp waited) const;

  HilOptions options_;
  std::unique_ptr<Link> link_;
  std::unique_ptr<Clock> clock_;
  mavlink::FrameReader reader_;
  HilMotors motors_;
  Stamp begin_{0}, answered_at_{0};
  std::array<std::uint8_t, Link::kMaxMessage> buffer_{};
  std::uint8_t sequence_ = 0;
};

}  // namespace gatefield::firmware
