#include "client/simulator/simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "client/simulator/depth_sensor.h"
#include "common/config/locate.h"
#include "tests/support/path_follower.h"

namespace gatefield::simulator {
namespace {

using testing::HasSubstr;

const std::atomic<bool> kGoOn{false};

config::Scenario circle(int laps = 1) {
  auto scenario = config::load_scenario(config::find_config("scenarios", "circle-0.3m").value());
  EXPECT_TRUE(scenario.ok()) << scenario.error();
  scenario.value().track.course.laps = laps;
  return std::move(scenario).value();
}

scene::World truth(const config::Scenario& scenario) {
  return config::perturbed_world(scenario.track, scenario.perturbation, scenario.seed);
}

Report race(const config::Scenario& scenario, const Options& options, test::PathFollower* client) {
  auto report = fly(scenario, options, client, kGoOn);
  EXPECT_TRUE(report.ok()) << report.error();
  return std::move(report).value();
}

TEST(Lockstep, AClientThatKnowsTheGatesWins) {
  const auto scenario = circle(2);
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {});
  const Report report = race(scenario, {}, &client);
  EXPECT_EQ(report.outcome, Outcome::kFinished) << report.sentence;
  EXPECT_EQ(report.passes.size(), 8u);
  EXPECT_EQ(report.lap_times_s.size(), 2u);
  EXPECT_EQ(report.contacts, 0);
  EXPECT_EQ(report.late_ticks, 0u);
  EXPECT_GT(report.top_speed_m_s, 3.5);
  EXPECT_GT(report.clearance_m, 0.0);
  EXPECT_NEAR(static_cast<double>(report.samples.size()), 100 * report.samples.back().t_s, 4);
  for (const Pass& pass : report.passes) EXPECT_GE(pass.clearance_m, report.clearance_m);
  EXPECT_THAT(summarize(report), HasSubstr("8 of 8 passed"));
}

config::Scenario circle_by_rates(int laps = 1) {
  config::Scenario scenario = circle(laps);
  scenario.vehicle.actuation = config::driven_by(scenario.vehicle, Actuation::Kind::kBodyRates);
  return scenario;
}

TEST(Lockstep, AVehicleDrivenByBodyRatesFliesThroughItsRateLoop) {
  auto scenario = circle_by_rates(2);
  for (const double stronger : {1.0, 1.1}) {
    scenario.mismatch.thrust_factor = stronger;
    test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {});
    const Report report = race(scenario, {}, &client);
    EXPECT_EQ(report.outcome, Outcome::kFinished) << report.sentence;
    EXPECT_GT(report.top_speed_m_s, 3.5);
    EXPECT_FALSE(client.received().thrust_known) << "a flight controller tells nothing of its rotors";
    EXPECT_THAT(summarize(report), HasSubstr("Driven by     body rates"));
  }
}

TEST(Lockstep, TheTruthOfARateLoopIsFlownAndNotTold) {
  auto scenario = circle_by_rates();
  const auto flown = [](const config::Scenario& s) {
    test::PathFollower client(truth(s), s.vehicle.quadrotor, {});
    return race(s, {}, &client).samples[100].state.p_WB;
  };
  const Eigen::Vector3d told = flown(scenario);
  EXPECT_EQ(told, flown(scenario)) << "same race again";
  scenario.mismatch.rate_lag_factor = 1.5;
  EXPECT_NE(told, flown(scenario));
  scenario.mismatch = {};
  scenario.mismatch.setpoint_delay = std::chrono::milliseconds(20);
  EXPECT_NE(told, flown(scenario));
  scenario.mismatch = {};
  scenario.mismatch.rate_limit_rad_s.setConstant(0.5);
  EXPECT_NE(told, flown(scenario));
  scenario.mismatch = {};
  scenario.mismatch.rate_lag_factor = 0.3;
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {});
  const auto report = fly(scenario, {}, &client, kGoOn);
  ASSERT_FALSE(report.ok());
  EXPECT_THAT(report.error(), HasSubstr("the true rate loop: rate_time_constant_s[0] is 0.01275 s"));
}

