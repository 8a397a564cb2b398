#include "client/simulator/referee.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "common/config/course.h"

namespace gatefield::simulator {
namespace {

using testing::HasSubstr;

// Three gates on a triangle-like tour: A at (0,0) towards +x, B at (10,0) towards +y, C at (5,8) towards -x.
const Eigen::Vector3d kA(0, 0, 1.5), kB(10, 0, 1.5), kC(5, 8, 1.5);

scene::World three_gates() {
  scene::World world;
  world.gates.push_back({gate_pose(kA, Eigen::Vector3d::UnitX()), GateShape{}, 0.7f});
  world.gates.push_back({gate_pose(kB, Eigen::Vector3d::UnitY()), GateShape{}, 0.7f});
  world.gates.push_back({gate_pose(kC, -Eigen::Vector3d::UnitX()), GateShape{}, 0.7f});
  return world;
}

const std::vector<scene::Passage> kOnceEach{{0, true}, {1, true}, {2, true}};

QuadrotorState moving(const Eigen::Vector3d& p_WB, const Eigen::Vector3d& v_WB = Eigen::Vector3d::Zero(),
                      const Eigen::Quaterniond& q_WB = Eigen::Quaterniond::Identity()) {
  QuadrotorState state;
  state.p_WB = p_WB;
  state.v_WB = v_WB;
  state.q_WB = q_WB;
  return state;
}

Rules rules(int laps = 1) {
  Rules rules;
  rules.laps = laps;
  rules.flight_volume = Eigen::AlignedBox3d(Eigen::Vector3d(-20, -20, 0), Eigen::Vector3d(25, 25, 6));
  return rules;
}

/// Takes a point along straight lines at 5 m/s, a step of 1 ms at a time.
class Tour {
 public:
  explicit Tour(const Eigen::Vector3d& start, const Rules& r = rules(),
                const std::vector<scene::Passage>& passages = kOnceEach)
      : referee(three_gates(), passages, r, start), p_(start) {}

  Tour& to(const Eigen::Vector3d& target, std::optional<Contact> contact = {}) {
    while (!referee.decided() && (target - p_).norm() > 1e-9) {
      const Eigen::Vector3d way = target - p_;
      const Eigen::Vector3d step = way.norm() > 0.005 ? Eigen::Vector3d(0.005 * way.normalized()) : way;
      p_ += step;
      time_ += Plant::kStep;
      referee.update(time_, moving(p_, step / seconds(Plant::kStep), q_), contact);
    }
    return *this;
  }
  Tour& wait(Stamp span) {
    for (Stamp end = time_ + span; time_ < end && !referee.decided();) {
      time_ += Plant::kStep;
      referee.update(time_, moving(p_, Eigen::Vector3d::Zero(), q_), {});
    }
    return *this;
  }
  Tour& turned(const Eigen::Quaterniond& q_WB) {
    q_ = q_WB;
    return *this;
  }
  Tour& through_a() { return to({-1, 0, 1.5}).to({2, 0, 1.5}); }
  Tour& through_b() { return to({10, -2, 1.5}).to({10, 2, 1.5}); }
  Tour& through_c() { return to({7, 8, 1.5}).to({3, 8, 1.5}); }
  Tour& back_through_a() { return to({2, 0, 1.5}).to({-1, 0, 1.5}); }
  /// Round beside gate A to its near side.
  Tour& round_a() { return to({2, 4, 1.5}).to({-2, 4, 1.5}).to({-2, 0, 1.5}); }

  Referee referee;

