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

config::Scenario one_gate() {
  auto scenario = config::make_scenario(config::find_config("courses", "one-gate").value(),
                                        config::find_config("vehicles", "racer").value());
  if (!scenario) throw std::runtime_error(scenario.error());
  scenario.value().time_limit = std::chrono::seconds(20);
  return std::move(scenario).value();
}

sdk::Options link(const config::Scenario& scenario, protocol::Timing timing) {
  sdk::Options options;
  options.domain = own_domain();
  options.timing = timing;
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
  const config::Scenario scenario = fault.one_gate ? one_gate() : one_lap();
  sdk::Options told = link(scenario, fault.timing);
  if (fault.told) fault.told(&told);
  auto client = sdk::Client::connect(told);
  if (!client) throw std::runtime_error(client.error());
  FalsifyingClient falsifying(std::move(client).value(), fault.falsification);

  simulator::Options options;
  options.timing = fault.timing;
  options.depth_in_counts = fault.depth_in_counts;
  options.answer_timeout = std::chrono::milliseconds(1500);  // states that are refused get no answer
  std::atomic<bool> stop{false};
  Flown flown;
  const auto hear = [&](const simulator::HeardProblem& heard) {
    flown.heard_s.emplace(heard.problem, heard.race_time_s);
  };
  const auto go_on = [&](const simulator::Progress& progress) {
    const auto heard = [&](protocol::Problem problem) {
      const auto found = flown.heard_s.find(problem);
      return found != flown.heard_s.end() && progress.race_time_s >= found->second + kFlownOn_s;
    };
    if (!fault.until_heard.empty() && std::all_of(fault.until_heard.begin(), fault.until_heard.end(), heard))
      stop = true;
  };
  auto report = simulator::fly(scenario, options, &falsifying, stop, go_on, hear);
  if (!report) throw std::runtime_error(report.error());
  flown.report = std::move(report).value();
  for (const simulator::Sample& sample : flown.report.samples) {
    flown.moving_s = sample.t_s;
    if (sample.state.v_WB.norm() > 0.3) break;
  }
  return flown;
}

}  // namespace gatefield::test
