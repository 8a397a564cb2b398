#include "server/pilot/state_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "common/base/random.h"

namespace gatefield::pilot {
namespace {

using protocol::bit;
using protocol::Problem;
using protocol::Problems;
using namespace std::chrono_literals;

/// A flight without a planner: hover, then lean forward, roll to the left and turn, by torques from the rotors.
class Flight {
 public:
  /// @param believed  what its controller takes the rotors for
  explicit Flight(const QuadrotorModel& model = {}, const QuadrotorModel& believed = {})
      : model_(model), believed_(believed) {
    state_.p_WB = {2, -1, 1.5};
    state_.q_WB = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ());
    state_.thrust_n = state_.thrust_command_n = hover_thrust_n(model_);
  }

  /// 10 ms on. Attitude angles are led by a PD law through the mixer, so that torques come from thrusts.
  const QuadrotorState& step(double t_s) {
    for (int i = 0; i < 10; ++i) {
      const double lean = 0.5 * std::sin(2.5 * t_s), roll = 0.4 * std::sin(1.9 * t_s);
      const Eigen::Quaterniond goal = Eigen::AngleAxisd(0.7 + 0.8 * t_s, Eigen::Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
      const Eigen::AngleAxisd off(state_.q_WB.conjugate() * goal);
      const double angle = off.angle() > std::numbers::pi ? off.angle() - 2 * std::numbers::pi : off.angle();
      const Eigen::Vector3d spin = 60.0 * angle * off.axis() - 12.0 * state_.w_WB_B;
      const Eigen::Vector3d torque_B = model_.inertia_kg_m2.cwiseProduct(spin);
      Eigen::Vector4d thrust_n = (1.2 + 0.2 * std::sin(3 * t_s)) * hover_thrust_n(model_);
      for (std::size_t r = 0; r < kRotors; ++r) {
        const auto& p = believed_.rotor_position_B_m[r];
        thrust_n[static_cast<Eigen::Index>(r)] +=
            0.25 * (torque_B.x() / p.y() - torque_B.y() / p.x() +
                    torque_B.z() / (believed_.rotor_spin[r] * model_.torque_per_thrust_m));
      }
      thrust_n = thrust_n.cwiseMax(0.0).cwiseMin(model_.thrust_max_n);
      const ThrustRates u = (thrust_n - state_.thrust_command_n) / 0.001;
      QuadrotorModel free = model_;
      free.thrust_rate_max_n_s = 1e5;
      state_ = step_reference(free, state_, u, 0.001);
    }
    return state_;
  }

 private:
  QuadrotorModel model_, believed_;
  QuadrotorState state_;
};

struct Seen {
  Problems ever = 0;
  double first_s = -1.0;  ///< when anything was told

