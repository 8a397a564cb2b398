#include <gatefield/sdk/client.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "tests/integration/sdk/scripted_server.h"
#include "tests/support/dds_domain.h"
#include "tests/support/messages.h"

namespace gatefield::sdk {
namespace {

using namespace std::chrono_literals;
using test::accept_as;
using test::own_domain;
using test::ScriptedServer;

protocol::ThrustRateCommand answer_to(const protocol::VehicleState& state) {
  auto command = test::good_command(state.vehicle, state.sequence);
  command.session = state.session;
  command.answers_sequence = state.sequence;
  command.answers_stamp = command.plan_start = state.stamp;
  return command;
}

std::optional<protocol::ThrustRateCommand> answer(const protocol::VehicleState& state) { return answer_to(state); }

Options options(std::chrono::milliseconds timeout = 5000ms) {
  Options options;
  options.domain = own_domain();
  options.course = test::good_request().course;
  options.timing = protocol::Timing::kLockstep;
  options.connect_timeout = timeout;
  return options;
}

std::unique_ptr<Client> must_connect(const Options& how = options()) {
  auto client = Client::connect(how);
  EXPECT_TRUE(client.ok()) << (client.ok() ? "" : client.error());
  if (!client.ok()) std::abort();
  return std::move(client).value();
}

TEST(Connect, SaysWhenNobodyAnswers) {
  const auto client = Client::connect(options(300ms));
  ASSERT_FALSE(client.ok());
  EXPECT_NE(client.error().find("no planning server answered"), std::string::npos) << client.error();
  EXPECT_EQ(client.failure().code, ErrorCode::kNoAnswer);
}

TEST(Connect, CancelledItDoesNotWaitForATimeOut) {
  std::atomic<bool> cancel{false};
  std::thread impatient([&] {
    std::this_thread::sleep_for(200ms);
    cancel = true;
  });
  const auto begin = std::chrono::steady_clock::now();
  const auto client = Client::connect(options(60s), &cancel);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 10s);
  impatient.join();
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.failure().code, ErrorCode::kNoAnswer);
  EXPECT_NE(client.error().find("cancelled"), std::string::npos) << client.error();
}

TEST(Connect, ABadVehicleNeverLeavesTheHouse) {
  Options bad = options();
  bad.quadrotor.mass_kg = 0;
  const auto client = Client::connect(bad);
  ASSERT_FALSE(client.ok());
  EXPECT_NE(client.error().find("mass_kg"), std::string::npos) << client.error();
}

TEST(Connect, ARefusalIsTheError) {
  ScriptedServer server(
      "planner-1",
      [](const protocol::SessionRequest& request) {
        auto reply = test::good_reply(request.vehicle, request.request);
        reply.accepted = false;
        reply.session = 0;
        reply.code = ErrorCode::kUnknownName;
        reply.field = "profile";
        reply.value = "\"race\"";
        reply.expected = "paper";
        reply.reason = "profile is \"race\", expected paper";
        return std::optional(reply);
      },
      answer);
  const auto client = Client::connect(options());
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.error(), "profile is \"race\", expected paper");
  EXPECT_EQ(client.failure().code, ErrorCode::kUnknownName);
  EXPECT_EQ(client.failure().field, "profile");
  EXPECT_EQ(client.failure().value, "\"race\"");
  EXPECT_EQ(client.failure().expected, "paper");
}

Options driven_by_rates() {
  Options rates = options();
  rates.actuation.kind = Actuation::Kind::kBodyRates;
  rates.actuation.thrust_time_constant_s = 0.03;
  rates.actuation.rate_time_constant_s = Eigen::Vector3d(0.02, 0.02, 0.1);
  return rates;
}

TEST(Connect, TheServerLearnsHowTheVehicleIsDriven) {
  ScriptedServer server("planner-1", accept_as(50), answer);
  const Options rates = driven_by_rates();
  must_connect(rates);
  ASSERT_TRUE(server.wait([&] { return !server.requests.empty(); }));
  const Actuation heard = server.requests.front().actuation;
  EXPECT_EQ(heard.kind, Actuation::Kind::kBodyRates);
  EXPECT_EQ(heard.thrust_time_constant_s, 0.03);
  EXPECT_EQ(heard.rate_time_constant_s, rates.actuation.rate_time_constant_s);
}

