#include "server/pilot/state_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gatefield::pilot {
namespace {

using protocol::Problem;
using protocol::Problems;

/// A cause has to leave less than this part of what the states as told leave.
constexpr double kExplains = 0.4;
/// Slower than this, a vehicle whose velocity hardly changes may stand on something.
constexpr double kStanding_m_s = 0.3;
constexpr double kStandingThrust = 0.8;  ///< of the weight: one that hovers carries itself

/// How far the states are from each other over a window, in units of what is tolerated: 1 and less is fine.
struct Misfit {
  double motion = 0.0;
  double thrust = 0.0;
  double rotation = 0.0;
  double sum() const noexcept { return motion + thrust + rotation; }
  double worst() const noexcept { return std::max({motion, thrust, rotation}); }
};

Eigen::Quaterniond turn_by(const Eigen::Vector3d& angle) noexcept {
  const double size = angle.norm();
  if (size < 1e-9) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(size, angle / size));
}

// ---- mistakes, undone -----------------------------------------------------------------------------------------------

QuadrotorState as_told(const QuadrotorState& s) noexcept { return s; }

/// NED and FRD read as ENU and FLU: x north, y east, z down; body y right, z down.
QuadrotorState from_ned(const QuadrotorState& s) noexcept {
  const auto world = [](const Eigen::Vector3d& v) { return Eigen::Vector3d(v.y(), v.x(), -v.z()); };
  // R_ENU,NED: a half turn about (1, 1, 0) / sqrt(2); R_FRD,FLU: a half turn about x.
  const Eigen::Quaterniond q_WN(0.0, M_SQRT1_2, M_SQRT1_2, 0.0), q_FB(0.0, 1.0, 0.0, 0.0);
  QuadrotorState out = s;
  out.p_WB = world(s.p_WB);
  out.v_WB = world(s.v_WB);
  out.q_WB = q_WN * s.q_WB * q_FB;
  out.w_WB_B = {s.w_WB_B.x(), -s.w_WB_B.y(), -s.w_WB_B.z()};
  return out;
}

QuadrotorState from_w_first(const QuadrotorState& s) noexcept {
  QuadrotorState out = s;
  out.q_WB = Eigen::Quaterniond(s.q_WB.x(), s.q_WB.y(), s.q_WB.z(), s.q_WB.w());
  return out;
}

QuadrotorState from_body_velocity(const QuadrotorState& s) noexcept {
  QuadrotorState out = s;
  out.v_WB = s.q_WB * s.v_WB;
  return out;
}

QuadrotorState from_world_rates(const QuadrotorState& s) noexcept {
  QuadrotorState out = s;
  out.w_WB_B = s.q_WB.conjugate() * s.w_WB_B;
  return out;
}

QuadrotorState from_frd_rates(const QuadrotorState& s) noexcept {
  QuadrotorState out = s;
  out.w_WB_B = {s.w_WB_B.x(), -s.w_WB_B.y(), -s.w_WB_B.z()};
  return out;
}

using Undo = QuadrotorState (*)(const QuadrotorState&) noexcept;
struct Mistake {
  Problem problem;
  Undo undo;
};
constexpr std::array<Mistake, 4> kMistakes{{{Problem::kStatesLookNed, from_ned},
                                            {Problem::kQuaternionLooksWFirst, from_w_first},
                                            {Problem::kVelocityLooksBodyFrame, from_body_velocity},
                                            {Problem::kRatesLookWorldFrame, from_world_rates}}};
/// Mistakes after which the rotors' torques don't fit the rates, although the rotors are as told.
constexpr std::array<Undo, 3> kMistakesOfRates{from_ned, from_world_rates, from_frd_rates};

/// Tolerances: what an estimator's noise, a mass or drag that is not as told, and the integration leave.
double motion_tolerance_m(double path_m) noexcept { return 0.15 + 0.25 * path_m; }
double thrust_tolerance_m_s(double pushed_m_s) noexcept { return 1.0 + 0.3 * pushed_m_s; }
double rotation_tolerance_rad(double turned_rad) noexcept { return 0.1 + 0.25 * turned_rad; }
double torque_tolerance_rad_s(double spun_rad_s) noexcept { return 1.5 + 0.5 * spun_rad_s; }

