#include "common/vehicle/quadrotor.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/text.h"

namespace gatefield {
namespace {

Eigen::Quaterniond rotation_from(const Eigen::Vector3d& angle_B) noexcept {
  const double half = 0.5 * angle_B.norm();
  // sin(x)/x by its series near 0, where the quotient loses all digits
  const double sinc = half < 1e-6 ? 0.5 * (1.0 - half * half / 6.0) : 0.5 * std::sin(half) / half;
  return {std::cos(half), sinc * angle_B.x(), sinc * angle_B.y(), sinc * angle_B.z()};
}

struct Derivative {
  Eigen::Vector3d v;
  Eigen::Vector3d a;
  Eigen::Vector4d q;  // x y z w
  Eigen::Vector3d dw;
};

Derivative derive(const QuadrotorModel& model, const QuadrotorState& state) noexcept {
  const Wrench wrench = aerodynamic_wrench(model, state);
  Derivative d;
  d.v = state.v_WB;
  d.a = wrench.force_W / model.mass_kg - Eigen::Vector3d(0, 0, kGravity_m_s2);
  const Eigen::Quaterniond w(0, state.w_WB_B.x(), state.w_WB_B.y(), state.w_WB_B.z());
  d.q = 0.5 * (state.q_WB * w).coeffs();
  const Eigen::Vector3d J = model.inertia_kg_m2;
  d.dw = (wrench.torque_B - state.w_WB_B.cross(J.cwiseProduct(state.w_WB_B))).cwiseQuotient(J);
  return d;
}

QuadrotorState advance(const QuadrotorState& state, const Derivative& d, double dt_s) noexcept {
  QuadrotorState next = state;
  next.p_WB += dt_s * d.v;
  next.v_WB += dt_s * d.a;
  next.q_WB.coeffs() += dt_s * d.q;
  next.w_WB_B += dt_s * d.dw;
  return next;
}

constexpr double kTriangleTolerance = 1e-6;           ///< relative; what arithmetic leaves over
constexpr double kLightest = 0.01, kHeaviest = 10.0;  ///< moments of inertia, in m a^2
constexpr double kLeastYaw = 1e-3;                    ///< torque per thrust, in a

Error wrong(const std::string& field, const std::string& value, const std::string& expected) {
  return Error::invalid("quadrotor." + field, value, expected);
}
Error wrong(const std::string& field, double value, const std::string& expected) {
  return wrong(field, text(value), expected);
}

double longest_arm_m(const QuadrotorModel& model) {
  double arm_m = 0.0;
  for (const PlainVector2& p_B : model.rotor_position_B_m) arm_m = std::max(arm_m, p_B.norm());
  return arm_m;
}

/// Smallest singular value over the largest.
template <typename Matrix>
double authority(const Matrix& wrench) {
  const auto values = Eigen::JacobiSVD<Eigen::MatrixXd>(wrench).singularValues();
  return values[values.size() - 1] / values[0];
}

Status validate_body(const QuadrotorModel& model) {
  const double arm_m = longest_arm_m(model), unit = model.mass_kg * arm_m * arm_m;
  const Eigen::Vector3d& J = model.inertia_kg_m2;
  for (int i = 0; i < 3; ++i) {
    constexpr const char* kAxes[] = {"[0]", "[1]", "[2]"};
    const char* const axis = kAxes[i];
    if (!(J[i] >= kLightest * unit && J[i] <= kHeaviest * unit))
      return wrong(std::string("inertia_kg_m2").append(axis), J[i],
                   text(kLightest * unit) + " to " + text(kHeaviest * unit) +
                       " kg m^2, 0.01 to 10 times mass and longest arm squared");
    const double others = J.sum() - J[i];
    if (J[i] > others * (1.0 + kTriangleTolerance))
      return wrong(std::string("inertia_kg_m2").append(axis), J[i],
                   "at most " + text(others) +
                       " kg m^2, the sum of the other two: no rigid body has more (triangle rule of inertias)");
    const double most_kg_s = model.mass_kg / kLongestStep_s;
    if (!(model.drag_kg_s[i] <= most_kg_s))
      return wrong(std::string("drag_kg_s").append(axis), model.drag_kg_s[i],
                   "0 to " + text(most_kg_s) + " kg/s, the mass over the planner's longest step of " +
                       text(kLongestStep_s) + " s: more would turn the speed around within a step");
  }
  return {};
}

/// Says of a layout that can't make every wrench which field is to blame.
Status validate_mixer(const QuadrotorModel& model) {
  const double arm_m = longest_arm_m(model);
  Eigen::Matrix4d W;
  for (int i = 0; i < kRotors; ++i) {
    const auto rotor = static_cast<std::size_t>(i);
    const Eigen::Vector2d place = model.rotor_position_B_m[rotor] / arm_m;
    W.col(i) << 1.0, place.y(), -place.x(), model.rotor_spin[rotor];
  }
  if (authority(W) < kMinAuthority) {
    for (int i = 0; i < kRotors; ++i)
      for (int j = 0; j < i; ++j)
        if ((W.col(i) - W.col(j)).norm() < kMinAuthority)
          return wrong("rotor_position_B_m[" + std::to_string(i) + "]",
                       text(model.rotor_position_B_m[static_cast<std::size_t>(i)]),
                       "another place than rotor " + std::to_string(j) +
                           " with the same spin has: together they can't make all of thrust and torques");
    if (authority(W.topRows<3>()) < kMinAuthority)
      return Error::invalid("quadrotor.rotor_position_B_m", "nearly on one line",
                            "rotors around the centre, so that they make roll and pitch");
    const auto& spin = model.rotor_spin;
    return wrong("rotor_spin", text(Eigen::Vector4d(spin[0], spin[1], spin[2], spin[3])),
                 "spins that make yaw without thrust, roll or pitch: rotors across from each other alike, "
                 "neighbours opposite");
  }
  if (model.torque_per_thrust_m < kLeastYaw * arm_m)
    return wrong("torque_per_thrust_m", model.torque_per_thrust_m,
                 "at least " + text(kLeastYaw * arm_m) + " m, a thousandth of the longest arm");
  const Eigen::Vector4d hover_n = W.partialPivLu().solve(Eigen::Vector4d(model.mass_kg * kGravity_m_s2, 0, 0, 0));
  for (int i = 0; i < kRotors; ++i)
    if (!(hover_n[i] >= model.thrust_min_n && hover_n[i] <= model.thrust_max_n))
      return Error::invalid("quadrotor.rotor_position_B_m",
                            "such that rotor " + std::to_string(i) + " hovers with " + text(hover_n[i]) + " N",
                            text(model.thrust_min_n) + " to " + text(model.thrust_max_n) +
                                " N of each rotor: the centre of mass lies amid the rotors");
  return {};
}

}  // namespace

Status validate(const QuadrotorModel& model) {
  if (!(model.mass_kg > 0 && model.mass_kg <= 100))
    return wrong("mass_kg", model.mass_kg, "more than 0 and at most 100 kg");
  for (int i = 0; i < 3; ++i) {
    if (!(model.inertia_kg_m2[i] > 0 && model.inertia_kg_m2[i] <= 100))
      return wrong("inertia_kg_m2[" + std::to_string(i) + "]", model.inertia_kg_m2[i],
                   "more than 0 and at most 100 kg m^2");
    if (!(model.drag_kg_s[i] >= 0 && model.drag_kg_s[i] <= 100))
      return wrong("drag_kg_s[" + std::to_string(i) + "]", model.drag_kg_s[i], "0 to 100 kg/s");
  }
  for (int i = 0; i < kRotors; ++i) {
    const double arm_m = model.rotor_position_B_m[static_cast<std::size_t>(i)].norm();
    if (!(arm_m >= 0.01 && arm_m <= 5))
      return wrong("rotor_position_B_m[" + std::to_string(i) + "]", arm_m, "an arm of 0.01 to 5 m");
    const int spin = model.rotor_spin[static_cast<std::size_t>(i)];
    if (spin != 1 && spin != -1) return wrong("rotor_spin[" + std::to_string(i) + "]", spin, "+1 or -1");
  }
  if (!(model.torque_per_thrust_m > 0 && model.torque_per_thrust_m <= 1))
    return wrong("torque_per_thrust_m", model.torque_per_thrust_m, "more than 0 and at most 1 m");
  if (!(model.thrust_min_n >= 0)) return wrong("thrust_min_n", model.thrust_min_n, "at least 0 N");
  if (!(model.thrust_max_n > model.thrust_min_n && model.thrust_max_n <= 1000))
    return wrong("thrust_max_n", model.thrust_max_n, "more than thrust_min_n and at most 1000 N");
  const double weight_n = model.mass_kg * kGravity_m_s2;
  if (kRotors * model.thrust_max_n <= 1.1 * weight_n)
    return wrong("thrust_max_n", model.thrust_max_n,
                 "more than " + text(1.1 * weight_n / kRotors) +
                     " N per rotor, 1.1 times the weight in all, for a vehicle of " + text(model.mass_kg) +
                     " kg to fly");
  if (kRotors * model.thrust_min_n >= weight_n)
    return wrong("thrust_min_n", model.thrust_min_n, "less than a quarter of the weight");
  if (!(model.thrust_rate_max_n_s > 0 && model.thrust_rate_max_n_s <= 1e5))
    return wrong("thrust_rate_max_n_s", model.thrust_rate_max_n_s, "more than 0 and at most 1e5 N/s");
  if (!(model.rotor_time_constant_s >= 0.001 && model.rotor_time_constant_s <= 1))
    return wrong("rotor_time_constant_s", model.rotor_time_constant_s, "0.001 to 1 s");
  if (!(model.collision_radius_m > 0 && model.collision_radius_m <= 2))
    return wrong("collision_radius_m", model.collision_radius_m, "more than 0 and at most 2 m");
  for (int i = 0; i < 3; ++i)
    if (!(model.body_rate_max_rad_s[i] >= 0 && model.body_rate_max_rad_s[i] <= 100))
      return wrong("body_rate_max_rad_s[" + std::to_string(i) + "]", model.body_rate_max_rad_s[i],
                   "0 (the planner's own limit) to 100 rad/s");
  if (Status body = validate_body(model); !body) return body;
  return validate_mixer(model);
}

std::optional<std::string> mend_inertia(QuadrotorModel* model) {
  Eigen::Vector3d& J = model->inertia_kg_m2;
  constexpr const char* kAxes[] = {"xx", "yy", "zz"};
  for (int i = 0; i < 3; ++i) {
    const double others = J.sum() - J[i];
    if (!(J[i] > others && J[i] <= others * (1.0 + kRoundedInertia))) continue;
    const double told = J[i];
    J[i] = J[(i + 1) % 3] + J[(i + 2) % 3];
    return std::string("inertia_kg_m2.") + kAxes[i] + " is " + text(told) + ", taken as " + text(J[i]) +
           ", the sum of the other two: no rigid body has more, and " + fixed(100.0 * (told / others - 1.0), 2) +
           " % more is taken for rounding";
  }
  return std::nullopt;
}

PlainVector4 hover_thrust_n(const QuadrotorModel& model) {
  return PlainVector4::Constant(model.mass_kg * kGravity_m_s2 / kRotors);
}

Eigen::Vector3d rotor_torque_B(const QuadrotorModel& model, const PlainVector4& thrust_n) {
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < kRotors; ++i) {
    const double T = thrust_n[static_cast<Eigen::Index>(i)];
    torque.x() += model.rotor_position_B_m[i].y() * T;
    torque.y() -= model.rotor_position_B_m[i].x() * T;
    torque.z() += model.rotor_spin[i] * model.torque_per_thrust_m * T;
  }
  return torque;
}