TEST(Connect, BusyIsTriedAgainUntilItPasses) {
  std::atomic<int> attempts{0};
  ScriptedServer server(
      "planner-1",
      [&](const protocol::SessionRequest& request) {
        auto reply = test::good_reply(request.vehicle, request.request);
        if (++attempts < 3) {
          reply.accepted = false;
          reply.session = 0;
          reply.code = ErrorCode::kBusyName;
          reply.reason = "busy: drone is flown by another client";
          reply.retry_after_s = 0;
        }
        return std::optional(reply);
      },
      answer);
  EXPECT_TRUE(Client::connect(options()).ok());
  EXPECT_EQ(attempts, 3);
}

TEST(Connect, BusyForTooLongIsTheError) {
  ScriptedServer server(
      "planner-1",
      [](const protocol::SessionRequest& request) {
        auto reply = test::good_reply(request.vehicle, request.request);
        reply.accepted = false;
        reply.session = 0;
        reply.code = ErrorCode::kBusyName;
        reply.reason = "busy: drone is flown by another client";
        return std::optional(reply);
      },
      answer);
  const auto client = Client::connect(options(1500ms));
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.error(), "busy: drone is flown by another client");
  EXPECT_TRUE(may_pass(client.failure().code));
}

TEST(Connect, AsksAgainWhenTheServerMissedIt) {
  std::atomic<int> heard{0};
  ScriptedServer server(
      "planner-1",
      [&](const protocol::SessionRequest& request) -> std::optional<protocol::SessionReply> {
        if (++heard == 1) return std::nullopt;
        return accept_as(50)(request);
      },
      answer);
  EXPECT_TRUE(Client::connect(options()).ok());
}

TEST(Fly, StateDepthCommandTelemetryAndStatistics) {
  ScriptedServer server("planner-1", accept_as(50), answer);
  auto client = must_connect();
  EXPECT_EQ(client->session().session, 50u);
  EXPECT_EQ(client->session().server, "planner-1");
  EXPECT_FALSE(client->newest().has_value());

  const std::vector<std::uint16_t> counts(160 * 90, 2500);
  EXPECT_EQ(client->send_depth_counts(1s, counts), 1u);
  EXPECT_EQ(client->send_depth(1s, std::vector<float>(10)), 0u) << "a size that is not the camera's";
  const std::uint64_t sequence = client->send_state(1s, test::good_state().state);
  EXPECT_EQ(sequence, 1u);
  const auto command = client->wait_for_answer(sequence, 2s);
  ASSERT_TRUE(command.has_value());
  EXPECT_EQ(command->answers_sequence, 1u);
  EXPECT_TRUE(client->newest().has_value());
  EXPECT_FALSE(client->newest().has_value()) << "the same command twice";

  ASSERT_TRUE(server.wait([&] { return !server.frames.empty(); }));
  EXPECT_EQ(server.frames[0].pixels.size(), 2u * 160 * 90);
  EXPECT_EQ(server.frames[0].pixels[0] + 256 * server.frames[0].pixels[1], 2500);
  EXPECT_EQ(server.states[0].depth_sequence, 1u);
  EXPECT_EQ(server.states[0].session, 50u);

  // What it heard and measured goes into the next state; in lockstep, the time by its own clock until the plan was
  // used.
  client->play(1030ms, test::good_state().state, 1ms);
  const std::size_t before = server.states.size();
  client->send_state(2s, test::good_state().state);
  ASSERT_TRUE(server.wait([&] { return server.states.size() > before && server.states.back().sequence == 2; }));
  EXPECT_EQ(server.states.back().heard_waypoint, test::good_health().target_waypoint);
  EXPECT_EQ(server.states.back().heard_lap, test::good_health().lap);
  EXPECT_EQ(server.states.back().round_trip, 30ms);

  const LinkStatistics statistics = client->statistics();
  EXPECT_GE(statistics.commands, 1u);
  EXPECT_EQ(statistics.rejected, 0u);
  EXPECT_GT(statistics.round_trip_p50_s, 0.0);
  EXPECT_GE(statistics.round_trip_p99_s, statistics.round_trip_p50_s);
  EXPECT_EQ(statistics.solve_p50_s, test::good_health().solve_time_s);

  EXPECT_FALSE(client->telemetry().has_value());
  auto telemetry = test::good_telemetry();
  telemetry.session = 50;
  std::optional<protocol::Telemetry> heard;
  for (int i = 0; i < 50 && !heard; ++i) {
    server.send(telemetry);
    std::this_thread::sleep_for(20ms);
    heard = client->telemetry();
  }
  EXPECT_TRUE(heard.has_value());
}

