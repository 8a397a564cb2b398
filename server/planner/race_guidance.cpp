#include "server/planner/race_guidance.h"

#include <algorithm>
#include <cmath>

#include "server/gates/gate_size.h"

namespace gatefield::planner {
namespace {

/// The gate passed last is out of the way beyond this distance; a larger one later, by as much as it is larger.
constexpr double kPassedGateNear_m = 3.0;
/// Of the room that an opening smaller than usual leaves around the vehicle, at most so much is asked for as margin,
/// and so much in all where the field is old: rollouts have to find a way through that costs nothing, and they scatter.
constexpr double kMostMargin = 0.4, kMostInAll = 0.55;
constexpr double kDetourSwitch_m = 0.4;
/// Of a gate whose way in is behind the vehicle: beyond its plane and no longer in it.
constexpr float kJustBeyond_m = 0.01f;

bool one_gate(const GateBelief& a, const GateBelief& b) noexcept {
  return (a.center_W - b.center_W).norm() < a.shape.outer_half_m;
}
bool same_way(const GateBelief& a, const GateBelief& b) noexcept { return a.axis_W.dot(b.axis_W) > 0.0; }

}  // namespace

Tightening tighten(const Profile& profile, const PlanInput& input) noexcept {
  const double distance_m = (input.start.p_WB - input.target.center_W).norm();
  Tightening out;
  out.speed_limit_m_s = input.speed_limit_m_s > 0 ? input.speed_limit_m_s : profile.speed_limit_m_s;
  if (input.hold) {
    out.speed_limit_m_s = std::min(out.speed_limit_m_s, std::max(0.5, 1.5 * std::sqrt(distance_m)));
  } else if (distance_m < profile.near_m && !input.target.seen) {
    out.speed_limit_m_s *= profile.unseen_speed_factor;
  } else if (distance_m < profile.near_m) {
    const double span_s = profile.field_stale_s - profile.field_fresh_s;
    const double stale = std::clamp((input.field_age_s - profile.field_fresh_s) / span_s, 0.0, 1.0);
    out.speed_limit_m_s *= 1.0 - stale * (1.0 - profile.stale_speed_factor);
    out.extra_clearance_m = stale * profile.stale_extra_clearance_m;
  }
  return out;
}

RaceGuidance::RaceGuidance(const Profile& profile, const QuadrotorModel& model, const Course& course,
                           double cone_angle_rad)
    : profile_(profile),
      height_reference_m_(height_reference_m(course)),
      collision_radius_m_(model.collision_radius_m),
      body_rate_limit_rad_s_(model.body_rate_max_rad_s.cast<float>()),
      cone_slope_(static_cast<float>(std::tan(cone_angle_rad))) {}

Guidance RaceGuidance::guide(const GateBelief& gate, bool hold, double side) const noexcept {
  return make_guidance(gate.center_W, gate.axis_W, profile_.funnel && !hold, profile_.funnel_half_angle_rad,
                       gates::gate_size(gate.shape) * profile_.funnel_distance_m, gate.shape.outer_half_m, side);
}

FrameSize RaceGuidance::frame_of(const GateBelief& gate) const noexcept {
  return {.inner_half_m = static_cast<float>(gate.shape.inner_half_m),
          .width_m = static_cast<float>(gate.shape.outer_half_m - gate.shape.inner_half_m),
          .slab_half_m = static_cast<float>(0.5 * gate.shape.thickness_m + collision_radius_m_)};
}

PlanContext RaceGuidance::context(const PlanInput& input) noexcept {
  PlanContext context;
  const Eigen::Vector3d& p = input.start.p_WB;
  const GateBelief& target = input.target;

  const Eigen::Vector3d beside = target.axis_W.cross(Eigen::Vector3d::UnitZ());
  const double offset_m = (p - target.center_W).dot(beside);
  if (std::abs(offset_m) > kDetourSwitch_m) detour_side_ = offset_m > 0 ? 1.0 : -1.0;

  context.target = guide(target, input.hold, detour_side_);
  context.frame = frame_of(target);
  context.target_size = static_cast<float>(gates::gate_size(target.shape));
  context.hold = input.hold;
  context.start_p_WB = p.cast<float>();
  context.start_along_m = context.target.along(context.start_p_WB.x(), context.start_p_WB.y(), context.start_p_WB.z());
  context.cone_slope = cone_slope_;

  context.has_next = input.has_next;
  if (input.has_next) {
    context.next_size = static_cast<float>(gates::gate_size(input.next.shape));
    // When the next gate's way in is on its far side, the way leads around it on the side that is nearer.
    const Eigen::Vector3d across = input.next.axis_W.cross(Eigen::Vector3d::UnitZ());
    const double side = (target.center_W - input.next.center_W).dot(across) >= 0 ? 1.0 : -1.0;
    const bool around_again = one_gate(target, input.next) && same_way(target, input.next);
    context.next = guide(input.next, input.hold, around_again ? detour_side_ : side);
    if (around_again) {
      context.next.beyond_m = 0.0f;
      context.next_from_m = kJustBeyond_m;
    }
  }
  context.has_passed_gate =
      input.has_passed_gate && (p - input.passed_gate.center_W).norm() <
                                   kPassedGateNear_m * std::max(1.0, gates::gate_size(input.passed_gate.shape));
  if (context.has_passed_gate && !input.hold && one_gate(target, input.passed_gate)) {
    const bool behind = same_way(target, input.passed_gate) && context.start_along_m >= 0.0f;
    context.has_passed_gate = behind;
    if (behind) context.target.beyond_m = 0.0f;
  }
  if (context.has_passed_gate) {
    context.passed_gate = guide(input.passed_gate, input.hold, 1.0);
    context.passed_frame = frame_of(input.passed_gate);
  }

  context.lowest_m = static_cast<float>(height_reference_m_ + profile_.altitude_min_m);
  context.highest_m = static_cast<float>(height_reference_m_ + profile_.altitude_max_m);
  context.body_rate_limit_rad_s = body_rate_limit_rad_s_;

  const Tightening care = tighten(profile_, input);
  context.speed_limit_m_s = static_cast<float>(care.speed_limit_m_s);
  const auto need_m = [&](const GateBelief& gate) {
    const double size = gates::gate_size(gate.shape);
    double margin_m = profile_.crossing_margin_m,
           extra_m = size * care.extra_clearance_m;  // an old field's error: the gate's
    if (size < 1.0) {
      const double room_m = std::max(0.0, gate.shape.inner_half_m - collision_radius_m_);
      margin_m = std::min(margin_m, kMostMargin * room_m);
      extra_m = std::min(extra_m, kMostInAll * room_m - margin_m);
    }
    return static_cast<float>(collision_radius_m_ + margin_m + extra_m);
  };
  context.crossing_need_m = need_m(target);
  context.passed_need_m = need_m(input.passed_gate);

  if (target.field != nullptr) {
    float s = 0.0f;
    const Eigen::Vector3f& p0 = context.start_p_WB;
    target.field->evaluate({&p0.x(), 1}, {&p0.y(), 1}, {&p0.z(), 1}, {&s, 1});
    context.start_clearance_m = s - std::abs(context.start_along_m) * cone_slope_;
  } else {
    const Eigen::Vector3d off = p - target.center_W;
    context.start_clearance_m =
        static_cast<float>(target.shape.inner_half_m - (off - off.dot(target.axis_W) * target.axis_W).norm());
  }
  return context;
}

}  // namespace gatefield::planner
