#include "server/service/room.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

namespace gatefield::service {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

Seat seat(std::uint64_t session, int priority, Stamp since, bool racing = false, double cores = 0.2) {
  Seat made;
  made.session = session;
  made.vehicle = std::string("v").append(std::to_string(session));
  made.priority = static_cast<std::uint8_t>(priority);
  made.racing = racing;
  made.since = since;
  made.need.control = cores;
  return made;
}

TEST(Seats, CapacityIsPartOfTheCoresAndOfTheControlThreads) {
  const Capacity two = capacity_of(0.75, 2, 2, 1);
  EXPECT_NEAR(free_cores(two, {0.5, 0.25, 0.25}), 0.5, 1e-9);
  EXPECT_NEAR(free_cores(two, {1.4, 0.2, 0.2}), -0.3, 1e-9);
  const Capacity one_thread = capacity_of(0.75, 16, 1, 1);
  EXPECT_NEAR(free_cores(one_thread, {0.5, 0.5, 0.5}), 0.25, 1e-9);
  EXPECT_NEAR(free_cores(two, {0.1, 5.0, 0.1}), 0.3, 1e-9) << "perception can't take more than its thread";
}

TEST(Seats, TheNewestOfTheLowestPriorityGoesFirst) {
  std::vector<Seat> seats{seat(1, 5, 10s), seat(2, 5, 30s), seat(3, 7, 40s), seat(4, 5, 20s)};
  EXPECT_EQ(shed_next(seats), 1u);
  seats.push_back(seat(5, 2, 1s));
  EXPECT_EQ(shed_next(seats), 4u) << "priority before age";
}

TEST(Seats, ARacerGoesAfterThoseThatDoNotRaceAndNeverForItsEqual) {
  const std::vector<Seat> seats{seat(1, 5, 10s), seat(2, 5, 30s, true)};
  EXPECT_EQ(shed_next(seats), 0u) << "older, but it doesn't race";
  EXPECT_EQ(shed_next(std::vector{seat(1, 5, 10s, true), seat(2, 5, 30s, true)}), std::nullopt);
  EXPECT_EQ(shed_next(std::vector{seat(1, 6, 10s, true), seat(2, 5, 30s, true)}), 1u) << "for one of higher priority";
  EXPECT_EQ(shed_next(std::vector{seat(1, 0, 10s)}), std::nullopt) << "never the last one";
  std::vector<Seat> lockstep{seat(1, 5, 10s), seat(2, 0, 30s)};
  lockstep[1].real_time = false;
  EXPECT_EQ(shed_next(lockstep), std::nullopt) << "lockstep takes what is left, and gives none by going";
}

TEST(Seats, OnlyLowerPrioritiesAreDisplacedAndNoMoreThanSuffice) {
  const std::vector<Seat> seats{seat(1, 5, 10s), seat(2, 3, 30s), seat(3, 3, 20s), seat(4, 7, 50s)};
  EXPECT_THAT(displaced_by(seats, 5, 0.1, 0).value(), ElementsAre(1));
  EXPECT_THAT(displaced_by(seats, 5, 0.3, 0).value(), ElementsAre(1, 2));
  EXPECT_THAT(displaced_by(seats, 5, 0.0, 1).value(), ElementsAre(1));
  EXPECT_EQ(displaced_by(seats, 5, 0.5, 0), std::nullopt) << "then nobody goes";
  EXPECT_EQ(displaced_by(seats, 3, 0.1, 0), std::nullopt) << "equals don't displace each other";
  EXPECT_THAT(displaced_by(seats, 9, 0.7, 0).value(), ElementsAre(1, 2, 0, 3));
  EXPECT_THAT(displaced_by(seats, 9, 5.0, 0).value(), ElementsAre(1, 2, 0, 3)) << "alone it always fits";
}

/// Ticks of some vehicles, a quarter of a second each.
struct Ticks {
  LateTicks late;
  Stamp now{100s};
  void pass(std::chrono::nanoseconds span, std::uint64_t late_each, std::uint64_t narrow_each = 0) {
    for (const Stamp end = now + span; now < end;) late.add(now += 250ms, {100, late_each, narrow_each});
  }
};

TEST(LateTicks, AFewCloseTheRoomUntilTheyAreForgotten) {
  Ticks ticks;
  ticks.pass(2s, 0);
  ticks.late.add(ticks.now += 250ms, {100, 2});
  EXPECT_FALSE(ticks.late.closed()) << "two may happen to anybody";
  ticks.late.add(ticks.now += 250ms, {100, 1});
  EXPECT_TRUE(ticks.late.closed());
  EXPECT_FALSE(ticks.late.shed_due(ticks.now));
  ticks.pass(3s, 0);
  EXPECT_FALSE(ticks.late.closed());
}

TEST(LateTicks, AFewInEveryWindowAreTooMuchInTheLongRun) {
  Ticks ticks;
  for (int i = 0; i < 9; ++i) {  // 0.17 %, two in any two seconds
    ticks.pass(1s, 0);
    ticks.late.add(ticks.now += 250ms, {200, 1});
  }
  EXPECT_TRUE(ticks.late.closed());
  EXPECT_TRUE(ticks.late.shed_due(ticks.now));
  EXPECT_THAT(ticks.late.words(), HasSubstr(" control ticks were late"));
  ticks.late.shed(ticks.now);
  EXPECT_FALSE(ticks.late.closed());
}

TEST(LateTicks, NarrowOnesCloseTheRoomAndCostNobodyTheSession) {
  Ticks ticks;
  ticks.pass(4s, 0, 2);
  EXPECT_FALSE(ticks.late.closed()) << "2 % are no more than may happen";
  ticks.pass(20s, 0, 4);
  EXPECT_TRUE(ticks.late.closed());
  EXPECT_EQ(ticks.late.words(), "36 of the last 900 control ticks were nearly late");
  EXPECT_FALSE(ticks.late.overloaded());
  EXPECT_FALSE(ticks.late.shed_due(ticks.now));
  ticks.pass(3s, 0);
  EXPECT_FALSE(ticks.late.closed());
}

TEST(LateTicks, AnOverloadThatPersistsCostsOneSeatAtATime) {
  Ticks ticks;
  ticks.pass(1s, 5);
  EXPECT_FALSE(ticks.late.shed_due(ticks.now));
  ticks.pass(1s, 5);
  EXPECT_TRUE(ticks.late.shed_due(ticks.now));
  ticks.late.shed(ticks.now);
  ticks.pass(3s, 5);
  EXPECT_FALSE(ticks.late.shed_due(ticks.now)) << "what it brings has to show";
  ticks.pass(1s, 2);
  EXPECT_TRUE(ticks.late.shed_due(ticks.now));
}

TEST(LateTicks, WhereGoingBringsNothingThePausesGrow) {
  Ticks ticks;
  ticks.pass(2s, 50);
  ticks.late.shed(ticks.now);
  ticks.pass(4s, 50);
  ASSERT_TRUE(ticks.late.shed_due(ticks.now));
  ticks.late.shed(ticks.now);
  ticks.pass(5s, 50);
  EXPECT_FALSE(ticks.late.shed_due(ticks.now));
  ticks.pass(3s, 50);
  EXPECT_TRUE(ticks.late.shed_due(ticks.now));
}

/// A server of two cores whose vehicles take what the test says.
class RoomTest : public ::testing::Test {
 protected:
  RoomTest() {
    profile_.name = "race";
    profile_.samples = 1000;
    profile_.steps = 20;
    profile_.control_rate_hz = 48;
    costs_.learn_step(profile_, 8ms);  // 0.384 cores
    costs_.learn_look(1ms);            // 0.06 cores
    make(0.75);
  }
  void make(double utilisation) { room_ = std::make_unique<Room>(RoomOptions{utilisation, 2.0, 2, 1}, costs_); }
  Room::Newcomer newcomer(int priority = 5, bool real_time = true) const {
    return {&profile_, 60.0, static_cast<std::uint8_t>(priority), real_time, 0};
  }
  /// One that enters, and flies from now on: so many milliseconds a step.
  void enter(std::uint64_t session, int priority = 5, double step_ms = 8.0, bool real_time = true) {
    SessionReading reading;
    reading.session = session;
    reading.vehicle = std::string("v").append(std::to_string(session));
    reading.profile = &profile_;
    reading.camera_rate_hz = 60;
    reading.priority = static_cast<std::uint8_t>(priority);
    reading.real_time = real_time;
    reading.heard = true;
    room_->enter(newcomer(priority, real_time), session, reading.vehicle, now_);
    flying_.push_back({reading, step_ms});
  }
  void pass(std::chrono::nanoseconds span, std::uint64_t late_per_second = 0) {
    for (const Stamp end = now_ + span; now_ < end;) {
      now_ += 250ms;
      std::vector<SessionReading> readings;
      for (auto& [reading, step_ms] : flying_) {
        if (reading.heard) {
          constexpr int kSteps = 12;  // at 48 Hz
          const auto cpu = from_seconds(1e-3 * step_ms * kSteps);
          reading.steps += kSteps;
          reading.step_cpu += cpu;
          reading.late += late_per_second / 4;
          server_.process += cpu;
          server_.control_threads += cpu;
        }
        readings.push_back(reading);
      }
      room_->measure(now_, readings, server_);
    }
  }