TEST(Fly, WhatTheServerFindsWrongIsTold) {
  using protocol::bit, protocol::Problem;
  std::atomic<protocol::Problems> wrong{bit(Problem::kStatesLookNed)};
  ScriptedServer server("planner-1", accept_as(50), [&](const protocol::VehicleState& state) {
    auto command = answer_to(state);
    command.health.problems = wrong;
    return std::optional(command);
  });
  auto client = must_connect();
  EXPECT_EQ(client->problems(), 0u);
  EXPECT_FALSE(client->problem_change().has_value());

  ASSERT_TRUE(client->wait_for_answer(client->send_state(1s, test::good_state().state), 2s).has_value());
  EXPECT_EQ(client->problems(), bit(Problem::kStatesLookNed));
  const auto began = client->problem_change();
  ASSERT_TRUE(began.has_value());
  EXPECT_EQ(began->problem, Problem::kStatesLookNed);
  EXPECT_TRUE(began->began);
  EXPECT_FALSE(client->problem_change().has_value());

  wrong = 0;
  ASSERT_TRUE(client->wait_for_answer(client->send_state(2s, test::good_state().state), 2s).has_value());
  EXPECT_EQ(client->problems(), 0u);
  const auto ended = client->problem_change();
  ASSERT_TRUE(ended.has_value());
  EXPECT_EQ(ended->problem, Problem::kStatesLookNed);
  EXPECT_FALSE(ended->began);

  // A server that withholds its plans has only telemetry to say so.
  auto telemetry = test::good_telemetry();
  telemetry.session = 50;
  telemetry.health.problems = bit(Problem::kPlanThrust);
  for (int i = 0; i < 50 && client->problems() == 0; ++i) {
    server.send(telemetry);
    std::this_thread::sleep_for(20ms);
  }
  EXPECT_EQ(client->problems(), bit(Problem::kPlanThrust));
}

TEST(Fly, AnAnswerComesAlthoughStatesAreLost) {
  std::atomic<int> seen{0};
  ScriptedServer server("planner-1", accept_as(50),
                        [&](const protocol::VehicleState& state) -> std::optional<protocol::ThrustRateCommand> {
                          if (++seen < 5) return std::nullopt;
                          return answer_to(state);
                        });
  auto client = must_connect();
  EXPECT_TRUE(client->wait_for_answer(client->send_state(1s, test::good_state().state), 2s).has_value());
  EXPECT_GE(seen, 5);
}

TEST(Fly, NoAnswerEndsTheWait) {
  ScriptedServer server("planner-1", accept_as(50),
                        [](const protocol::VehicleState&) { return std::optional<protocol::ThrustRateCommand>(); });
  auto client = must_connect();
  const auto start = std::chrono::steady_clock::now();
  EXPECT_FALSE(client->wait_for_answer(client->send_state(1s, test::good_state().state), 200ms).has_value());
  const auto took = std::chrono::steady_clock::now() - start;
  EXPECT_GE(took, 200ms);
  EXPECT_LT(took, 1000ms);
}

