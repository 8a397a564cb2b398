#include "client/flight/frames.h"

#include <gtest/gtest.h>

#include <numbers>

#include "common/base/random.h"

namespace gatefield::flight {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kQuarter = kPi / 2;

Quaterniond yaw_W(double yaw_rad) { return Quaterniond(AngleAxisd(yaw_rad, Vector3d::UnitZ())); }

/// The same rotation; of a half turn both signs are right.
void expect_same(const Quaterniond& a, const Quaterniond& b) {
  EXPECT_NEAR(std::abs(a.dot(b)), 1.0, 1e-12)
      << "(" << a.coeffs().transpose() << ") against (" << b.coeffs().transpose() << "), x y z w";
}

TEST(Frames, EastNorthAndUpAreTheSecondTheFirstAndMinusTheThird) {
  EXPECT_EQ(ned_from_enu({1, 0, 0}), Vector3d(0, 1, 0)) << "east";
  EXPECT_EQ(ned_from_enu({0, 1, 0}), Vector3d(1, 0, 0)) << "north";
  EXPECT_EQ(ned_from_enu({0, 0, 1}), Vector3d(0, 0, -1)) << "up";
  EXPECT_EQ(enu_from_ned({3, 4, -5}), Vector3d(4, 3, 5));
}

TEST(Frames, ForwardStaysAndLeftAndUpTurnRound) {
  EXPECT_EQ(frd_from_flu({1, 2, 3}), Vector3d(1, -2, -3));
  EXPECT_EQ(flu_from_frd({1, 2, 3}), Vector3d(1, -2, -3));
}

TEST(Frames, GravityOfAVehicleAtRestIsMinusOneGDownTheBody) {
  // A level accelerometer shows +g along up (FLU), -g along down (FRD).
  EXPECT_EQ(frd_from_flu({0, 0, 9.81}), Vector3d(0, 0, -9.81));
}

TEST(Frames, LevelFacingNorthIsTheIdentityOfNed) {
  expect_same(ned_frd_from_enu_flu(yaw_W(kQuarter)), Quaterniond::Identity());
  expect_same(enu_flu_from_ned_frd(Quaterniond::Identity()), yaw_W(kQuarter));
}

TEST(Frames, LevelFacingEastIsAQuarterClockwiseInNed) {
  expect_same(ned_frd_from_enu_flu(Quaterniond::Identity()), Quaterniond(AngleAxisd(kQuarter, Vector3d::UnitZ())));
}

TEST(Frames, FacingWestIsAQuarterTheOtherWay) {
  expect_same(ned_frd_from_enu_flu(yaw_W(kPi)), Quaterniond(AngleAxisd(-kQuarter, Vector3d::UnitZ())));
}

TEST(Frames, RollingRightIsPositiveAboutForwardInBoth) {
  const Quaterniond q_WB = yaw_W(kQuarter) * Quaterniond(AngleAxisd(0.3, Vector3d::UnitX()));
  expect_same(ned_frd_from_enu_flu(q_WB), Quaterniond(AngleAxisd(0.3, Vector3d::UnitX())));
  // The right wing is down: the body's right axis points down in the world.
  EXPECT_LT((q_WB * Vector3d(0, -1, 0)).z(), 0.0);
  EXPECT_EQ(frd_from_flu({0.5, 0, 0}), Vector3d(0.5, 0, 0)) << "rolling right, body rates";
}

TEST(Frames, NoseUpIsNegativeInFluAndPositiveInFrd) {
  const Quaterniond q_WB = yaw_W(kQuarter) * Quaterniond(AngleAxisd(-0.3, Vector3d::UnitY()));
  EXPECT_GT((q_WB * Vector3d::UnitX()).z(), 0.0) << "the nose points up";
  expect_same(ned_frd_from_enu_flu(q_WB), Quaterniond(AngleAxisd(0.3, Vector3d::UnitY())));
  EXPECT_EQ(frd_from_flu({0, -0.5, 0}), Vector3d(0, 0.5, 0));
}

TEST(Frames, TurningLeftIsPositiveInFluAndNegativeInFrd) { EXPECT_EQ(frd_from_flu({0, 0, 1}), Vector3d(0, 0, -1)); }

TEST(Frames, HeadingsCountFromEastOneWayAndFromNorthTheOther) {
  EXPECT_NEAR(ned_yaw_from_enu(kQuarter), 0.0, 1e-15) << "north";
  EXPECT_NEAR(ned_yaw_from_enu(0.0), kQuarter, 1e-15) << "east";
  EXPECT_NEAR(ned_yaw_from_enu(kPi), -kQuarter, 1e-15) << "west";
  EXPECT_NEAR(ned_yaw_from_enu(-kQuarter), kPi, 1e-15) << "south is pi, not -pi";
  EXPECT_NEAR(enu_yaw_from_ned(kQuarter), 0.0, 1e-15);
  EXPECT_NEAR(enu_yaw_from_ned(ned_yaw_from_enu(2.5)), 2.5, 1e-12);
}

TEST(Frames, AttitudesTurnVectorsTheSameWayInBothConventionsAndComeBack) {
  Random random(7);
  for (int i = 0; i < 200; ++i) {
    const Quaterniond q_WB =
        Quaterniond(random.normal(), random.normal(), random.normal(), random.normal()).normalized();
    const Vector3d v_B(random.normal(), random.normal(), random.normal());
    const Quaterniond q_NF = ned_frd_from_enu_flu(q_WB);
    EXPECT_TRUE((q_NF * frd_from_flu(v_B)).isApprox(ned_from_enu(q_WB * v_B), 1e-12));
    EXPECT_NEAR(q_NF.norm(), 1.0, 1e-12);
    EXPECT_GE(q_NF.w(), 0.0);
    expect_same(enu_flu_from_ned_frd(q_NF), q_WB);
    EXPECT_EQ(enu_from_ned(ned_from_enu(v_B)), v_B);
    EXPECT_EQ(flu_from_frd(frd_from_flu(v_B)), v_B);
  }
}

TEST(Frames, QuaternionsAreWrittenAndReadInEitherOrder) {
  const Quaterniond q(0.1, 0.2, 0.3, 0.4);  // w x y z
  EXPECT_EQ(wxyz(q), (std::array<double, 4>{0.1, 0.2, 0.3, 0.4}));
  EXPECT_EQ(xyzw(q), (std::array<double, 4>{0.2, 0.3, 0.4, 0.1}));
  EXPECT_EQ(from_wxyz(wxyz(q)).coeffs(), q.coeffs());
  EXPECT_EQ(from_xyzw(xyzw(q)).coeffs(), q.coeffs());
}

}  // namespace
}  // namespace gatefield::flight