Wrench aerodynamic_wrench(const QuadrotorModel& model, const QuadrotorState& state, const Eigen::Vector3d& wind_W) {
  const Eigen::Matrix3d R_WB = state.q_WB.normalized().toRotationMatrix();
  const Eigen::Vector3d v_B = R_WB.transpose() * (state.v_WB - wind_W);
  const Eigen::Vector3d force_B = Eigen::Vector3d(0, 0, state.thrust_n.sum()) - model.drag_kg_s.cwiseProduct(v_B);
  return {R_WB * force_B, rotor_torque_B(model, state.thrust_n)};
}

void step_rotors(const QuadrotorModel& model, const ThrustRates& u, double dt_s, QuadrotorState* state) noexcept {
  const double decay = std::exp(-dt_s / model.rotor_time_constant_s);
  for (int i = 0; i < kRotors; ++i) {
    const double rate = std::clamp(u[i], -model.thrust_rate_max_n_s, model.thrust_rate_max_n_s);
    const double old_command = state->thrust_command_n[i];
    const double command = std::clamp(old_command + rate * dt_s, model.thrust_min_n, model.thrust_max_n);
    const double lag = (command - old_command) / dt_s * model.rotor_time_constant_s;
    state->thrust_n[i] = command - lag + (state->thrust_n[i] - old_command + lag) * decay;
    state->thrust_command_n[i] = command;
  }
}

