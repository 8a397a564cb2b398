#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/bridge/betaflight/settings.h"
#include "client/firmware/msp/connection.h"
#include "client/flight/ports.h"
#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::bridge::betaflight {

/// Who stands in front of the vehicle.
class Person {
 public:
  virtual ~Person() = default;
  virtual void tell(const std::string& sentence) = 0;
  /// The next line that was typed; empty: none yet. It does not wait.
  virtual std::optional<std::string> answer() = 0;
  /// The person wants to end it.
  virtual bool leaves() = 0;
};

struct GroundCheckOptions {
  Stamp patience{std::chrono::seconds(30)};  ///< for each thing that the person is asked for
  int spin_us = 1080;                        ///< pulse of a motor that is to turn slowly
};

/// Finds a wrong order of motors and a wrong sign before they fly: **propellers off**, disarmed, with a person's hands
/// and eyes, because no board knows by itself how it is mounted and which wire goes to which motor.
///
///   1. Put down: the accelerometer points up. If it does not, this is all that is found.
///   2. Turned by hand to the right, nose down, and to the left: the gyro, the firmware's attitude and (where there is
///      one) the source of states each say just that turn. What each says depends on the firmware's version, too: the
///      sign of the gyro about z is not the same in all.
///   3. Each motor turns alone (MSP_SET_MOTOR), and the person says which it is and which way round, held against the
///      order of quad X and the firmware's yaw_motors_reversed.
///
/// Motors are stopped again whatever happens.
/// @param states  null: there are no states from elsewhere
/// @return what is wrong, a sentence each with the next step; empty: nothing
/// Errors: those of msp::Connection::ask(); kInvalid with field "arming" when it is armed; kNoAnswer with field
/// "person" when the person leaves or does nothing for too long.
/// Thread-safe: no.   Real-time safe: no.
Result<std::vector<std::string>> check_on_the_ground(msp::Connection* connection, const Settings& settings,
                                                     const Clock& clock, Person* person, flight::StateSource* states,
                                                     const GroundCheckOptions& options = {});

}  // namespace gatefield::bridge::betaflight
