#include "server/operations/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <sstream>

#include "common/protocol/problems.h"

namespace gatefield::operations {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string page_of(const service::Figures& figures, const Health& health = {true, ""}) {
  const ServerWords words{.version = "1.2.3", .name = "pad", .isa = "avx2", .model_hash = 0xab, .domain = 7};
  return metrics(words, figures, health, process_figures(), 5);
}

/// Each sample of the text format, by name and labels.
std::map<std::string, double> samples_of(const std::string& page) {
  std::map<std::string, double> samples;
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.front() == '#') continue;
    const std::size_t blank = line.rfind(' ');
    samples[line.substr(0, blank)] = std::strtod(line.c_str() + blank, nullptr);
  }
  return samples;
}

TEST(Metrics, SayWhatTheServerIsAndDoes) {
  service::Figures figures;
  figures.totals.states_received = 100;
  figures.totals.deadlines_missed = 3;
  figures.totals.ticks_narrow = 4;
  figures.totals.samples_refused[static_cast<std::size_t>(ErrorCode::kNotRising)] = 9;
  figures.requests_refused[static_cast<std::size_t>(ErrorCode::kBusyServer)] = 2;
  const auto samples = samples_of(page_of(figures));
  EXPECT_EQ(samples.at(
                R"(gatefield_build_info{version="1.2.3",server="pad",isa="avx2",model="00000000000000ab",domain="7"})"),
            1);
  EXPECT_EQ(samples.at("gatefield_well"), 1);
  EXPECT_EQ(samples.at("gatefield_states_received_total"), 100);
  EXPECT_EQ(samples.at("gatefield_deadlines_missed_total"), 3);
  EXPECT_EQ(samples.at("gatefield_ticks_narrow_total"), 4);
  EXPECT_EQ(samples.at(R"(gatefield_samples_refused_total{code="not_rising"})"), 9);
  EXPECT_EQ(samples.at(R"(gatefield_requests_refused_total{code="busy_server"})"), 2);
  EXPECT_EQ(samples.at("gatefield_packets_dropped_total"), 5);
  EXPECT_GT(samples.at("process_resident_memory_bytes"), 1e6);
  EXPECT_EQ(samples_of(page_of({}, {false, "hangs"})).at("gatefield_well"), 0);
}

TEST(Metrics, SayHowMuchRoomThereIs) {
  service::Figures figures;
  figures.room = {1.5, 0.75, 0.5, {{"race", 0.25}}};
  figures.sessions_shed = 2;
  figures.sessions_displaced = 3;
  const auto samples = samples_of(page_of(figures));
  EXPECT_EQ(samples.at("gatefield_capacity_cores"), 1.5);
  EXPECT_EQ(samples.at("gatefield_load_cores"), 0.75);
  EXPECT_EQ(samples.at("gatefield_room_cores"), 0.5);
  EXPECT_EQ(samples.at(R"(gatefield_vehicle_cost_cores{profile="race"})"), 0.25);
  EXPECT_EQ(samples.at("gatefield_sessions_shed_total"), 2);
  EXPECT_EQ(samples.at("gatefield_sessions_displaced_total"), 3);
}

TEST(Metrics, StepTimesAreACumulativeHistogram) {
  pilot::StepTimes times;
  using std::chrono::microseconds;
  for (const int took_us : {100, 600, 700, 900000}) times.add(microseconds(took_us));
  service::Figures figures;
  figures.totals.steps = times.counts();
  const auto samples = samples_of(page_of(figures));
  EXPECT_EQ(samples.at(R"(gatefield_step_seconds_bucket{le="0.00025"})"), 1);
  EXPECT_EQ(samples.at(R"(gatefield_step_seconds_bucket{le="0.0005"})"), 1);
  EXPECT_EQ(samples.at(R"(gatefield_step_seconds_bucket{le="0.001"})"), 3);
  EXPECT_EQ(samples.at(R"(gatefield_step_seconds_bucket{le="0.05"})"), 3);
  EXPECT_EQ(samples.at(R"(gatefield_step_seconds_bucket{le="+Inf"})"), 4);
  EXPECT_EQ(samples.at("gatefield_step_seconds_count"), 4);
  EXPECT_NEAR(samples.at("gatefield_step_seconds_sum"), 0.9014, 1e-9);
}

TEST(Metrics, EachVehicleHasItsLinesWhileItIsThere) {
  service::Figures figures;
  service::Figures::Vehicle& vehicle = figures.vehicles.emplace_back();
  vehicle.telemetry.vehicle = "red";
  vehicle.telemetry.health.state_age_s = 0.025;
  vehicle.telemetry.health.problems = protocol::bit(protocol::Problem::kDepthMissing);
  vehicle.silent_s = 0.5;
  vehicle.round_trip_s = 0.25;
  const auto samples = samples_of(page_of(figures));
  EXPECT_EQ(samples.at("gatefield_sessions"), 1);
  EXPECT_EQ(samples.at(R"(gatefield_vehicle_silent_seconds{vehicle="red"})"), 0.5);
  EXPECT_EQ(samples.at(R"(gatefield_vehicle_round_trip_seconds{vehicle="red"})"), 0.25);
  EXPECT_EQ(samples.at(R"(gatefield_vehicle_state_age_seconds{vehicle="red"})"), 0.025);
  EXPECT_EQ(samples.at(R"(gatefield_vehicle_problem{vehicle="red",problem="depth_missing"})"), 1);
  EXPECT_THAT(page_of({}), Not(HasSubstr("vehicle=\"")));
}

/// The text format's own rules (Prometheus, "Exposition formats"): a reader drops the whole page for one bad line.
TEST(Metrics, EveryLineIsWellFormed) {
  service::Figures figures;
  figures.vehicles.resize(2);
  figures.vehicles[0].telemetry.vehicle = "a";
  figures.vehicles[1].telemetry.vehicle = "b";
  const std::regex comment(R"(# (HELP [a-z_]+ .+|TYPE [a-z_]+ (counter|gauge|histogram)))");
  const std::regex sample(R"([a-z_]+(\{[a-z]+="[^"\\]*"(,[a-z]+="[^"\\]*")*\})? [-+0-9.eInf]+)");
  std::istringstream lines(page_of(figures));
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count)
    EXPECT_TRUE(std::regex_match(line, comment) || std::regex_match(line, sample)) << line;
  EXPECT_GT(count, 80);
}

}  // namespace
}  // namespace gatefield::operations