QuadrotorState step_reference(const QuadrotorModel& model, const QuadrotorState& state, const ThrustRates& u,
                              double dt_s) noexcept {
  QuadrotorState half = state;
  step_rotors(model, u, 0.5 * dt_s, &half);
  QuadrotorState full = state;
  step_rotors(model, u, dt_s, &full);
  const auto with_rotors = [](QuadrotorState body, const QuadrotorState& rotors) {
    body.thrust_n = rotors.thrust_n;
    body.thrust_command_n = rotors.thrust_command_n;
    return body;
  };
  const Derivative k1 = derive(model, state);
  const Derivative k2 = derive(model, with_rotors(advance(state, k1, 0.5 * dt_s), half));
  const Derivative k3 = derive(model, with_rotors(advance(state, k2, 0.5 * dt_s), half));
  const Derivative k4 = derive(model, with_rotors(advance(state, k3, dt_s), full));
  const Derivative mean{(k1.v + 2 * k2.v + 2 * k3.v + k4.v) / 6, (k1.a + 2 * k2.a + 2 * k3.a + k4.a) / 6,
                        (k1.q + 2 * k2.q + 2 * k3.q + k4.q) / 6, (k1.dw + 2 * k2.dw + 2 * k3.dw + k4.dw) / 6};
  QuadrotorState next = with_rotors(advance(state, mean, dt_s), full);
  next.q_WB.normalize();
  return next;
}

