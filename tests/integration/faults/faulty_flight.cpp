#include "tests/integration/faults/faulty_flight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>

#include "common/config/locate.h"
#include "common/config/scenario.h"
#include "tests/support/dds_domain.h"

namespace gatefield::test {
namespace {

config::Scenario one_lap() {
  auto scenario = config::load_scenario(config::find_config("scenarios", "circle-0.3m").value());
  if (!scenario) throw std::runtime_error(scenario.error());
  scenario.value().track.course.laps = 1;
  scenario.value().time_limit = std::chrono::seconds(20);
  return std::move(scenario).value();
}

sdk::Options link(const config::Scenario& scenario) {
  sdk::Options options;
  options.domain = own_domain();
  options.timing = protocol::Timing::kLockstep;
  options.seed = config::planner_seed_of(scenario);
  options.speed_limit_m_s = 7.0;
  options.quadrotor = scenario.vehicle.quadrotor;
  options.actuation = scenario.vehicle.actuation;
  options.camera = scenario.vehicle.camera;
  options.course = scenario.track.course;
  options.connect_timeout = std::chrono::seconds(20);
  return options;
}

}  // namespace

std::string Flown::story() const {
  std::string out;
  for (const auto& [problem, at_s] : heard_s)
    out += std::string(protocol::name(problem)) + " at " + std::to_string(at_s) + " s\n";
  return out + "moving at " + std::to_string(moving_s) + " s\n" + summarize(report);
}

Flown fly_with(const Fault& fault) {
  const config::Scenario scenario = one_lap();
  sdk::Options told = link(scenario);
  if (fault.told) fault.told(&told);
  auto client = sdk::Client::connect(told);
  if (!client) throw std::runtime_error(client.error());
  FalsifyingClient falsifying(std::move(client).value(), fault.falsification);

  simulator::Options options;
  options.depth_in_counts = fault.depth_in_counts;
  options.answer_timeout = std::chrono::milliseconds(1500);  // states that are refused get no answer
  std::atomic<bool> stop{false};
  Flown flown;
  auto report = simulator::fly(scenario, options, &falsifying, stop, {}, [&](const simulator::HeardProblem& heard) {
    flown.heard_s.emplace(heard.problem, heard.race_time_s);
    stop = !fault.until_heard.empty() &&
           std::all_of(fault.until_heard.begin(), fault.until_heard.end(),
                       [&](protocol::Problem problem) { return flown.heard_s.contains(problem); });
  });
  if (!report) throw std::runtime_error(report.error());
  flown.report = std::move(report).value();
  for (const simulator::Sample& sample : flown.report.samples) {
    flown.moving_s = sample.t_s;
    if (sample.state.v_WB.norm() > 0.3) break;
  }
  return flown;
}

}  // namespace gatefield::test