template <typename Nth>
Misfit misfit(const QuadrotorModel& model, const Nth& nth, std::size_t count, Undo undo) noexcept {
  const auto acceleration = [&](const QuadrotorState& s, double* push_m_s2) {
    const Wrench wrench = aerodynamic_wrench(model, s);
    *push_m_s2 = s.thrust_n.sum() / model.mass_kg;
    return Eigen::Vector3d(wrench.force_W / model.mass_kg - Eigen::Vector3d(0, 0, kGravity_m_s2));
  };
  const QuadrotorState first = undo(nth(0).state);
  QuadrotorState before = first;
  double push_before = 0.0;
  Eigen::Vector3d a_before = acceleration(before, &push_before);
  Eigen::Vector3d moved_m = Eigen::Vector3d::Zero(), gained_m_s = Eigen::Vector3d::Zero();
  Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();
  double path_m = 0.0, pushed_m_s = 0.0, turned_rad = 0.0;
  for (std::size_t i = 1; i < count; ++i) {
    const double dt_s = seconds(nth(i).stamp - nth(i - 1).stamp);
    const QuadrotorState now = undo(nth(i).state);
    double push = 0.0;
    const Eigen::Vector3d a = acceleration(now, &push);
    moved_m += 0.5 * dt_s * (before.v_WB + now.v_WB);
    path_m += 0.5 * dt_s * (before.v_WB.norm() + now.v_WB.norm());
    gained_m_s += 0.5 * dt_s * (a_before + a);
    pushed_m_s += 0.5 * dt_s * (push_before + push);
    const Eigen::Vector3d angle = 0.5 * dt_s * (before.w_WB_B + now.w_WB_B);
    turned = turned * turn_by(angle);
    turned_rad += angle.norm();
    before = now;
    a_before = a;
    push_before = push;
  }
  Misfit out;
  out.motion = (before.p_WB - first.p_WB - moved_m).norm() / motion_tolerance_m(path_m);
  out.thrust = (before.v_WB - first.v_WB - gained_m_s).norm() / thrust_tolerance_m_s(pushed_m_s);
  out.rotation = (first.q_WB.conjugate() * before.q_WB).angularDistance(turned) / rotation_tolerance_rad(turned_rad);
  return out;
}

/// What w_n - w_0 leaves of the rotors' torques, over samples begin to count - 1, in units of what is tolerated.
template <typename Nth>
double torque_misfit(const QuadrotorModel& model, const Nth& nth, std::size_t begin, std::size_t count,
                     Undo undo) noexcept {
  const Eigen::Vector3d& J = model.inertia_kg_m2;
  const auto spin_up = [&](const QuadrotorState& s) {
    const Eigen::Vector3d torque_B = rotor_torque_B(model, s.thrust_n) - s.w_WB_B.cross(J.cwiseProduct(s.w_WB_B));
    return Eigen::Vector3d(torque_B.cwiseQuotient(J));
  };
  Eigen::Vector3d gained_rad_s = Eigen::Vector3d::Zero();
  double spun_rad_s = 0.0;
  const Eigen::Vector3d w_begin_rad_s = undo(nth(begin).state).w_WB_B;
  Eigen::Vector3d before = spin_up(undo(nth(begin).state));
  for (std::size_t i = begin + 1; i < count; ++i) {
    const double dt_s = seconds(nth(i).stamp - nth(i - 1).stamp);
    const Eigen::Vector3d now = spin_up(undo(nth(i).state));
    gained_rad_s += 0.5 * dt_s * (before + now);
    spun_rad_s += 0.5 * dt_s * (before.norm() + now.norm());
    before = now;
  }
  const Eigen::Vector3d measured = undo(nth(count - 1).state).w_WB_B - w_begin_rad_s;
  return (measured - gained_rad_s).norm() / torque_tolerance_rad_s(spun_rad_s);
}

}  // namespace

