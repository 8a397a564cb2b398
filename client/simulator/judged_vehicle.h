#pragma once

#include <memory>

#include "client/simulator/drive.h"
#include "client/simulator/plant.h"
#include "client/simulator/referee.h"
#include "client/simulator/run_log.h"
#include "client/simulator/simulation.h"

namespace gatefield::simulator {

/// The true side of a race: the vehicle in its world, judged by the referee, with what is recorded of it. It knows
/// neither client nor clock; its time is that of the race, and goes on a step at a time. Thread-safe: no.   Real-time
/// safe: advance() yes, in races of up to five minutes (room for more samples is allocated).
class JudgedVehicle {
 public:
  /// @param scenario  outlives this
  /// @param plant     of `world` and the scenario's true vehicle; is put at the start
  JudgedVehicle(const config::Scenario& scenario, const scene::World& world, std::unique_ptr<Plant> plant, Drive drive);

  const QuadrotorState& truth() const noexcept { return plant_->state(); }
  /// What the vehicle could know of it, but for errors of measurement.
  QuadrotorState known() const noexcept { return drive_.known(truth()); }
  bool thrust_known() const noexcept { return drive_.thrust_known(); }
  Eigen::Isometry3d pose() const noexcept;
  Stamp race_time() const noexcept { return race_time_; }
  bool decided() const noexcept { return referee_.decided(); }
  int expected_waypoint() const noexcept { return referee_.expected_waypoint(); }
  std::size_t passes() const noexcept { return referee_.passes().size(); }
  Progress progress() const noexcept;

  /// What the planner says of itself from now on, for the record.
  void note(const protocol::PlannerHealth& health) noexcept { health_ = health; }
  /// Where things are for whoever goes by the state estimate, from now on, for the record.
  void note(const Eigen::Isometry3d& X_EW) noexcept { X_EW_ = X_EW; }
  /// One step of Plant::kStep under the setpoint, seen by the referee and the log.
  void advance(const sdk::Setpoint& setpoint);
  /// Ends the race from outside; no effect when it is decided already.
  void stop(Outcome outcome) noexcept { referee_.stop(outcome, race_time_); }

  /// The report's part of what happened to the vehicle; what client and clock know is left as it is. Only once.
  void fill(Report* report);

 private:
  /// The state of this moment; nothing when there is a sample of it.
  void record(const sdk::Setpoint& setpoint);

  const config::Scenario& scenario_;
  std::unique_ptr<Plant> plant_;
  Drive drive_;
  Referee referee_;
  Stamp race_time_{0};
  Stamp timed_{0};  ///< race_time_, but for the way out of the last gate
  protocol::PlannerHealth health_;
  Eigen::Isometry3d X_EW_ = Eigen::Isometry3d::Identity();
  sdk::Setpoint last_setpoint_;
  std::vector<Sample> samples_;
  double fallback_s_ = 0.0;
  double top_speed_m_s_ = 0.0;
  double distance_m_ = 0.0;
};

}  // namespace gatefield::simulator
