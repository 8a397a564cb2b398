#include "client/simulator/judged_vehicle.h"

#include <algorithm>

namespace gatefield::simulator {
namespace {

constexpr Stamp kSamplePeriod = std::chrono::milliseconds(10);

Rules rules_of(const config::Scenario& scenario) {
  Rules rules;
  rules.laps = scenario.track.course.laps;
  rules.flight_volume = scenario.track.flight_volume;
  rules.hull = hull_of(scenario.vehicle, scenario.hull);
  rules.time_limit = scenario.time_limit;
  return rules;
}

}  // namespace

JudgedVehicle::JudgedVehicle(const config::Scenario& scenario, const scene::World& world, std::unique_ptr<Plant> plant,
                             Drive drive)
    : scenario_(scenario),
      plant_(std::move(plant)),
      drive_(std::move(drive)),
      referee_(world, config::passages(scenario.track.course), rules_of(scenario), start_state(scenario).p_WB) {
  QuadrotorState start = start_state(scenario);
  start.thrust_n = start.thrust_command_n = plant_->hover_setting_n();
  plant_->set_state(start);
  samples_.reserve(
      static_cast<std::size_t>(std::min<Stamp>(scenario.time_limit, std::chrono::minutes(5)) / kSamplePeriod) + 2);
}

Eigen::Isometry3d JudgedVehicle::pose() const noexcept {
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  X_WB.linear() = truth().q_WB.toRotationMatrix();
  X_WB.translation() = truth().p_WB;
  return X_WB;
}

Progress JudgedVehicle::progress() const noexcept {
  const Course& course = scenario_.track.course;
  return {seconds(race_time_),
          referee_.lap(),
          course.laps,
          referee_.expected_waypoint(),
          static_cast<int>(course.waypoints.size()),
          truth().v_WB.norm()};
}

void JudgedVehicle::advance(const sdk::Setpoint& setpoint) {
  if (setpoint.source == sdk::Setpoint::Source::kFallback) fallback_s_ += seconds(Plant::kStep);
  if (race_time_ % kSamplePeriod == Stamp{0}) record(setpoint);
  const bool racing = !referee_.passed_all();
  drive_.step(setpoint, plant_.get());
  const double speed_m_s = truth().v_WB.norm();
  race_time_ += Plant::kStep;
  referee_.update(race_time_, truth(), plant_->contact());
  last_setpoint_ = setpoint;
  if (!racing) return;
  top_speed_m_s_ = std::max(top_speed_m_s_, speed_m_s);
  distance_m_ += speed_m_s * seconds(Plant::kStep);
  timed_ = race_time_;
  if (referee_.passed_all()) record(setpoint);
}

void JudgedVehicle::record(const sdk::Setpoint& setpoint) {
  const double t_s = seconds(race_time_);
  if (!samples_.empty() && samples_.back().t_s == t_s) return;  // the end of the race, on the grid of the samples
  samples_.push_back({t_s, truth(), setpoint, referee_.expected_waypoint(), referee_.lap(), health_, X_EW_});
}

void JudgedVehicle::fill(Report* report) {
  record(last_setpoint_);
  report->seed = scenario_.seed;
  report->planner_seed = config::planner_seed_of(scenario_);
  report->actuation = scenario_.vehicle.actuation;
  report->mismatch = scenario_.mismatch;
  report->world = config::in_words(scenario_.hard.parts);
  report->outcome = referee_.outcome();
  report->sentence = referee_.sentence();
  report->passes = referee_.passes();
  report->gates_total = referee_.gates_total();
  report->lap_times_s = referee_.lap_times_s();
  report->race_time_s = seconds(referee_.end_time());
  report->top_speed_m_s = top_speed_m_s_;
  report->mean_speed_m_s = timed_ > Stamp{0} ? distance_m_ / seconds(timed_) : 0.0;
  report->hull = scenario_.hull;
  report->clearance_m = referee_.clearance_m();
  report->missed_gates = referee_.missed_gates();
  report->retries = referee_.retries();
  report->culprit = referee_.culprit();
  report->end_state = truth();
  report->contacts = report->outcome == Outcome::kTouchedGate || report->outcome == Outcome::kTouchedFloor ||
                     report->outcome == Outcome::kTouchedClutter;
  report->fallback_s = fallback_s_;
  report->samples = std::move(samples_);
}

}  // namespace gatefield::simulator