TEST(Lockstep, StrongerRotorsAreKnownByWhatTheyAreAskedFor) {
  auto scenario = circle();
  scenario.mismatch.thrust_factor = 1.25;
  scenario.time_limit = std::chrono::milliseconds(100);
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {});
  race(scenario, {}, &client);
  const double hover_n = hover_thrust_n(scenario.vehicle.quadrotor)[0];
  EXPECT_NEAR(client.received().first.thrust_n[0], hover_n / 1.25, 1e-9);
  EXPECT_NEAR(client.received().first.thrust_command_n[0], hover_n / 1.25, 1e-9);
  EXPECT_TRUE(client.received().thrust_known);
}

TEST(RealTime, AVehicleDrivenByBodyRatesFliesToo) {
  auto scenario = circle_by_rates();
  scenario.time_limit = std::chrono::milliseconds(1000);
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {});
  Options options;
  options.timing = protocol::Timing::kRealTime;
  const Report report = race(scenario, options, &client);
  EXPECT_EQ(report.outcome, Outcome::kTimeLimit) << report.sentence;
  EXPECT_FALSE(client.received().thrust_known);
  EXPECT_GT(report.top_speed_m_s, 1.0);
}

TEST(Lockstep, SendsAStatePerControlPeriodAndFramesAtTheCamerasRate) {
  auto scenario = circle();
  scenario.vehicle.camera.rate_hz = 30;
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {});
  const Report report = race(scenario, {}, &client);
  const auto received = client.received();
  EXPECT_EQ(received.states.size(), report.control_ticks);
  for (std::size_t i = 1; i < received.states.size(); ++i)
    ASSERT_EQ(received.states[i] - received.states[i - 1], std::chrono::milliseconds(20));
  EXPECT_NEAR(static_cast<double>(received.frames.size()), 30 * report.samples.back().t_s, 2);
  EXPECT_EQ(received.frames.size(), report.frames_sent);
  EXPECT_GT(received.valid_pixels / received.frames.size(), 1000u) << "frames are empty";
}

TEST(Lockstep, TheSameSeedGivesTheSameRaceAndAnotherOneAnother) {
  auto scenario = circle();
  scenario.state_noise = {0.01, 0.05, 0.004, 0.02};
  const auto fly_once = [](const config::Scenario& s) {
    test::PathFollower client(truth(s), s.vehicle.quadrotor, {});
    return race(s, {}, &client);
  };
  const Report a = fly_once(scenario), b = fly_once(scenario);
  ASSERT_EQ(a.samples.size(), b.samples.size());
  for (std::size_t i = 0; i < a.samples.size(); ++i) {
    ASSERT_EQ(a.samples[i].state.p_WB, b.samples[i].state.p_WB) << i;
    ASSERT_EQ(a.samples[i].setpoint.thrust_rate_n_s, b.samples[i].setpoint.thrust_rate_n_s) << i;
  }
  ASSERT_TRUE(a.snapshot && b.snapshot);
  EXPECT_EQ(a.snapshot->depth.depth_m, b.snapshot->depth.depth_m);
  scenario.seed = 2;
  const Report c = fly_once(scenario);
  ASSERT_GT(c.samples.size(), 50u);
  EXPECT_NE(a.samples[50].state.p_WB, c.samples[50].state.p_WB);
}

TEST(Lockstep, AClientThatBelievesTheNominalGatesHitsOne) {
  auto scenario = circle(3);
  scenario.perturbation.position_m = 0.6;
  test::PathFollower client(config::nominal_world(scenario.track), scenario.vehicle.quadrotor, {});
  const Report report = race(scenario, {}, &client);
  EXPECT_EQ(report.outcome, Outcome::kTouchedGate) << report.sentence;
  EXPECT_EQ(report.contacts, 1);
  EXPECT_GE(report.culprit, 0);
  EXPECT_EQ(report.end_state.p_WB, report.samples.back().state.p_WB);
}