Problems StateWatch::observe(Stamp stamp, const QuadrotorState& state) noexcept {
  const Stamp gap = count_ > 0 ? stamp - nth(count_ - 1).stamp : Stamp{0};
  if (count_ > 0 && (gap <= Stamp{0} || gap > kLongestGap)) {
    count_ = 0;
    in_a_row_.fill(0);
  }
  if (count_ == 0 || gap >= kLeastGap) {
    if (count_ == kCapacity) {
      first_ = (first_ + 1) % kCapacity;
      --count_;
    }
    ring_[(first_ + count_++) % kCapacity] = {stamp, state};
    while (count_ > 2 && stamp - nth(1).stamp >= kWindow) {
      first_ = (first_ + 1) % kCapacity;
      --count_;
    }
    if (stamp >= next_look_ || next_look_ - stamp > kLookPeriod) {
      next_look_ = stamp + kLookPeriod;
      look(stamp);
    }
  }
  Problems now = 0;
  for (std::size_t i = 0; i < until_.size(); ++i)
    if (until_[i] > stamp) now |= Problems{1} << i;
  return now;
}

void StateWatch::tell(Stamp now, Problem problem, bool seen) noexcept {
  const auto i = static_cast<std::size_t>(problem);
  in_a_row_[i] = seen ? std::min(in_a_row_[i] + 1, kEnough) : 0;
  if (in_a_row_[i] == kEnough) until_[i] = now + kStays;
}

void StateWatch::look(Stamp now) noexcept {
  const auto samples = [this](std::size_t i) -> const Sample& { return nth(i); };
  if (count_ < 4 || now - nth(0).stamp < kWindow / 2) return;
  const QuadrotorState& newest = nth(count_ - 1).state;
  const double weight_n = model_.mass_kg * kGravity_m_s2;
  const bool standing = newest.v_WB.norm() < kStanding_m_s && nth(0).state.v_WB.norm() < kStanding_m_s &&
                        newest.thrust_n.sum() < kStandingThrust * weight_n;
  const Misfit told = standing ? Misfit{} : misfit(model_, samples, count_, as_told);
  tell(now, Problem::kVelocityAgainstMotion, told.motion > 1.0);
  tell(now, Problem::kThrustAgainstMotion, told.thrust > 1.0);
  tell(now, Problem::kRatesAgainstAttitude, told.rotation > 1.0);

  std::array<double, kMistakes.size()> remains{};
  double least = told.sum();
  const bool contradicts = told.worst() > 1.0;
  if (contradicts) {
    for (std::size_t i = 0; i < kMistakes.size(); ++i) {
      const Misfit undone = misfit(model_, samples, count_, kMistakes[i].undo);
      remains[i] = undone.worst() <= 1.0 ? undone.sum() : std::numeric_limits<double>::infinity();
      least = std::min(least, remains[i]);
    }
  }
  for (std::size_t i = 0; i < kMistakes.size(); ++i)
    tell(now, kMistakes[i].problem, contradicts && remains[i] == least && remains[i] < kExplains * told.sum());

  tell(now, Problem::kRotorsLookSwapped, rotors_known_ && !standing && rotors_look_swapped(now));
}

bool StateWatch::rotors_look_swapped(Stamp now) const noexcept {
  const auto samples = [this](std::size_t i) -> const Sample& { return nth(i); };
  std::size_t begin = count_ - 1;
  while (begin > 0 && now - nth(begin).stamp < kTorqueWindow) --begin;
  if (now - nth(begin).stamp < kTorqueWindow / 2) return false;
  const double spun = torque_misfit(model_, samples, begin, count_, as_told);
  if (!(spun > 1.0)) return false;

  bool swapped = false;
  QuadrotorModel other = model_;
  std::array<std::size_t, kRotors> order{0, 1, 2, 3};
  do {
    for (const int sign : {1, -1}) {
      for (std::size_t i = 0; i < kRotors; ++i) {
        other.rotor_position_B_m[i] = model_.rotor_position_B_m[order[i]];
        other.rotor_spin[i] = sign * model_.rotor_spin[order[i]];
      }
      const double fits = torque_misfit(other, samples, begin, count_, as_told);
      swapped = swapped || (fits <= 1.0 && fits < kExplains * spun);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  // The states' own mistake goes first where it explains all the rest as well.
  return swapped && std::none_of(kMistakesOfRates.begin(), kMistakesOfRates.end(), [&](Undo undo) {
           return torque_misfit(model_, samples, begin, count_, undo) <= 1.0 &&
                  misfit(model_, samples, count_, undo).worst() <= 1.0;
         });
}

}  // namespace gatefield::pilot
