#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/bridge/mavlink/dialect.h"
#include "client/firmware/link/link.h"
#include "client/firmware/mavlink/frame.h"
#include "client/firmware/mavlink/frame_reader.h"
#include "common/vehicle/quadrotor.h"
#include "tests/support/rate_controller.h"

namespace gatefield::test {

namespace mavlink = firmware::mavlink;

/// RateController behind MAVLink, as an autopilot with an estimator would be: heartbeats, time, parameters, commands
/// with acknowledgements, attitude targets in, odometry and status out. It boots `boot` before the test's clock began,
/// and its clock runs at its own rate.
class MavlinkController {
 public:
  explicit MavlinkController(std::unique_ptr<firmware::Link> link, bridge::Dialect dialect,
                             const RateController::Options& loop = {});

  /// Takes up what was sent and sends what is due.
  void serve(Stamp now);
  RateController& loop() { return loop_; }

  // What the test says.
  QuadrotorState state;  ///< by its estimator; ENU and FLU as everywhere here
  double specific_force_z = 9.81;
  double battery_v = 15.5;
  bool on_ground = true;
  std::array<std::uint16_t, 18> radio_us{1500, 1500, 1000, 1500, 1000, 1000, 1000, 1000};
  std::uint8_t radio_channels = 8;  ///< 0: no radio
  std::uint8_t system_status = 3;   ///< MAV_STATE_STANDBY
  mavlink::Address address{1, 1};
  Stamp boot{std::chrono::seconds(40)};  ///< so long before the test's time 0
  double clock_rate = 1.0;
  Stamp stamps_off{0};       ///< added to stamps of states
  bool unix_stamps = false;  ///< ODOMETRY counts from 1970
  bool silent = false;       ///< it hears and acts, and says nothing
  bool answers_time = true;
  bool sends_odometry = true;  ///< else it refuses to, and sends the two others
  std::uint8_t child_frame = 12;
  bool hil = false;  ///< its sensors are a simulator's
  std::map<std::string, mavlink::ParamValue> parameters;
  std::map<std::uint16_t, mavlink::CommandResult> refuses;  ///< commands, and with what
  std::map<std::uint16_t, int> overhears;                   ///< so many of these commands are not answered
  std::function<void(mavlink::Message*)> bends;             ///< done to each message that it sends

  // What the test sees.
  bool armed() const { return loop_.armed(); }
  bool follows() const { return follows_; }
  void leave_mode() { follows_ = false; }  ///< as a person does with the radio
  std::map<std::uint32_t, int> heard;      ///< how many of each message
  std::vector<mavlink::CommandLong> commands;
  std::optional<mavlink::SetAttitudeTarget> target;

  void send(const mavlink::Message& message, mavlink::Address from);
  void send(const mavlink::Message& message) { send(message, address); }

 private:
  void take(Stamp now, const mavlink::Message& message);
  void take(Stamp now, const mavlink::CommandLong& command);
  mavlink::CommandResult obey(Stamp now, const mavlink::CommandLong& command);
  void send_states(Stamp now);
  void send_status(Stamp now);
  Stamp own_time(Stamp now) const;
  bool due(Stamp now, std::uint32_t message);

  const std::unique_ptr<firmware::Link> link_;
  const bridge::Dialect dialect_;
  RateController loop_;
  mavlink::FrameReader reader_;
  std::map<std::uint32_t, Stamp> intervals_, sent_;
  bool follows_ = false;
  std::uint8_t sequence_ = 0;
};

}  // namespace gatefield::test