TEST(Lockstep, ARaceIsFlownOutOfItsLastGateAndTimedInIt) {
  const auto scenario = circle();
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {});
  const Report report = race(scenario, {}, &client);
  ASSERT_EQ(report.outcome, Outcome::kFinished) << report.sentence;
  EXPECT_EQ(report.race_time_s, seconds(report.passes.back().time));
  EXPECT_GT(report.samples.back().t_s, report.race_time_s + 0.02);
  EXPECT_LT(report.samples.back().t_s, report.race_time_s + 0.2);
  const auto at_the_gate = std::find_if(report.samples.begin(), report.samples.end(),
                                        [&](const Sample& s) { return s.t_s == report.race_time_s; });
  ASSERT_NE(at_the_gate, report.samples.end()) << "a sample of the moment that the time is taken at";
  const auto gates = config::gates_by_waypoint(truth(scenario), scenario.track.course);
  EXPECT_NEAR((gates.back().X_WG.inverse() * at_the_gate->state.p_WB).x(), 0.0, 0.01);
  EXPECT_GE((gates.back().X_WG.inverse() * report.end_state.p_WB).x(), 0.3);
  for (std::size_t i = 1; i < report.samples.size(); ++i)
    EXPECT_GT(report.samples[i].t_s, report.samples[i - 1].t_s) << "one sample a moment";
}

TEST(Lockstep, TheHullDecidesTheVerdictAndNotTheMotion) {
  auto scenario = circle();
  // Too large a propeller for these gates: the tips touch where the sphere passes.
  scenario.vehicle.propeller_radius_m = 0.5;
  const auto flown = [&](config::HullKind hull) {
    scenario.hull = hull;
    test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {});
    return race(scenario, {}, &client);
  };
  const Report sphere = flown(config::HullKind::kSphere), discs = flown(config::HullKind::kDiscs);
  EXPECT_EQ(sphere.outcome, Outcome::kFinished) << sphere.sentence;
  EXPECT_EQ(discs.outcome, Outcome::kTouchedGate) << discs.sentence;
  EXPECT_EQ(discs.hull, config::HullKind::kDiscs);
  EXPECT_THAT(summarize(discs), HasSubstr("(rotor discs and body)"));
  ASSERT_LT(discs.samples.size(), sphere.samples.size());
  for (std::size_t i = 0; i + 1 < discs.samples.size(); ++i)
    ASSERT_EQ(discs.samples[i].state.p_WB, sphere.samples[i].state.p_WB) << i;
}

TEST(Lockstep, AVehicleThatStaysPutIsStalled) {
  const auto scenario = circle();
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {.stand_still = true});
  const Report report = race(scenario, {}, &client);
  EXPECT_EQ(report.outcome, Outcome::kStalled) << report.sentence;
  EXPECT_THAT(report.sentence, HasSubstr("stuck before gate 1"));
}

TEST(Lockstep, MissingAnswersAreCountedAndTheVehicleFliesOn) {
  const auto scenario = circle();
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {.silent_from = 50});
  Options options;
  options.answer_timeout = std::chrono::milliseconds(1);
  options.give_up = std::chrono::milliseconds(100000);
  const Report report = race(scenario, options, &client);
  EXPECT_EQ(report.outcome, Outcome::kFinished) << report.sentence;
  EXPECT_EQ(report.late_ticks, report.control_ticks - 49);
  EXPECT_GT(report.fallback_s, 0.5);
}

TEST(Lockstep, WithoutAnyAnswerTheRaceIsGivenUp) {
  const auto scenario = circle();
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {.silent_from = 10});
  Options options;
  options.answer_timeout = std::chrono::milliseconds(20);
  options.give_up = std::chrono::milliseconds(100);
  const Report report = race(scenario, options, &client);
  EXPECT_EQ(report.outcome, Outcome::kLinkLost) << report.sentence;
}

TEST(Lockstep, ALinkDelayShowsOlderStatesButNoFewer) {
  const auto scenario = circle();
  Options options;
  options.link_delay = std::chrono::milliseconds(35);
  test::PathFollower slow(truth(scenario), scenario.vehicle.quadrotor, {}),
      quick(truth(scenario), scenario.vehicle.quadrotor, {});
  race(scenario, options, &slow);
  race(scenario, {}, &quick);
  const auto late = slow.received(), prompt = quick.received();
  ASSERT_FALSE(late.states.empty());
  EXPECT_EQ(prompt.states[0] - late.states[0], options.link_delay);
  EXPECT_EQ(late.states.size(), prompt.states.size());
  EXPECT_EQ(late.frames[0], prompt.frames[0]) << "a frame keeps the stamp of its capture";
  EXPECT_LE(late.frames.size(), prompt.frames.size());
}