TEST(Fly, WhoWaitsInShortTurnsSendsTheFrameAgain) {
  ScriptedServer server("planner-1", accept_as(50),
                        [](const protocol::VehicleState&) { return std::optional<protocol::ThrustRateCommand>(); });
  auto client = must_connect();
  client->send_depth_counts(1s, std::vector<std::uint16_t>(160 * 90, 3000));
  ASSERT_TRUE(server.wait([&] { return !server.frames.empty(); }));
  const std::uint64_t sequence = client->send_state(1s, test::good_state().state);
  for (int turn = 0; turn < 10; ++turn) EXPECT_FALSE(client->wait_for_answer(sequence, 50ms).has_value());
  EXPECT_TRUE(server.wait([&] { return server.frames.size() > 1; }));
}

TEST(Fly, PlaysThePlanThenFallsBack) {
  ScriptedServer server("planner-1", accept_as(50), answer);
  auto client = must_connect();
  const QuadrotorState state = test::good_state().state;
  EXPECT_EQ(client->play(1s, state, 1ms).source, Setpoint::Source::kFallback) << "no plan yet";
  const auto command = client->wait_for_answer(client->send_state(1s, state), 2s);
  ASSERT_TRUE(command.has_value());
  const Setpoint now = client->play(1s + 31ms, state, 1ms);
  EXPECT_EQ(now.source, Setpoint::Source::kPlan);
  EXPECT_EQ(now.thrust_rate_n_s, command->thrust_rate_n_s[1]);
  EXPECT_EQ(client->play(1s + 599ms, state, 1ms).source, Setpoint::Source::kPlan);
  EXPECT_EQ(client->play(1s + 600ms, state, 1ms).source, Setpoint::Source::kFallback);
}

std::optional<protocol::ThrustRateCommand> answer_by_rates(const protocol::VehicleState& state) {
  auto command = answer_to(state);
  command.actuation = Actuation::Kind::kBodyRates;
  command.thrust_rate_n_s.fill(Eigen::Vector4d::Zero());
  command.rotor_thrust_n.fill(Eigen::Vector4d::Zero());
  return command;
}

TEST(Fly, AVehicleDrivenByBodyRatesPlaysItsCommandsThenFallsBackByThem) {
  ScriptedServer server("planner-1", accept_as(50), answer_by_rates);
  auto client = must_connect(driven_by_rates());
  QuadrotorState state = test::good_state().state;
  state.thrust_n.setZero();
  state.thrust_command_n.setZero();
  const auto command = client->wait_for_answer(client->send_state(1s, state, false), 2s);
  ASSERT_TRUE(command.has_value());
  const Setpoint plan = client->play(1s + 31ms, state, 50ms);
  EXPECT_EQ(plan.source, Setpoint::Source::kPlan);
  EXPECT_EQ(plan.collective_thrust_n, command->collective_thrust_n[1]);
  EXPECT_EQ(plan.body_rates_rad_s, command->body_rates_rad_s[1]);
  const Setpoint fallback = client->play(1s + 600ms, state, 1ms);
  EXPECT_EQ(fallback.source, Setpoint::Source::kFallback);
  EXPECT_GT(fallback.collective_thrust_n, 0);
  EXPECT_TRUE(fallback.rotor_thrust_n.isZero(0) && fallback.thrust_rate_n_s.isZero(0));
}