void move_body(const QuadrotorModel& model, const QuadrotorState& before, const Eigen::Vector3d& mean_w_WB_B,
               double mean_thrust_n, double dt_s, QuadrotorState* after) noexcept {
  const Eigen::Quaterniond q_mid = before.q_WB * rotation_from(0.5 * dt_s * mean_w_WB_B);
  after->q_WB = (q_mid * rotation_from(0.5 * dt_s * mean_w_WB_B)).normalized();

  const Eigen::Matrix3d R_WB = q_mid.toRotationMatrix();
  const Eigen::Vector3d v_B = R_WB.transpose() * before.v_WB;
  const Eigen::Vector3d force_B = Eigen::Vector3d(0, 0, mean_thrust_n) - model.drag_kg_s.cwiseProduct(v_B);
  after->v_WB = before.v_WB + dt_s * (R_WB * force_B / model.mass_kg - Eigen::Vector3d(0, 0, kGravity_m_s2));
  after->p_WB = before.p_WB + 0.5 * dt_s * (before.v_WB + after->v_WB);
}

QuadrotorState step_planner(const QuadrotorModel& model, const QuadrotorState& state, const ThrustRates& u,
                            double dt_s) noexcept {
  QuadrotorState next = state;
  step_rotors(model, u, dt_s, &next);
  const Eigen::Vector4d thrust_n = 0.5 * (state.thrust_n + next.thrust_n);

  const Eigen::Vector3d& J = model.inertia_kg_m2;
  const Eigen::Vector3d& w = state.w_WB_B;
  next.w_WB_B = w + dt_s * (rotor_torque_B(model, thrust_n) - w.cross(J.cwiseProduct(w))).cwiseQuotient(J);
  move_body(model, state, 0.5 * (w + next.w_WB_B), thrust_n.sum(), dt_s, &next);
  return next;
}

}  // namespace gatefield