TEST(Lockstep, ALinkThatShakesAndLosesNeverGoesBackInTimeAndRepeatsItself) {
  const auto scenario = circle();
  Options options;
  options.link_delay = std::chrono::milliseconds(20);
  options.link_jitter = std::chrono::milliseconds(45);
  options.link_loss = 0.1;
  const auto fly_once = [&](const Options& link) {
    test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {});
    race(scenario, link, &client);
    return client.received();
  };
  const auto first = fly_once(options), again = fly_once(options), clean = fly_once({});
  EXPECT_EQ(first.states, again.states);
  EXPECT_EQ(first.frames, again.frames);
  for (std::size_t i = 1; i < first.states.size(); ++i) ASSERT_GT(first.states[i], first.states[i - 1]) << i;
  for (std::size_t i = 1; i < first.frames.size(); ++i) ASSERT_GT(first.frames[i], first.frames[i - 1]) << i;
  // Both ways of a state must go well: 0.9^2; some more are overtaken.
  const double share = static_cast<double>(first.states.size()) / static_cast<double>(clean.states.size());
  EXPECT_LT(share, 0.81);
  EXPECT_GT(share, 0.3);
  EXPECT_LT(first.frames.size(), clean.frames.size());
}

TEST(Lockstep, LossAloneLosesBothWaysOfAState) {
  const auto scenario = circle();
  Options options;
  options.link_loss = 0.2;
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {});
  const Report report = race(scenario, options, &client);
  const auto received = client.received();
  const double periods = report.race_time_s / 0.02;
  EXPECT_NEAR(static_cast<double>(received.states.size()) / periods, 0.64, 0.1);
  EXPECT_EQ(received.states.size(), report.control_ticks);
}

TEST(DepthSensors, ThePairOfCamerasSeesAboutTheSameAndRepeatsItself) {
  auto scenario = circle();
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  X_WB.translation() = Eigen::Vector3d(6.0, -3.0, 1.5);
  X_WB.linear() = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const auto capture = [&] { return DepthSensor(truth(scenario), scenario).capture(X_WB).depth_m; };
  scenario.sensor_noise.scale = 0.0;
  const auto ideal = capture();
  scenario.stereo.emplace();
  const auto matched = capture();
  EXPECT_EQ(matched, capture());
  scenario.seed = 2;
  scenario.perturbation = {};
  EXPECT_NE(matched, capture());
  ASSERT_EQ(matched.size(), ideal.size());
  std::size_t both = 0, near = 0;
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    if (matched[i] <= 0 || ideal[i] <= 0 || ideal[i] > 4) continue;
    ++both;
    near += std::abs(matched[i] - ideal[i]) < 0.1f * ideal[i];
  }
  EXPECT_GT(both, ideal.size() / 20);
  EXPECT_GT(near, both * 8 / 10);
}

TEST(DepthSensors, CountsAreOfTheCamerasUnit) {
  auto scenario = circle();
  DepthSensor millimetres(truth(scenario), scenario);
  scenario.vehicle.camera.metres_per_count = 0.00025;
  DepthSensor quarters(truth(scenario), scenario);
  const Eigen::Isometry3d X_WB = Eigen::Isometry3d(Eigen::Translation3d(start_state(scenario).p_WB));
  const scene::DepthImage& image = millimetres.capture(X_WB);
  quarters.capture(X_WB);
  for (std::size_t i = 0; i < image.depth_m.size(); ++i) {
    ASSERT_EQ(millimetres.counts()[i], std::lround(image.depth_m[i] * 1000.0f)) << i;
    ASSERT_EQ(quarters.counts()[i], std::min(std::lround(image.depth_m[i] * 4000.0f), 65535L)) << i;
  }
}