TEST(Fly, AStateSaysWhatTheVehicleIsAskedForWhereThatIsNotThePlan) {
  using protocol::AskedBy;
  ScriptedServer server("planner-1", accept_as(50), answer_by_rates);
  auto client = must_connect(driven_by_rates());
  const QuadrotorState state = test::good_state().state;
  const auto told = [&](Stamp stamp) {
    const std::uint64_t sequence = client->send_state(stamp, state, false);
    EXPECT_TRUE(client->wait_for_answer(sequence, 2s).has_value());
    server.wait([&] { return !server.states.empty() && server.states.back().sequence == sequence; });
    return server.states.back().asked;
  };
  const auto near = [](const protocol::Asked& asked, const Setpoint& setpoint) {
    return std::abs(asked.command[0] - setpoint.collective_thrust_n) < 1e-5 &&
           (asked.command.tail<3>() - setpoint.body_rates_rad_s).norm() < 1e-5;
  };
  EXPECT_EQ(told(1s).by, AskedBy::kPlans) << "nothing was asked for yet";
  const Setpoint plan = client->play(1s + 31ms, state, 1ms);
  EXPECT_EQ(told(1s + 40ms).by, AskedBy::kPlans);
  client->applied(1s + 50ms, client->play(1s + 50ms, state, 1ms));
  EXPECT_EQ(told(1s + 50ms).by, AskedBy::kPlans) << "it was what play() said";

  Setpoint mixed = plan;
  mixed.collective_thrust_n += 0.5;
  mixed.body_rates_rad_s.x() -= 0.25;
  client->play(1s + 60ms, state, 1ms);
  client->applied(1s + 60ms, mixed);
  protocol::Asked asked = told(1s + 60ms);
  EXPECT_EQ(asked.by, AskedBy::kOther);
  EXPECT_TRUE(near(asked, mixed));
  client->applied(1s + 70ms, std::nullopt);
  EXPECT_EQ(told(1s + 65ms).by, AskedBy::kOther) << "of a state some time back, what held then";
  EXPECT_EQ(told(1s + 70ms).by, AskedBy::kUnknown);

  const Setpoint fallback = client->play(3s, state, 1ms);
  ASSERT_EQ(fallback.source, Setpoint::Source::kFallback);
  asked = told(3s);
  EXPECT_EQ(asked.by, AskedBy::kFallback);
  EXPECT_TRUE(near(asked, fallback));
  EXPECT_EQ(client->play(3s + 1ms, state, 1ms).source, Setpoint::Source::kPlan);
  EXPECT_EQ(told(3s + 1ms).by, AskedBy::kPlans);
}

TEST(Fly, PlansOfTheOtherKindAreDropped) {
  ScriptedServer server("planner-1", accept_as(50), answer);  // rotor thrusts
  auto client = must_connect(driven_by_rates());
  EXPECT_FALSE(client->wait_for_answer(client->send_state(1s, test::good_state().state), 300ms).has_value());
  EXPECT_GT(client->statistics().rejected, 0u);
  EXPECT_EQ(client->statistics().commands, 0u);
}

TEST(Fly, CommandsOfAnotherSessionAreDropped) {
  ScriptedServer server("planner-1", accept_as(50), [](const protocol::VehicleState& state) {
    auto command = answer_to(state);
    command.session = 51;
    return std::optional(command);
  });
  auto client = must_connect();
  EXPECT_FALSE(client->wait_for_answer(client->send_state(1s, test::good_state().state), 300ms).has_value());
  EXPECT_GT(client->statistics().rejected, 0u);
  EXPECT_EQ(client->statistics().commands, 0u);
  EXPECT_EQ(client->play(1s, test::good_state().state, 1ms).source, Setpoint::Source::kFallback);
}

TEST(Restart, AServerThatComesBackIsJoinedWithoutACall) {
  auto server = std::make_unique<ScriptedServer>("planner-1", accept_as(50), answer);
  auto client = must_connect();
  client->send_depth_counts(1s, std::vector<std::uint16_t>(160 * 90, 3000));
  ASSERT_TRUE(client->wait_for_answer(client->send_state(1s, test::good_state().state), 2s).has_value());
  server.reset();
  server = std::make_unique<ScriptedServer>("planner-1", accept_as(60), answer);

  // In lockstep the client just waits: the new session, the depth frame and the state find their way.
  const auto command = client->wait_for_answer(client->send_state(2s, test::good_state().state), 5s);
  ASSERT_TRUE(command.has_value());
  EXPECT_EQ(command->session, 60u);
  EXPECT_EQ(client->session().session, 60u);
  EXPECT_EQ(client->statistics().reconnects, 1u);
  // It hears those of the session before, too: the client takes its time to believe that the other one is gone.
  ASSERT_TRUE(server->wait([&] { return !server->frames.empty() && server->frames.back().session == 60u; }));
  EXPECT_EQ(server->frames.back().sequence, 1u);
}

/// The next that is told within two seconds.
std::optional<SessionChange> change_of(Client* client, Stamp* stamp) {
  for (int i = 0; i < 200; ++i) {
    client->send_state(*stamp += 10ms, test::good_state().state);
    if (auto change = client->session_change()) return change;
    std::this_thread::sleep_for(10ms);
  }
  return std::nullopt;
}