  /// The likely causes among what was told.
  Problems causes() const {
    return ever & ~(bit(Problem::kVelocityAgainstMotion) | bit(Problem::kThrustAgainstMotion) |
                    bit(Problem::kRatesAgainstAttitude));
  }
};

/// What a watch that believes in `told` says of a flight of `truth` whose states are sent as `send` makes them.
Seen watch(const std::function<QuadrotorState(const QuadrotorState&)>& send, double duration_s = 1.5,
           const QuadrotorModel& told = {}, const QuadrotorModel& truth = {}) {
  StateWatch watch(told);
  Flight flight(truth, told);
  Seen seen;
  for (int i = 0; i < duration_s * 100; ++i) {
    const Problems now = watch.observe(10s + i * 10ms, send(flight.step(0.01 * i)));
    if (now != 0 && seen.first_s < 0) seen.first_s = 0.01 * i;
    seen.ever |= now;
  }
  return seen;
}

bool has(Problems problems, Problem problem) { return (problems & bit(problem)) != 0; }

TEST(StateWatch, IsSilentOnAGoodFlight) {
  EXPECT_EQ(watch([](const QuadrotorState& s) { return s; }, 10.0).ever, 0u);
}

TEST(StateWatch, IsSilentWithAnEstimatorsNoiseAndAVehicleThatIsNotQuiteAsTold) {
  Random random(3, 7);
  const auto noisy = [&](const QuadrotorState& truth) {
    QuadrotorState s = truth;
    const auto error = [&](double sigma) {
      return Eigen::Vector3d(sigma * random.normal(), sigma * random.normal(), sigma * random.normal());
    };
    s.p_WB += error(0.02);
    s.v_WB += error(0.1);
    const Eigen::Vector3d turn = error(0.01);
    s.q_WB = (s.q_WB * Eigen::AngleAxisd(turn.norm(), turn.normalized())).normalized();
    s.w_WB_B += error(0.1);
    return s;
  };
  QuadrotorModel truth;
  truth.mass_kg *= 1.15;
  truth.inertia_kg_m2 *= 1.2;
  truth.drag_kg_s *= 2.0;
  EXPECT_EQ(watch(noisy, 10.0, {}, truth).ever, 0u);
}

TEST(StateWatch, IsSilentAtAFewStatesASecond) {
  StateWatch watch{QuadrotorModel{}};
  Flight flight;
  for (int i = 0; i < 1000; ++i) {
    const QuadrotorState& state = flight.step(0.01 * i);
    if (i % 5 == 0) {
      EXPECT_EQ(watch.observe(i * 10ms, state), 0u) << i;
    }
  }
}

TEST(StateWatch, IsSilentAboutAVehicleThatStandsOnTheFloor) {
  StateWatch watch{QuadrotorModel{}};
  QuadrotorState still;
  for (int i = 0; i < 300; ++i) EXPECT_EQ(watch.observe(i * 10ms, still), 0u) << i;
}

Eigen::Vector3d frd(const Eigen::Vector3d& flu) { return {flu.x(), -flu.y(), -flu.z()}; }

TEST(StateWatch, KnowsNedWithinASecond) {
  const Seen seen = watch([](const QuadrotorState& s) {
    QuadrotorState ned = s;
    ned.p_WB = {s.p_WB.y(), s.p_WB.x(), -s.p_WB.z()};
    ned.v_WB = {s.v_WB.y(), s.v_WB.x(), -s.v_WB.z()};
    const Eigen::Quaterniond q_NW(0.0, M_SQRT1_2, M_SQRT1_2, 0.0), q_BF(0.0, 1.0, 0.0, 0.0);
    ned.q_WB = q_NW * s.q_WB * q_BF;
    ned.w_WB_B = frd(s.w_WB_B);
    return ned;
  });
  EXPECT_TRUE(has(seen.ever, Problem::kThrustAgainstMotion));
  EXPECT_EQ(seen.causes(), bit(Problem::kStatesLookNed));
  EXPECT_LT(seen.first_s, 1.0);
}

TEST(StateWatch, KnowsAQuaternionWithWFirst) {
  const Seen seen = watch([](const QuadrotorState& s) {
    QuadrotorState swapped = s;
    swapped.q_WB.coeffs() = Eigen::Vector4d(s.q_WB.w(), s.q_WB.x(), s.q_WB.y(), s.q_WB.z());
    return swapped;
  });
  EXPECT_TRUE(has(seen.ever, Problem::kThrustAgainstMotion));
  EXPECT_EQ(seen.causes(), bit(Problem::kQuaternionLooksWFirst));
  EXPECT_LT(seen.first_s, 0.5);
}

TEST(StateWatch, KnowsAVelocityInTheBodyFrame) {
  const Seen seen = watch([](const QuadrotorState& s) {
    QuadrotorState body = s;
    body.v_WB = s.q_WB.conjugate() * s.v_WB;
    return body;
  });
  EXPECT_TRUE(has(seen.ever, Problem::kVelocityAgainstMotion));
  EXPECT_EQ(seen.causes(), bit(Problem::kVelocityLooksBodyFrame));
  EXPECT_LT(seen.first_s, 1.0);
}

TEST(StateWatch, KnowsRatesInTheWorldFrame) {
  const Seen seen = watch([](const QuadrotorState& s) {
    QuadrotorState world = s;
    world.w_WB_B = s.q_WB * s.w_WB_B;
    return world;
  });
  EXPECT_TRUE(has(seen.ever, Problem::kRatesAgainstAttitude));
  EXPECT_EQ(seen.causes(), bit(Problem::kRatesLookWorldFrame));
  EXPECT_LT(seen.first_s, 1.0);
}

TEST(StateWatch, TellsOfRatesThatAreNotTheTurnsAndOfNoOtherCause) {
  struct Wrong {
    const char* what;
    Eigen::Vector3d (*rates)(const Eigen::Vector3d&);
  };
  for (const Wrong& wrong :
       {Wrong{"FRD", frd},
        Wrong{"none", [](const Eigen::Vector3d&) -> Eigen::Vector3d { return Eigen::Vector3d::Zero(); }},
        Wrong{"degrees", [](const Eigen::Vector3d& w) -> Eigen::Vector3d { return 180.0 / std::numbers::pi * w; }}}) {
    const Seen seen = watch([&](const QuadrotorState& s) {
      QuadrotorState sent = s;
      sent.w_WB_B = wrong.rates(s.w_WB_B);
      return sent;
    });
    EXPECT_EQ(seen.ever, bit(Problem::kRatesAgainstAttitude)) << wrong.what;
    EXPECT_LT(seen.first_s, 1.0) << wrong.what;
  }
}

TEST(StateWatch, KnowsRotorsInAnotherOrder) {
  QuadrotorModel told;
  std::swap(told.rotor_position_B_m[0], told.rotor_position_B_m[1]);
  std::swap(told.rotor_position_B_m[2], told.rotor_position_B_m[3]);
  const Seen seen = watch([](const QuadrotorState& s) { return s; }, 1.0, told);
  EXPECT_EQ(seen.causes(), bit(Problem::kRotorsLookSwapped));
}

/// As if the body rates were of another frame: only the flight tells them apart.
TEST(StateWatch, KnowsRotorsSwappedFrontToBackWithTheOtherSpins) {
  QuadrotorModel told;
  for (std::size_t i = 0; i < kRotors; ++i) {
    told.rotor_position_B_m[i].x() = -told.rotor_position_B_m[i].x();
    told.rotor_spin[i] = -told.rotor_spin[i];
  }
  const Seen seen = watch([](const QuadrotorState& s) { return s; }, 1.0, told);
  EXPECT_EQ(seen.causes(), bit(Problem::kRotorsLookSwapped));
}

TEST(StateWatch, KnowsSpinsUnlikeTheTrueOnes) {
  QuadrotorModel told;
  for (int& spin : told.rotor_spin) spin = -spin;
  const Seen seen = watch([](const QuadrotorState& s) { return s; }, 1.0, told);
  EXPECT_EQ(seen.causes(), bit(Problem::kRotorsLookSwapped));
}

TEST(StateWatch, ForgetsAProblemThatIsGone) {
  StateWatch watch{QuadrotorModel{}};
  Flight flight;
  Problems before = 0, after = 0;
  for (int i = 0; i < 600; ++i) {
    QuadrotorState s = flight.step(0.01 * i);
    if (i < 150) s.q_WB.coeffs() = Eigen::Vector4d(s.q_WB.w(), s.q_WB.x(), s.q_WB.y(), s.q_WB.z());
    const Problems now = watch.observe(i * 10ms, s);
    (i < 150 ? before : after) = now;
  }
  EXPECT_NE(before, 0u);
  EXPECT_EQ(after, 0u);
}

TEST(StateWatch, BeginsAnewWhenTheClockDoes) {
  StateWatch watch{QuadrotorModel{}};
  Flight flight;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(watch.observe(100s + i * 10ms, flight.step(0.01 * i)), 0u);
  for (int i = 100; i < 300; ++i) EXPECT_EQ(watch.observe(i * 10ms, flight.step(0.01 * i)), 0u) << i;
}

}  // namespace
}  // namespace gatefield::pilot