TEST(Lockstep, ToldProblemsAreReportedOnceWithTheirTime) {
  auto scenario = circle();
  scenario.time_limit = std::chrono::milliseconds(300);
  using protocol::Problem;
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor,
                            {.problems = {{Problem::kStatesLookNed, true},
                                          {Problem::kStatesLookNed, false},
                                          {Problem::kDepthMissing, true},
                                          {Problem::kStatesLookNed, true}}});
  std::vector<HeardProblem> told;
  const auto report =
      fly(scenario, {}, &client, kGoOn, {}, [&told](const HeardProblem& heard) { told.push_back(heard); });
  ASSERT_TRUE(report.ok()) << report.error();
  ASSERT_EQ(report->problems.size(), 2u);
  EXPECT_EQ(report->problems[0].problem, Problem::kStatesLookNed);
  EXPECT_DOUBLE_EQ(report->problems[0].race_time_s, 0.0);
  EXPECT_EQ(report->problems[1].problem, Problem::kDepthMissing);
  EXPECT_DOUBLE_EQ(report->problems[1].race_time_s, 0.04);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[1].problem, Problem::kDepthMissing);
  EXPECT_THAT(summarize(*report), HasSubstr("Problem       at 0.04 s: no usable depth frame"));
}

TEST(Lockstep, WhatBecomesOfTheSessionIsReportedWithItsTime) {
  auto scenario = circle();
  scenario.time_limit = std::chrono::milliseconds(300);
  using Kind = sdk::SessionChange::Kind;
  test::PathFollower client(
      truth(scenario), scenario.vehicle.quadrotor,
      {.sessions = {{Kind::kLost, ErrorCode::kNoAnswer, "planner-1", "server planner-1 fell silent"},
                    {Kind::kRejoined, ErrorCode::kOther, "planner-2", "a session again"}}});
  std::vector<HeardSession> told;
  const auto report =
      fly(scenario, {}, &client, kGoOn, {}, {}, [&told](const HeardSession& heard) { told.push_back(heard); });
  ASSERT_TRUE(report.ok()) << report.error();
  ASSERT_EQ(report->sessions.size(), 2u);
  EXPECT_EQ(report->sessions[0].change.why, ErrorCode::kNoAnswer);
  EXPECT_DOUBLE_EQ(report->sessions[1].race_time_s, 0.02);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[1].change.server, "planner-2");
  EXPECT_THAT(summarize(*report), HasSubstr("Session       at 0.00 s: server planner-1 fell silent\n"
                                            "Session       at 0.02 s: a session again\n"));
}

TEST(RealTime, ToldProblemsAreReported) {
  auto scenario = circle();
  scenario.time_limit = std::chrono::milliseconds(500);
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor,
                            {.problems = {{protocol::Problem::kDelayLong, true}}});
  Options options;
  options.timing = protocol::Timing::kRealTime;
  const Report report = race(scenario, options, &client);
  ASSERT_EQ(report.problems.size(), 1u);
  EXPECT_EQ(report.problems[0].problem, protocol::Problem::kDelayLong);
}

TEST(Lockstep, MetresAndCountsCarryTheSamePixels) {
  auto scenario = circle();
  scenario.time_limit = std::chrono::milliseconds(300);
  Options metres;
  metres.depth_in_counts = false;
  test::PathFollower a(truth(scenario), scenario.vehicle.quadrotor, {}),
      b(truth(scenario), scenario.vehicle.quadrotor, {});
  race(scenario, metres, &a);
  race(scenario, {}, &b);
  EXPECT_EQ(a.received().frames, b.received().frames);
  EXPECT_EQ(a.received().valid_pixels, b.received().valid_pixels);
  EXPECT_GT(a.received().valid_pixels, 1000u);
}

TEST(Lockstep, AnInterruptEndsTheRaceAndSaysSo) {
  const auto scenario = circle();
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor,
                            {.answer_delay = std::chrono::milliseconds(5)});
  std::atomic<bool> stop{false};
  std::thread person([&stop] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    stop = true;
  });
  const auto report = fly(scenario, {}, &client, stop);
  person.join();
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->outcome, Outcome::kInterrupted);
  EXPECT_THAT(report->sentence, HasSubstr("interrupted"));
}

