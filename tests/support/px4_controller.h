#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "client/firmware/mavlink/constants.h"
#include "common/dds/px4/messages.h"
#include "common/vehicle/quadrotor.h"
#include "tests/support/rate_controller.h"

namespace gatefield::test {

namespace mavlink = firmware::mavlink;

/// RateController behind PX4's messages, as PX4 would be: offboard mode that wants its stream, commands with
/// acknowledgements, rates in, odometry and status out, and a failsafe when the stream ends.
class Px4Controller {
 public:
  using Say = std::function<void(const px4::Message&)>;
  explicit Px4Controller(Say say, const RateController::Options& loop = {});

  void hear(Stamp now, const px4::OffboardControlMode& message);
  void hear(Stamp now, const px4::VehicleRatesSetpoint& message);
  void hear(Stamp now, const px4::VehicleCommand& message);
  /// Sends what is due. @param wall  its agent's wall clock, since 1970
  void serve(Stamp now, Stamp wall);
  RateController& loop() { return loop_; }

  // What the test says.
  QuadrotorState state;  ///< by its estimator; ENU and FLU as everywhere here
  double specific_force_z = 9.81;
  double battery_v = 15.5;
  bool on_ground = true;
  std::array<std::uint16_t, px4::InputRc::kChannels> radio_us{1500, 1500, 1000, 1500, 1000, 1000, 1000, 1000};
  std::uint8_t radio_channels = 8;  ///< 0: no radio
  std::uint8_t system = 1;
  std::uint8_t velocity_frame = 1;                          ///< px4::VelocityFrame
  Stamp stamps_off{0};                                      ///< added to all stamps
  bool stamps_since_boot = false;                           ///< it does not synchronise
  bool silent = false;                                      ///< it hears and acts, and says nothing
  std::map<std::uint32_t, mavlink::CommandResult> refuses;  ///< commands, and with what
  std::map<std::uint32_t, int> overhears;                   ///< so many of these commands are not answered
  std::function<void(px4::Message*)> bends;                 ///< done to each message that it sends

  // What the test sees.
  bool armed() const { return loop_.armed(); }
  bool follows() const { return nav_state_ == px4::kNavOffboard; }
  bool in_failsafe() const { return loop_.in_failsafe(); }
  void leave_mode() { nav_state_ = kPosition; }  ///< as a person does with the radio
  std::vector<px4::VehicleCommand> commands;
  std::optional<px4::OffboardControlMode> mode;
  std::optional<px4::VehicleRatesSetpoint> target;

  void send(px4::Message message);

 private:
  static constexpr std::uint8_t kPosition = 2, kDescend = 12;  // nav_state
  static constexpr Stamp kOffboardLost{std::chrono::seconds(1)};

  mavlink::CommandResult obey(Stamp now, const px4::VehicleCommand& command);
  bool due(Stamp now, std::string_view topic, Stamp interval);
  void send_states(Stamp now, std::uint64_t stamp_us);
  void send_status(Stamp now, std::uint64_t stamp_us);

  const Say say_;
  RateController loop_;
  std::map<std::string_view, Stamp> sent_;
  std::uint8_t nav_state_ = kPosition;
  std::optional<Stamp> offboard_at_;
};

}  // namespace gatefield::test