  bool late_ticks_closed() const { return room_->late_ticks().closed(); }

  struct Flying {
    SessionReading reading;
    double step_ms;
  };
  Stamp now_{100s};
  planner::Profile profile_;
  Costs costs_;
  std::unique_ptr<Room> room_;
  std::vector<Flying> flying_;
  ServerReading server_;
};

TEST_F(RoomTest, NewcomersAreExpectedToTakeWhatTheTrialFound) {
  EXPECT_NEAR(room_->free(), 1.5, 1e-9);
  for (std::uint64_t session = 1; session <= 3; ++session) {
    EXPECT_TRUE(room_->ask(newcomer()).fits) << session;
    enter(session);
  }
  EXPECT_NEAR(room_->taken(), 3 * 0.464, 1e-9);
  const Room::Answer fourth = room_->ask(newcomer());
  EXPECT_FALSE(fourth.fits);
  EXPECT_EQ(fourth.why_not, "the server has no room: its 3 vehicles take 1.39 of 1.50 cores, profile race needs 0.46");
  EXPECT_TRUE(room_->ask(newcomer(5, false)).fits) << "lockstep takes what is left";
}

TEST_F(RoomTest, ThenWhatIsMeasuredOfThem) {
  for (std::uint64_t session = 1; session <= 3; ++session) enter(session, 5, 2.0);
  pass(1s);
  EXPECT_FALSE(room_->ask(newcomer()).fits) << "they may not have seen a gate yet";
  pass(4s);
  EXPECT_NEAR(room_->taken(), 3 * 0.1, 0.02);
  EXPECT_TRUE(room_->ask(newcomer()).fits);
}

TEST_F(RoomTest, WhatHelpersDoOfTheStepsCountsToo) {
  enter(1, 5, 4.0);
  for (int i = 0; i < 20; ++i) {
    server_.helping += 25ms;  // half of what the steps' own threads did: 0.1 cores beside 0.2
    pass(250ms);
  }
  EXPECT_NEAR(room_->taken(), 0.3, 0.03);
}

TEST_F(RoomTest, TheMiddlewareCountsToo) {
  enter(1, 5, 2.0);
  for (int i = 0; i < 40; ++i) {
    server_.process += 100ms;
    pass(250ms);
  }
  EXPECT_NEAR(room_->taken(), 0.1 + 0.4, 0.02);
}

TEST_F(RoomTest, WhoIsNotHeardTakesNothingAfterAMoment) {
  for (std::uint64_t session = 1; session <= 3; ++session) {
    enter(session);
    flying_.back().reading.heard = false;  // spare sessions beside another server's
  }
  pass(1s);
  EXPECT_FALSE(room_->ask(newcomer()).fits);
  pass(2s);
  EXPECT_NEAR(room_->taken(), 0.0, 1e-9);
  EXPECT_TRUE(room_->ask(newcomer()).fits);
  for (Flying& one : flying_) one.reading.heard = true;
  pass(250ms);
  EXPECT_FALSE(room_->ask(newcomer()).fits) << "the other server is gone";
}

TEST_F(RoomTest, TheFirstVehicleAlwaysFits) {
  make(0.01);
  EXPECT_TRUE(room_->ask(newcomer()).fits);
  enter(1);
  EXPECT_FALSE(room_->ask(newcomer()).fits);
}

TEST_F(RoomTest, LateTicksOfWhichVehiclesTakeLittleCloseTheRoomForAMoment) {
  enter(1, 5, 2.0);
  pass(4s);
  pass(2s, 4);
  EXPECT_FALSE(room_->ask(newcomer()).fits);
  pass(3s);
  EXPECT_TRUE(room_->ask(newcomer()).fits) << "other programs did that";
}

TEST_F(RoomTest, LateTicksCloseTheRoom) {
  for (std::uint64_t session = 1; session <= 2; ++session) enter(session);
  pass(4s);
  ASSERT_TRUE(room_->ask(newcomer()).fits);
  pass(2s, 4);
  const Room::Answer answer = room_->ask(newcomer());
  EXPECT_FALSE(answer.fits);
  EXPECT_THAT(answer.why_not, HasSubstr("control ticks were late"));
  EXPECT_EQ(room_->free(), 0.0);
  EXPECT_EQ(room_->latest(), "v1");
  pass(11s);
  EXPECT_FALSE(late_ticks_closed());
  EXPECT_FALSE(room_->ask(newcomer()).fits) << "so much was too much";
  EXPECT_NEAR(room_->most(), room_->taken(), 0.05);
  pass(60s);
  EXPECT_TRUE(room_->ask(newcomer()).fits) << "and may not be any more";
  pass(100s);
  EXPECT_NEAR(room_->most(), 1.5, 1e-9);
}

TEST_F(RoomTest, OverloadCostsTheNewestItsSeat) {
  enter(1, 5, 2.0);
  pass(1s);
  enter(2, 5, 2.0);
  pass(1s, 40);
  EXPECT_FALSE(room_->shed(now_).has_value());
  pass(2s, 40);
  const auto shed = room_->shed(now_);
  ASSERT_TRUE(shed.has_value());
  EXPECT_EQ(shed->session, 2u);
  EXPECT_THAT(shed->why, HasSubstr("control ticks were late"));
  EXPECT_FALSE(room_->shed(now_).has_value()) << "one at a time";
  EXPECT_LT(room_->most(), room_->taken()) << "what was taken was too much";
}

TEST_F(RoomTest, WhatProvedTooMuchAgainIsNotTriedForLonger) {
  for (std::uint64_t session = 1; session <= 3; ++session) enter(session);
  // @return for how long no more may be taken than what was left when somebody had to go
  const auto overload = [&] {
    pass(4s, 40);
    EXPECT_TRUE(room_->shed(now_).has_value());
    const Stamp begin = now_;
    const double most = room_->most();
    while (room_->most() <= most + 1e-9 && now_ < begin + 1h) pass(250ms);
    return now_ - begin;
  };
  EXPECT_NEAR(seconds(overload()), seconds(Room::kHoldShed), 1.0);
  pass(5s);
  ASSERT_LT(room_->most(), 1.5) << "on the way back";
  EXPECT_NEAR(seconds(overload()), seconds(2 * Room::kHoldShed), 1.0);
  pass(200s);
  ASSERT_NEAR(room_->most(), 1.5, 1e-9);
  EXPECT_NEAR(seconds(overload()), seconds(Room::kHoldShed), 1.0) << "by then it was not too much any more";
}

TEST_F(RoomTest, HigherPriorityDisplacesTheNewestOfTheLowest) {
  for (std::uint64_t session = 1; session <= 3; ++session) {
    enter(session, session == 1 ? 5 : 3);
    pass(250ms);
  }
  const Room::Answer answer = room_->ask(newcomer(5));
  EXPECT_TRUE(answer.fits);
  EXPECT_THAT(answer.displaced, ElementsAre(3));
  EXPECT_FALSE(room_->ask(newcomer(3)).fits);
}

TEST_F(RoomTest, SwitchedOffNobodyIsRefusedOrSentAway) {
  make(0.0);
  for (std::uint64_t session = 1; session <= 9; ++session) enter(session);
  pass(4s, 40);
  EXPECT_TRUE(room_->ask(newcomer()).fits);
  EXPECT_FALSE(room_->shed(now_).has_value());
}

}  // namespace
}  // namespace gatefield::service
