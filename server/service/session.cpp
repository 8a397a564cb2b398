#include "server/service/session.h"

#include <cstring>

namespace gatefield::service {

Session::Session(SessionParts parts)
    : request_(std::move(parts.request)),
      id_(parts.id),
      clock_(parts.clock),
      period_(from_seconds(1.0 / parts.planner->profile().control_rate_hz)),
      isa_(std::move(parts.isa)),
      last_heard_(parts.clock->now().count()),
      sight_(request_.camera, request_.course, std::move(parts.memory), parts.sight),
      planner_(std::move(parts.planner)),
      progress_(request_.course),
      ahead_(request_.course),
      gates_(&progress_, request_.course.waypoints.size()),
      disturbance_(planner_->profile().disturbance_time_s) {
  publish_target(progress_);
  command_.vehicle = request_.vehicle;
  command_.session = id_;
  command_.plan_step = from_seconds(planner_->profile().step_s);
  std::strncpy(command_.isa.data(), isa_.c_str(), command_.isa.size() - 1);
  for (std::size_t k = 0; k < protocol::kMaxPlanSteps; ++k) {
    command_.thrust_rate_n_s[k].setZero();
    command_.rotor_thrust_n[k].setZero();
    command_.collective_thrust_n[k] = 0.0;
    command_.body_rates_rad_s[k].setZero();
  }
}

void Session::publish_target(const planner::CourseProgress& progress) noexcept {
  target_.store(std::uint64_t{progress.next()} << 32 | progress.target(), std::memory_order_release);
}

void Session::fill(Stamp now, protocol::Telemetry* telemetry) {
  if (const protocol::PlannerHealth* const health = healths_.read()) last_health_ = *health;
  telemetry->vehicle = request_.vehicle;
  telemetry->session = id_;
  telemetry->server_stamp = now;
  telemetry->health = last_health_;
  telemetry->isa = isa_.substr(0, 15);
  account_.fill(telemetry);
}

}  // namespace gatefield::service
