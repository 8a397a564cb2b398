#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "common/base/random.h"
#include "common/model/bundle.h"
#include "server/perception/learned/encoder_pool.h"
#include "server/pilot/pilot.h"
#include "server/planner/profile.h"

namespace gatefield::pilot::testing {

/// What ships, read once: the race model, the circle and the race profile (with fewer samples, for time).
struct Shipped {
  model::Bundle bundle;
  std::unique_ptr<perception::EncoderPool> encoders;
  planner::Profile profile;
  protocol::SessionRequest request;
  Eigen::Vector3d start_p_WB;
  double start_yaw_rad;
};
const Shipped& shipped();

/// What a flight is unlike what the pilot was told.
struct Conditions {
  QuadrotorModel plant;  ///< the vehicle as it is
  Actuation actuation;   ///< how it is driven, told; by body rates its lags are as told
  Eigen::Vector3d wind_W_m_s = Eigen::Vector3d::Zero();
  Stamp each_way{0};  ///< lockstep: delay of the link
  double position_sigma_m = 0.0, velocity_sigma_m_s = 0.0, attitude_sigma_rad = 0.0, rate_sigma_rad_s = 0.0;
};

/// A race on the shipped circle whose gates stand off, with the real planner and sensor, drawn depth images and the
/// reference dynamics as plant. Everything in it is a matter of the timing and the step: two flights are the same.
///
/// Real time here is events whose times are made up: late states, frames that are looked at between ticks, solve times
/// that vary.
class Flight {
 public:
  /// @param laps  0: as many as the course has
  explicit Flight(protocol::Timing timing, const Conditions& conditions = {}, int laps = 0);

  /// A pilot for this race, new.
  std::unique_ptr<Pilot> make_pilot() const;
  /// Goes on for `steps` of 20 ms. @return every command, as text that tells any two apart
  std::vector<std::string> fly(Pilot* pilot, int steps);

  /// All that the pilots were fed with.
  const std::vector<Event>& events() const noexcept { return events_; }
  /// Where the newest command was aiming.
  std::uint32_t target_waypoint() const noexcept { return command_.health.target_waypoint; }
  std::uint32_t lap() const noexcept { return command_.health.lap; }
  bool done() const noexcept { return command_.health.course_done; }
  /// All that commands told so far.
  protocol::Problems problems() const noexcept { return problems_; }

 private:
  void simulate(Stamp until);
  QuadrotorState estimate();
  void send_state(Pilot* pilot, Stamp at, bool with_frame);
  void send_frame(Pilot* pilot, Stamp at);
  void tick(Pilot* pilot, Stamp at, std::vector<std::string>* commands);
  const Stepping::Answer& feed(Pilot* pilot, Event event);

  protocol::SessionRequest request_;
  Conditions conditions_;
  Random noise_{1, 1};
  protocol::Problems problems_ = 0;
  std::vector<Eigen::Isometry3d> gates_;
  QuadrotorState state_;
  Stamp now_{0};  // vehicle's clock
  int step_ = 0;
  std::uint64_t states_ = 0, frames_ = 0;
  protocol::ThrustRateCommand command_;            // the newest
  std::deque<protocol::ThrustRateCommand> plans_;  // what the vehicle flies, and what comes after it
  Stepping::Answer answer_;
  std::vector<Event> events_;
};

/// A command in full, every bit of it but for its problems: the watches that find them are no part of a saved pilot.
std::string text_of(const protocol::ThrustRateCommand& command);

}  // namespace gatefield::pilot::testing