TEST(Session, WhyItsServerEndedItIsTold) {
  std::atomic<bool> full{false};
  const auto reply = [&](const protocol::SessionRequest& request) {
    auto reply = test::good_reply(request.vehicle, request.request);
    reply.session = 50;
    if (!full) return std::optional(reply);
    reply.accepted = false;
    reply.session = 0;
    reply.code = ErrorCode::kBusyServer;
    reply.reason = "session ended: a vehicle of higher priority needs its place";
    return std::optional(reply);
  };
  ScriptedServer server("planner-1", reply, answer);
  auto client = must_connect();
  Stamp stamp = 1s;
  ASSERT_TRUE(client->wait_for_answer(client->send_state(stamp, test::good_state().state), 2s).has_value());
  EXPECT_FALSE(client->session_change().has_value());

  full = true;
  server.wait([&] { return !server.requests.empty(); });
  server.send(*reply(server.requests.front()));
  const auto lost = change_of(client.get(), &stamp);
  ASSERT_TRUE(lost.has_value());
  EXPECT_EQ(lost->kind, SessionChange::Kind::kLost);
  EXPECT_EQ(lost->why, ErrorCode::kBusyServer);
  EXPECT_NE(lost->sentence.find("a vehicle of higher priority needs its place"), std::string::npos) << lost->sentence;
}

TEST(Session, AServerThatIsGoneIsTold) {
  auto server = std::make_unique<ScriptedServer>("planner-1", accept_as(50), answer);
  auto client = must_connect();
  Stamp stamp = 1s;
  ASSERT_TRUE(client->wait_for_answer(client->send_state(stamp, test::good_state().state), 2s).has_value());
  server.reset();
  const auto lost = change_of(client.get(), &stamp);
  ASSERT_TRUE(lost.has_value());
  EXPECT_EQ(lost->kind, SessionChange::Kind::kLost);
  EXPECT_EQ(lost->why, ErrorCode::kNoAnswer);
  EXPECT_EQ(lost->server, "planner-1");

  ScriptedServer next("planner-2", accept_as(60, "planner-2"), answer);
  std::optional<SessionChange> again;
  for (int i = 0; i < 3 && !again; ++i) again = change_of(client.get(), &stamp);
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->kind, SessionChange::Kind::kRejoined);
  EXPECT_EQ(again->server, "planner-2");
}

TEST(TwoServers, TheFirstWinsAndTheOtherTakesOverWhenItIsGone) {
  auto first = std::make_unique<ScriptedServer>("planner-1", accept_as(50, "planner-1"), answer);
  auto client = must_connect();
  ScriptedServer second("planner-2", accept_as(70, "planner-2"), [](const protocol::VehicleState& state) {
    return state.session == 70 ? answer(state) : std::nullopt;  // as servers do
  });
  ASSERT_TRUE(second.wait([&] { return !second.requests.empty(); }));
  std::this_thread::sleep_for(100ms);
  ASSERT_TRUE(client->wait_for_answer(client->send_state(1s, test::good_state().state), 2s).has_value());
  EXPECT_EQ(client->session().server, "planner-1");
  second.wait([&] {
    for (const auto& state : second.states) EXPECT_EQ(state.session, 50u) << "a state for the second server";
    return true;
  });

  first.reset();
  const auto command = client->wait_for_answer(client->send_state(2s, test::good_state().state), 5s);
  ASSERT_TRUE(command.has_value());
  EXPECT_EQ(command->session, 70u);
}

TEST(Leave, TheServerIsToldOnce) {
  ScriptedServer server("planner-1", accept_as(50), answer);
  {
    auto client = must_connect();
    client->send_state(1s, test::good_state().state);
  }
  ASSERT_TRUE(server.wait([&] {
    return !server.requests.empty() && server.requests.back().action == protocol::SessionRequest::Action::kLeave;
  }));
  EXPECT_EQ(server.requests.back().request, server.requests.front().request);
  EXPECT_FALSE(server.wait([&] { return !server.gone.empty(); }, 300ms)) << "a goodbye and a disappearance";
}

}  // namespace
}  // namespace gatefield::sdk