TEST(RealTime, FliesAtTheSpeedOfTheWorldAndReportsItsDeadlines) {
  auto scenario = circle();
  scenario.time_limit = std::chrono::milliseconds(1500);
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {});
  Options options;
  options.timing = protocol::Timing::kRealTime;
  int shown = 0;
  const auto report = fly(scenario, options, &client, kGoOn, [&shown](const Progress&) { ++shown; });
  ASSERT_TRUE(report.ok()) << report.error();
  EXPECT_EQ(report->outcome, Outcome::kTimeLimit) << report->sentence;
  EXPECT_NEAR(report->race_time_s, 1.5, 1e-6);
  EXPECT_GE(report->wall_s, 1.4);
  EXPECT_GE(report->loop_steps, 1400u);
  EXPECT_LE(report->loop_misses, report->loop_steps);
  EXPECT_GT(report->frames_sent, 10u);
  EXPECT_GT(shown, 3);
  const auto received = client.received();
  EXPECT_NEAR(static_cast<double>(received.states.size()), 200 * 1.5, 30);
  for (std::size_t i = 1; i < received.states.size(); ++i) ASSERT_GT(received.states[i], received.states[i - 1]);
  // On a machine that is busy the world's clock runs on while the race slips behind it; ticks go by the clock.
  EXPECT_GE(report->control_ticks, 65u);
  EXPECT_LE(static_cast<double>(report->control_ticks), 50 * report->wall_s + 10);
  EXPECT_THAT(summarize(*report), HasSubstr("Deadlines"));
}

TEST(RealTime, APlanThatStopsComingCountsAsLateTicks) {
  auto scenario = circle();
  scenario.time_limit = std::chrono::milliseconds(1000);
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {.silent_from = 100});  // after half a second
  Options options;
  options.timing = protocol::Timing::kRealTime;
  const Report report = race(scenario, options, &client);
  EXPECT_GT(report.late_ticks, 15u);
  EXPECT_GT(report.fallback_s, 0.3);
}

TEST(RealTime, TheVehicleIsHeldUntilThereIsAPlanAndTheRaceGivenUpWithoutOne) {
  const auto scenario = circle();
  test::PathFollower client(truth(scenario), scenario.vehicle.quadrotor, {.silent_from = 1});
  Options options;
  options.timing = protocol::Timing::kRealTime;
  options.give_up = std::chrono::milliseconds(300);
  const Report report = race(scenario, options, &client);
  EXPECT_EQ(report.outcome, Outcome::kLinkLost);
  EXPECT_EQ(report.race_time_s, 0.0);
  EXPECT_EQ(report.samples.back().state.p_WB, scenario.track.start_p_WB);
}

TEST(SimulationOptions, NonsenseIsRefused) {
  Options options;
  options.link_delay = std::chrono::seconds(2);
  EXPECT_THAT(validate(options).error(), HasSubstr("2000"));
  options.link_delay = std::chrono::milliseconds(10);
  options.timing = protocol::Timing::kRealTime;
  EXPECT_FALSE(validate(options).ok());
  options = {};
  options.link_loss = 1.5;
  EXPECT_THAT(validate(options).error(), HasSubstr("0 to 0.9"));
  options = {};
  options.link_jitter = std::chrono::seconds(2);
  EXPECT_THAT(validate(options).error(), HasSubstr("jitter is 2000"));
  EXPECT_EQ(validate(options).failure().field, "link_jitter");
  options = {};
  options.state_rate_hz = 5;
  EXPECT_THAT(validate(options).error(), HasSubstr("10 to 1000 Hz"));
  options = {};
  options.firmware.emplace();
  EXPECT_TRUE(validate(options).ok()) << "lockstep";
  options.timing = protocol::Timing::kRealTime;
  EXPECT_TRUE(validate(options).ok());
  options.px4.emplace();
  EXPECT_EQ(validate(options).failure().field, "px4") << "two firmwares";
  options.firmware.reset();
  EXPECT_EQ(validate(options).failure().field, "timing") << "PX4's SITL in real time";
  options.px4->hil.address = "serial:/dev/ttyACM0:921600";
  EXPECT_TRUE(validate(options).ok()) << "a board in real time";
  options.timing = protocol::Timing::kLockstep;
  EXPECT_THAT(validate(options).error(), HasSubstr("a board on a serial port runs by its own clock"));
  EXPECT_EQ(validate(options).failure().field, "timing");
  options.timing = protocol::Timing::kRealTime;
  options.px4.reset();
  options.firmware.emplace();
  options.firmware->address = "serial:/dev/ttyACM0:115200";
  EXPECT_THAT(validate(options).error(), HasSubstr("Betaflight on a board takes no simulated sensors"));
  options.firmware.emplace().silence_limit = std::chrono::milliseconds(1);
  EXPECT_EQ(validate(options).failure().field, "silence_limit");
}

}  // namespace
}  // namespace gatefield::simulator