 private:
  Eigen::Vector3d p_;
  Eigen::Quaterniond q_ = Eigen::Quaterniond::Identity();
  Stamp time_{0};
};

TEST(Referee, AllGatesInOrderFinishTheRace) {
  Tour tour({-2, 0, 1.5});
  tour.through_a().through_b().through_c();
  EXPECT_EQ(tour.referee.outcome(), Outcome::kFinished);
  EXPECT_EQ(tour.referee.passes().size(), 3u);
  EXPECT_THAT(tour.referee.sentence(), HasSubstr("finished: 3 of 3 gates"));
}

TEST(Referee, LapsAreTimedFromTheLastGateOfTheLapBefore) {
  Tour tour({-2, 0, 1.5}, rules(2));
  tour.through_a().through_b().through_c();
  EXPECT_EQ(tour.referee.lap(), 1);
  EXPECT_EQ(tour.referee.expected_waypoint(), 0);
  tour.to({-3, 4, 1.5}).through_a().through_b().through_c();
  ASSERT_EQ(tour.referee.outcome(), Outcome::kFinished) << tour.referee.sentence();
  const auto laps = tour.referee.lap_times_s();
  ASSERT_EQ(laps.size(), 2u);
  EXPECT_NEAR(laps[0] + laps[1], seconds(tour.referee.end_time()), 1e-9);
  EXPECT_NEAR(laps[0], seconds(tour.referee.passes()[2].time), 1e-9);
}

TEST(Referee, APassKnowsOffsetSpeedAndTime) {
  Tour tour({-2, 0, 1.5});
  tour.to({-1, 0.2, 1.3}).to({1, 0.2, 1.3});
  ASSERT_EQ(tour.referee.passes().size(), 1u);
  const Pass& pass = tour.referee.passes()[0];
  EXPECT_EQ(pass.waypoint, 0);
  EXPECT_EQ(pass.lap, 0);
  EXPECT_NEAR(pass.offset_m, 0.2, 1e-6);
  EXPECT_NEAR(pass.speed_m_s, 5.0, 1e-6);
  EXPECT_NEAR(seconds(pass.time), (std::sqrt(1 + 2 * 0.04) + 1) / 5.0, 0.003);
  EXPECT_NEAR(tour.referee.clearance_m(), 0.3 - 0.13, 1e-3);
}

TEST(Referee, FlyingBesideTheFrameIsNoPassAndAMissThreeMetresOn) {
  Tour tour({-2, 1.5, 1.5});
  tour.to({2.9, 1.5, 1.5});
  EXPECT_FALSE(tour.referee.decided());
  EXPECT_TRUE(tour.referee.passes().empty());
  tour.to({3.1, 1.5, 1.5});
  EXPECT_EQ(tour.referee.outcome(), Outcome::kMissedGate);
  EXPECT_THAT(tour.referee.sentence(), HasSubstr("missed gate 1"));
}

TEST(Referee, TheCornerOfASquareOpeningIsTheFrameOfARoundOne) {
  constexpr double kCorner_m = 0.4;  // from the axis both ways: 0.57 m
  for (const auto opening : {GateShape::Opening::kSquare, GateShape::Opening::kRound}) {
    scene::World world;
    world.gates.push_back({gate_pose(kA, Eigen::Vector3d::UnitX()), GateShape{.opening = opening}, 0.7f});
    const auto fly = [&](double off_m, double radius_m) {
      Rules r = rules();
      r.hull.body_radius_m = radius_m;
      Referee referee(world, {{0, true}}, r, kA + Eigen::Vector3d(-1, off_m, off_m));
      for (int i = 1; i <= 400 && !referee.decided(); ++i)
        referee.update(i * Plant::kStep, moving(kA + Eigen::Vector3d(-1 + 0.005 * i, off_m, off_m), {5, 0, 0}), {});
      return referee.outcome();
    };
    EXPECT_EQ(fly(kCorner_m, 0.0) == Outcome::kFinished, opening == GateShape::Opening::kSquare);
    EXPECT_EQ(fly(0.25, 0.1), Outcome::kFinished) << "0.35 m off and 0.1 m of hull fit through both";
  }
}

TEST(Referee, WhoTurnsBackInTimeMayStillPass) {
  Tour tour({-2, 1.5, 1.5});
  tour.to({1, 1.5, 1.5}).to({-2, 1.5, 1.5}).through_a().to({8, 0, 1.5});
  EXPECT_FALSE(tour.referee.decided()) << tour.referee.sentence();
  EXPECT_EQ(tour.referee.passes().size(), 1u);
}

TEST(Referee, CrossingTheEndlessPlaneFarFromTheGateMeansNothing) {
  Tour tour({-2, 10, 1.5});
  tour.to({6, 10, 1.5});
  EXPECT_FALSE(tour.referee.decided()) << tour.referee.sentence();
}

TEST(Referee, FromBehindIsTheWrongDirection) {
  Tour tour({3, 0, 1.5});
  tour.to({-2, 0, 1.5});
  EXPECT_EQ(tour.referee.outcome(), Outcome::kWrongDirection);
  EXPECT_THAT(tour.referee.sentence(), HasSubstr("gate 1 from behind"));
}

TEST(Referee, AnotherGateThanTheExpectedOneIsWrong) {
  Tour tour({10, -3, 1.5});
  tour.through_b();
  EXPECT_EQ(tour.referee.outcome(), Outcome::kWrongGate);
  EXPECT_THAT(tour.referee.sentence(), HasSubstr("gate 2 where gate 1 was next"));
}

TEST(Referee, AHullNearerToTheFrameThanItsRadiusTouches) {
  Tour scrapes({-2, 0.4, 1.5});
  scrapes.to({2, 0.4, 1.5});
  EXPECT_EQ(scrapes.referee.outcome(), Outcome::kTouchedGate);
  EXPECT_THAT(scrapes.referee.sentence(), HasSubstr("touched the frame of gate 1"));
  Tour fits({-2, 0.36, 1.5});
  fits.to({2, 0.36, 1.5});
  EXPECT_FALSE(fits.referee.decided());
  EXPECT_EQ(fits.referee.passes().size(), 1u);
}

TEST(Referee, ContactsOfThePhysicsEndTheRace) {
  const auto outcome_of = [](Contact contact) {
    Tour tour({-5, 3, 1.5});
    tour.to({-5, 4, 1.5}, contact);
    return tour.referee.outcome();
  };
  EXPECT_EQ(outcome_of({Contact::With::kGate, 2}), Outcome::kTouchedGate);
  EXPECT_EQ(outcome_of({Contact::With::kFloor, 0}), Outcome::kTouchedFloor);
  EXPECT_EQ(outcome_of({Contact::With::kClutter, 0}), Outcome::kTouchedClutter);
}

TEST(Referee, LeavingTheFlightVolumeEndsTheRace) {
  Tour tour({-2, 0, 1.5});
  tour.to({-2, 0, 6.5});
  EXPECT_EQ(tour.referee.outcome(), Outcome::kOutOfBounds);
}

TEST(Referee, TimeRunsOut) {
  Rules r = rules();
  r.time_limit = std::chrono::seconds(1);
  Tour tour({-15, 0, 1.5}, r);
  tour.to({-1, 0, 1.5});
  EXPECT_EQ(tour.referee.outcome(), Outcome::kTimeLimit);
  EXPECT_NEAR(seconds(tour.referee.end_time()), 1.0, 1e-9);
}

TEST(Referee, StandingStillOrCirclingForLongIsStalling) {
  Tour stands({-2, 0, 1.5});
  stands.to({-1.5, 0, 1.5}).wait(std::chrono::seconds(6));
  EXPECT_EQ(stands.referee.outcome(), Outcome::kStalled);
  Tour circles({-8, 0, 1.5});
  for (int i = 0; i < 30; ++i) circles.to({-8, 4, 1.5}).to({-8, 0, 1.5});
  EXPECT_EQ(circles.referee.outcome(), Outcome::kStalled);
  EXPECT_NEAR(seconds(circles.referee.end_time()), 20.0, 0.01);
}

TEST(Referee, NumbersThatRunAwayAreALostRace) {
  Referee referee(three_gates(), kOnceEach, rules(), {-2, 0, 1.5});
  referee.update(Plant::kStep, moving({std::numeric_limits<double>::quiet_NaN(), 0, 0}), {});
  EXPECT_EQ(referee.outcome(), Outcome::kLostControl);
}

TEST(Referee, AfterTheDecisionNothingChanges) {
  Tour tour({3, 0, 1.5});
  tour.to({-2, 0, 1.5});
  ASSERT_EQ(tour.referee.outcome(), Outcome::kWrongDirection);
  tour.referee.update(std::chrono::seconds(50), moving({0, 0, 100}), Contact{});
  tour.referee.stop(Outcome::kInterrupted, std::chrono::seconds(60));
  EXPECT_EQ(tour.referee.outcome(), Outcome::kWrongDirection);
  EXPECT_LT(seconds(tour.referee.end_time()), 2.0);
}

TEST(Referee, AFastVehicleIsSeenBetweenTwoPositions) {
  Referee referee(three_gates(), kOnceEach, rules(), {-0.5, 0, 1.5});
  referee.update(Plant::kStep, moving({0.5, 0.1, 1.5}, {1000, 0, 0}), {});
  ASSERT_EQ(referee.passes().size(), 1u);
  EXPECT_NEAR(referee.passes()[0].offset_m, 0.05, 1e-9);
}

TEST(Referee, AGateIsPassedOutAndBackWithAnotherInBetween) {
  Tour tour({-2, 0, 1.5}, rules(), {{0, true}, {1, true}, {0, false}});
  tour.through_a().through_b();
  EXPECT_EQ(tour.referee.expected_waypoint(), 2);
  tour.to({4, 0, 1.5}).back_through_a();
  ASSERT_EQ(tour.referee.outcome(), Outcome::kFinished) << tour.referee.sentence();
  ASSERT_EQ(tour.referee.passes().size(), 3u);
  EXPECT_EQ(tour.referee.passes()[2].waypoint, 2);
  EXPECT_THAT(tour.referee.sentence(), HasSubstr("3 of 3 gates"));
}

TEST(Referee, OnTheWayBackTheGateIsPassedTheOtherWayOrNotAtAll) {
  const std::vector<scene::Passage> back{{0, true}, {1, true}, {0, false}};
  Tour forwards({-2, 0, 1.5}, rules(), back);
  forwards.through_a().through_b().to({10, 5, 1.5}).to({-2, 5, 1.5}).through_a();
  EXPECT_EQ(forwards.referee.outcome(), Outcome::kWrongDirection) << forwards.referee.sentence();
  EXPECT_THAT(forwards.referee.sentence(), HasSubstr("gate 3 from behind"));
  Tour beside({-2, 0, 1.5}, rules(), back);
  beside.through_a().through_b().to({2, -2, 1.5}).to({-4, -2, 1.5});
  EXPECT_EQ(beside.referee.outcome(), Outcome::kMissedGate) << beside.referee.sentence();
  EXPECT_EQ(beside.referee.culprit(), 2);
}

TEST(Referee, AGateIsPassedTwiceTheSameWayAfterFlyingRoundIt) {
  Tour tour({-2, 0, 1.5}, rules(), {{0, true}, {0, true}});
  tour.through_a().round_a().through_a();
  EXPECT_EQ(tour.referee.outcome(), Outcome::kFinished) << tour.referee.sentence();
  Tour back({-2, 0, 1.5}, rules(), {{0, true}, {0, true}});
  back.through_a().back_through_a();
  EXPECT_EQ(back.referee.outcome(), Outcome::kWrongDirection) << back.referee.sentence();
}

TEST(Referee, AfterTheLastGateOfALapComesTheFirstAgainAlsoWhenThereIsOne) {
  Tour tour({-2, 0, 1.5}, rules(3), {{0, true}});
  tour.through_a();
  EXPECT_EQ(tour.referee.lap(), 1);
  EXPECT_EQ(tour.referee.expected_waypoint(), 0);
  tour.round_a().through_a().round_a().through_a();
  EXPECT_EQ(tour.referee.outcome(), Outcome::kFinished) << tour.referee.sentence();
  EXPECT_EQ(tour.referee.lap_times_s().size(), 3u);
}

TEST(Referee, ATouchedGateIsCalledByThePassageThatIsNextElseByTheOneJustFlown) {
  const std::vector<scene::Passage> back{{0, true}, {1, true}, {0, false}, {2, true}};
  const auto culprit = [&](int passes, int gate) {
    Tour tour({-2, 0, 1.5}, rules(), back);
    if (passes > 0) tour.through_a();
    if (passes > 1) tour.through_b();
    tour.referee.update(std::chrono::seconds(15), moving({4, 4, 1.5}), Contact{Contact::With::kGate, gate});
    return tour.referee.culprit();
  };
  EXPECT_EQ(culprit(0, 0), 0);
  EXPECT_EQ(culprit(1, 0), 0) << "just passed";
  EXPECT_EQ(culprit(2, 0), 2) << "the way back is next";
  EXPECT_EQ(culprit(0, 2), 3) << "its place in the lap, not in the world";
}

TEST(Referee, TheRaceHasItsTimeAtTheLastGateAndIsWonClearOfIt) {
  Tour tour({-2, 0, 1.5});
  tour.through_a().through_b().to({7, 8, 1.5}).to({4.71, 8, 1.5});
  EXPECT_TRUE(tour.referee.passed_all());
  EXPECT_FALSE(tour.referee.decided()) << "0.29 m behind";
  const Stamp passed = tour.referee.passes().back().time;
  tour.to({4.69, 8, 1.5});
  EXPECT_EQ(tour.referee.outcome(), Outcome::kFinished);
  EXPECT_EQ(tour.referee.end_time(), passed);
}

TEST(Referee, ContactBehindTheLastGateLosesUntilTheVehicleIsClear) {
  const auto contact_at = [](double behind_m) {
    Tour tour({-2, 0, 1.5});
    tour.through_a().through_b().to({7, 8, 1.5}).to({5.0 - behind_m, 8, 1.5});
    tour.to({4.9 - behind_m, 8, 1.5}, Contact{Contact::With::kGate, 2});
    return tour.referee.outcome();
  };
  EXPECT_EQ(contact_at(0.2), Outcome::kTouchedGate);
  EXPECT_EQ(contact_at(0.31), Outcome::kFinished);
  // The hull's own: out of the opening, down onto its lower edge (0.5 m below the axis).
  Tour sinks({-2, 0, 1.5});
  sinks.through_a().through_b().to({7, 8, 1.5}).to({4.95, 8, 1.5}).to({4.95, 8, 1.1});
  EXPECT_EQ(sinks.referee.outcome(), Outcome::kTouchedGate) << sinks.referee.sentence();
  EXPECT_THAT(sinks.referee.sentence(), HasSubstr("touched the frame of gate 3 after 3 of 3 gates"));
  EXPECT_EQ(sinks.referee.culprit(), 2);
}

TEST(Referee, AHullThatReachesFartherIsJudgedFarther) {
  Rules r = rules();
  r.hull.body_radius_m = 0.4;
  Tour tour({-2, 0, 1.5}, r);
  tour.through_a().through_b().to({7, 8, 1.5}).to({4.58, 8, 1.5});
  EXPECT_FALSE(tour.referee.decided()) << "0.42 m behind, 0.43 m of hull and half a frame";
  tour.to({4.56, 8, 1.5});
  EXPECT_EQ(tour.referee.outcome(), Outcome::kFinished);
}

TEST(Referee, WhoStaysBehindTheLastGateWithoutTouchingItHasWonAfterTwoSeconds) {
  Tour tour({-2, 0, 1.5});
  tour.through_a().through_b().to({7, 8, 1.5}).to({4.9, 8, 1.5}).wait(std::chrono::milliseconds(1900));
  EXPECT_FALSE(tour.referee.decided());
  tour.wait(std::chrono::milliseconds(200));
  EXPECT_EQ(tour.referee.outcome(), Outcome::kFinished);
}

TEST(Referee, AGateThatIsFlownAgainIsPassedAndMissed) {
  Tour clean({-2, 0, 1.5});
  clean.through_a().through_b().through_c();
  EXPECT_EQ(clean.referee.missed_gates(), 0);
  EXPECT_EQ(clean.referee.retries(), 0);

  Tour again({-2, 1.5, 1.5});
  again.to({1, 1.5, 1.5}).to({-2, 1.5, 1.5}).to({1, 1.5, 1.5}).to({-2, 1.5, 1.5});
  EXPECT_EQ(again.referee.missed_gates(), 1) << "one gate, however often";
  EXPECT_EQ(again.referee.retries(), 0) << "not passed yet";
  again.through_a().through_b().through_c();
  ASSERT_EQ(again.referee.outcome(), Outcome::kFinished) << again.referee.sentence();
  EXPECT_EQ(again.referee.missed_gates(), 1);
  EXPECT_EQ(again.referee.retries(), 2);
  EXPECT_EQ(again.referee.passes()[0].misses, 2);
  EXPECT_THAT(again.referee.sentence(), HasSubstr("1 of them missed at first"));

  Tour lost({-2, 1.5, 1.5});
  lost.to({4, 1.5, 1.5});
  EXPECT_EQ(lost.referee.outcome(), Outcome::kMissedGate);
  EXPECT_EQ(lost.referee.missed_gates(), 1);
  EXPECT_EQ(lost.referee.retries(), 0);
}

TEST(Referee, WaveringOnTheGatesPlaneIsOneMiss) {
  Tour tour({-2, 1.5, 1.5});
  for (int i = 0; i < 3; ++i) tour.to({0.1, 1.5, 1.5}).to({-0.4, 1.5, 1.5});
  EXPECT_EQ(tour.referee.missed_gates(), 1);
  tour.to({-1, 0, 1.5}).through_a();
  EXPECT_EQ(tour.referee.retries(), 1);
}

TEST(Referee, EveryPassKnowsHowNearItsFrameWas) {
  Tour tour({-2, 0, 1.5}, rules(2));
  tour.to({-1, 0.2, 1.5}).to({2, 0.2, 1.5});  // 0.3 m from the left post
  tour.through_b().through_c();
  tour.to({-3, 4, 1.5}).to({-1, 0.1, 1.5}).to({0, 0.1, 1.5}).to({2, 0.42, 1.5});
  ASSERT_EQ(tour.referee.passes().size(), 4u) << tour.referee.sentence();
  EXPECT_NEAR(tour.referee.passes()[0].clearance_m, 0.3 - 0.13, 1e-3);
  EXPECT_NEAR(tour.referee.passes()[1].clearance_m, 0.5 - 0.13, 1e-3);
  // Nearest on the way out, at the frame's far edge (x = 0.03), not at the plane.
  const Eigen::Vector2d way = Eigen::Vector2d(2, 0.32).normalized(), corner(0.03, 0.4);
  EXPECT_NEAR(tour.referee.passes()[3].clearance_m, std::abs(way.x() * corner.y() - way.y() * corner.x()) - 0.13, 1e-3);
  EXPECT_NEAR(tour.referee.clearance_m(), 0.3 - 0.13, 1e-3);
}

Rules with_discs() {
  Rules r = rules();
  const config::Vehicle racer;
  r.hull = hull_of(racer, config::HullKind::kDiscs);
  return r;
}

TEST(Referee, DiscsTouchWhereTheSphereFits) {
  // Level and head on, the tips reach 0.0771 + 0.061 m to the side: 0.0081 m more than the sphere.
  for (const double off_m : {0.36, 0.365}) {
    Tour sphere({-2, off_m, 1.5}), discs({-2, off_m, 1.5}, with_discs());
    sphere.to({2, off_m, 1.5});
    discs.to({2, off_m, 1.5});
    EXPECT_FALSE(sphere.referee.decided());
    EXPECT_EQ(discs.referee.outcome() == Outcome::kTouchedGate, off_m > 0.3619) << off_m;
  }
}

TEST(Referee, DiscsAreJudgedAsTheVehicleIsTurned) {
  // Turned by 45 deg about the vertical an arm points to the side: 0.17 m. Banked by 90 deg about x the discs stand
  // upright, and the side is the body's again.
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(std::numbers::pi / 4, Eigen::Vector3d::UnitZ()));
  const Eigen::Quaterniond banked(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
  const auto outcome = [](double off_m, const Eigen::Quaterniond& q_WB) {
    Tour tour({-2, off_m, 1.5}, with_discs());
    tour.turned(q_WB).to({2, off_m, 1.5});
    return tour.referee.outcome();
  };
  EXPECT_EQ(outcome(0.5 - 0.1695, turned), Outcome::kTouchedGate);
  EXPECT_EQ(outcome(0.5 - 0.1705, turned), Outcome::kRunning);
  EXPECT_EQ(outcome(0.365, banked), Outcome::kRunning);
  EXPECT_EQ(outcome(0.375, banked), Outcome::kTouchedGate) << "the sphere";
}

TEST(Referee, DiscsTouchTheFloorAndObstacles) {
  scene::World world = three_gates();
  world.boxes.push_back({Eigen::Isometry3d(Eigen::Translation3d(-5, 5, 1)), {0.5, 0.5, 1.0}});
  const auto outcome = [&](const Eigen::Vector3d& p_WB, double roll_rad) {
    Referee referee(world, kOnceEach, with_discs(), p_WB);
    const Eigen::Quaterniond q_WB(Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()));
    referee.update(Plant::kStep, moving(p_WB, Eigen::Vector3d::Zero(), q_WB), {});
    return referee.outcome();
  };
  EXPECT_EQ(outcome({-5, 0, 0.137}, std::numbers::pi / 2), Outcome::kTouchedFloor);
  EXPECT_EQ(outcome({-5, 0, 0.139}, std::numbers::pi / 2), Outcome::kRunning);
  EXPECT_EQ(outcome({-5, 0, 0.05}, 0.0), Outcome::kRunning) << "level: the physics has the sphere";
  EXPECT_EQ(outcome({-5, 4.363, 1.5}, 0.0), Outcome::kTouchedClutter);
  EXPECT_EQ(outcome({-5, 4.361, 1.5}, 0.0), Outcome::kRunning);
}

}  // namespace
}  // namespace gatefield::simulator
