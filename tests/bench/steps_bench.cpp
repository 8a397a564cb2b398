// A planner's whole step on inputs of a recorded flight, and many vehicles on one pool of control threads.

#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <iostream>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "common/base/statistics.h"
#include "common/course/course.h"
#include "server/kernels/backend.h"
#include "server/perception/gate_sensor.h"
#include "server/perception/learned/decoded_field.h"
#include "server/perception/learned/depth_encoder.h"
#include "server/planner/profile_file.h"
#include "server/service/workers.h"
#include "tests/bench/flight.h"
#include "tests/bench/register.h"
#include "tests/support/crew_threads.h"

namespace gatefield::bench {
namespace {

planner::Profile profile(const std::string& name) {
  auto read = planner::load_profile(std::string(GATEFIELD_SOURCE_DIR "/deploy/config/profiles/") + name + ".txt");
  if (!read) {
    std::cerr << "gatefield-bench: " << read.error() << "\n";
    std::exit(2);
  }
  return std::move(read).value();
}

/// Steps with a field of `model`'s, flown once.
const std::vector<RecordedStep>& flight(const std::string& model, const std::string& name) {
  static std::map<std::string, std::vector<RecordedStep>> flights;
  auto& steps = flights[model + "/" + name];
  if (steps.empty()) {
    steps = fly(shipped(model), profile(name), 12.0);
    std::erase_if(steps, [](const RecordedStep& step) { return step.input.target.field == nullptr; });
  }
  return steps;
}

/// The same steps with fields that another back end computes.
std::vector<RecordedStep> on(const kernels::Backend& backend, const model::Bundle& bundle,
                             const std::vector<RecordedStep>& flown) {
  const auto decoder = backend.prepare(bundle.decoder());
  std::vector<RecordedStep> steps = flown;
  for (RecordedStep& step : steps) {
    for (gates::GateBelief* const belief : {&step.input.target, &step.input.next}) {
      if (belief->field == nullptr) continue;
      auto field = std::make_shared<perception::DecodedField>();
      field->decoder = static_cast<const perception::DecodedField&>(*belief->field).decoder;
      kernels::adopt(decoder, &field->decoder);
      belief->field = field.get();
      step.fields.push_back(std::move(field));
    }
  }
  return steps;
}

/// One thread's own time does not count what else ran; with several there is only the clock on the wall.
double seconds_now(int threads) {
  timespec time{};
  clock_gettime(threads == 1 ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void percentiles(benchmark::State& state, const std::vector<double>& values_s) {
  state.counters["p50_ms"] = 1e3 * quantile(values_s, 0.5);
  state.counters["p99_ms"] = 1e3 * quantile(values_s, 0.99);
}

/// Steps of every case, evenly over the flight, so that all saw the same of it.
constexpr std::size_t kSteps = 100;

struct StepCase {
  std::string model, profile_name;
  const kernels::Backend* backend;
  int samples, steps, threads;
  bool leave_out;
};

void step(benchmark::State& state, const StepCase& which) {
  const std::vector<RecordedStep> flown =
      on(*which.backend, shipped(which.model), flight(which.model, which.profile_name));
  if (flown.empty()) return state.SkipWithError("no gate was seen in the recorded flight");
  planner::Profile shape = profile(which.profile_name);
  shape.samples = which.samples;
  shape.steps = which.steps;
  kernels::Crew crew(1);
  const test::CrewThreads others(&crew, which.threads - 1);
  auto planner =
      planner::Planner::create(shape, QuadrotorModel{}, circle_course(), shipped(which.model).manifest().cone_angle_rad,
                               1, {.crew = &crew, .leave_out = which.leave_out, .backend = which.backend});
  if (!planner) return state.SkipWithError(planner.error().c_str());
  planner::Plan plan;
  std::vector<double> times_s;
  double decoded = 0.0;
  std::size_t i = 0;
  for (auto _ : state) {
    planner::PlanInput input = flown[i++ % kSteps * flown.size() / kSteps].input;
    input.step = i;
    const double begin_s = seconds_now(which.threads);
    planner.value()->plan(input, &plan);
    times_s.push_back(seconds_now(which.threads) - begin_s);
    state.SetIterationTime(times_s.back());
    decoded += plan.decoded_rollouts;
  }
  percentiles(state, times_s);
  state.counters["decoded"] = decoded / (double(times_s.size()) * which.samples);
}

/// Sees gates where a recorded flight saw them, whatever it is shown.
class RecordedSensor final : public perception::GateSensor {
 public:
  explicit RecordedSensor(const gates::Snapshot* snapshot) : snapshot_(snapshot) {}
  bool steerable() const noexcept override { return false; }
  std::optional<perception::Observation> look(const perception::View&, const gates::Expectation& gate,
                                              perception::Where) override {
    perception::Observation seen;
    seen.gate.X_WG = gate_pose(gate.center_W, gate.axis_W);
    field_ = snapshot_->gates[gate.gate].field;
    return seen;
  }
  std::shared_ptr<const gates::Field> field(const Eigen::Isometry3d&, const Eigen::Isometry3d&,
                                            const GateShape&) override {
    return field_;
  }
  perception::FieldSource source_of(const gates::Field&) const override { return {}; }
  Result<std::shared_ptr<const gates::Field>> restore(const perception::FieldSource&, const GateShape&) override {
    return Error{"a recorded field can't be made anew"};
  }

 private:
  const gates::Snapshot* snapshot_;
  std::shared_ptr<const gates::Field> field_;
};

class NoTransport final : public service::Transport {
 public:
  void send(const protocol::SessionReply&) override {}
  bool send(const protocol::ThrustRateCommand&) noexcept override { return true; }
  bool send(const protocol::Telemetry&) noexcept override { return true; }
  void forget(const std::string&) override {}
};

/// Pilots at 50 Hz on two control threads for three seconds. A deadline is met when the command is out before the
/// next control tick.
void vehicles(benchmark::State& state, int count) {
  using namespace std::chrono_literals;
  const std::vector<RecordedStep>& flown = flight("race", "race");
  if (flown.empty()) return state.SkipWithError("no gate was seen in the recorded flight");
  planner::Profile shape = profile("race");
  shape.samples = 1024;
  const MonotonicClock clock;
  NoTransport transport;
  for (auto _ : state) {
    kernels::Crew crew(2);
    std::vector<std::shared_ptr<pilot::Pilot>> pilots;
    service::ControlPool pool({2, false, &crew, {}}, &clock, &transport);
    const RecordedStep& moment = flown[flown.size() / 2];
    for (int i = 0; i < count; ++i) {
      pilot::PilotParts parts;
      parts.request.vehicle = "drone" + std::to_string(i);
      parts.request.camera = default_camera();
      parts.request.course.waypoints = {{moment.input.target.center_W, moment.input.target.axis_W, {}},
                                        {moment.input.next.center_W, moment.input.next.axis_W, {}}};
      parts.session = static_cast<std::uint64_t>(i) + 1;
      auto planner = planner::Planner::create(shape, parts.request.quadrotor, parts.request.course, kGuideConeAngle_rad,
                                              parts.session, {.crew = &crew});
      if (!planner) return state.SkipWithError(planner.error().c_str());
      parts.planner = std::move(planner).value();
      parts.sensor = std::make_unique<RecordedSensor>(moment.snapshot.get());
      parts.sight.view_margin_px_per_width = 100.0;  // both gates, wherever the vehicle looks
      parts.now = clock.now();
      pilots.push_back(std::make_shared<pilot::Pilot>(std::move(parts)));
    }
    const auto begin = clock.now();
    std::uint64_t sequence = 0;
    const auto feed = [&] {
      ++sequence;
      for (const auto& pilot : pilots) {
        protocol::VehicleState sample;
        sample.vehicle = pilot->vehicle();
        sample.session = pilot->session();
        sample.sequence = sequence;
        sample.stamp = clock.now();
        sample.state = moment.input.start;
        pilot->intake().take_state(sample, sample.stamp);
        if (sequence > 2) continue;
        protocol::DepthFrame frame;  // makes the pilot see the gates
        frame.vehicle = pilot->vehicle();
        frame.session = pilot->session();
        frame.sequence = sequence;
        frame.stamp = sample.stamp;
        frame.width_px = 160;
        frame.height_px = 90;
        frame.pixels.assign(160 * 90 * 2, 7);
        pilot->intake().take_depth(frame, sample.stamp);
        pilot->looking().look();
      }
    };
    feed();
    for (const auto& pilot : pilots) pool.add(pilot);
    while (clock.now() - begin < 3s) {
      std::this_thread::sleep_for(20ms);
      feed();
    }
    for (const auto& pilot : pilots) pool.remove(pilot.get());
    double sent = 0, missed = 0, solve = 0;
    for (const auto& pilot : pilots) {
      protocol::Telemetry telemetry;
      pilot->fill(clock.now(), &telemetry);
      sent += static_cast<double>(telemetry.commands_sent);
      missed += static_cast<double>(telemetry.deadlines_missed);
      solve += telemetry.health.solve_time_s;
    }
    state.SetIterationTime(solve / count);
    state.counters["met_percent"] = 100.0 * sent / std::max(1.0, sent + missed);
    state.counters["commands/s"] = sent / 3.0;
  }
}

}  // namespace

void register_steps() {
  const auto add = [](const StepCase& which) {
    const std::string name = "step/" + which.model + "/" + which.profile_name + "/M=" + std::to_string(which.samples) +
                             "/K=" + std::to_string(which.steps) + "/threads=" + std::to_string(which.threads) + "/" +
                             std::string(which.backend->name()) + (which.leave_out ? "" : "/all_decoded");
    benchmark::RegisterBenchmark(name.c_str(), [which](benchmark::State& s) { step(s, which); })
        ->UseManualTime()
        ->Iterations(kSteps)
        ->Unit(benchmark::kMillisecond);
  };
  const kernels::Backend* const best = &kernels::best_backend();
  for (const bool leave_out : {true, false}) {
    for (const int threads : {1, 2}) {
      for (const int samples : {512, 1024, 2048, 4096, 8192, 16384})
        add({"race", "race", best, samples, 20, threads, leave_out});
      for (const int samples : {1024, 8192}) add({"paper", "paper", best, samples, 20, threads, leave_out});
      for (const int samples : {1024, 8192}) add({"paper", "race", best, samples, 20, threads, leave_out});
    }
    for (const int steps : {10, 30, 40}) add({"race", "race", best, 2048, steps, 1, leave_out});
    for (const kernels::Backend* backend : kernels::available_backends())
      if (backend != best) add({"race", "race", backend, 2048, 20, 1, leave_out});
  }
  if (const kernels::Backend* int16 = kernels::find_backend("avx3_int16"); int16 != nullptr && int16->supported())
    add({"race", "race", int16, 8192, 20, 1, true});
}

void register_vehicles() {
  for (const int count : {1, 8, 16, 32, 64}) {
    benchmark::RegisterBenchmark(("vehicles/M=1024/" + std::to_string(count)).c_str(),
                                 [count](benchmark::State& s) { vehicles(s, count); })
        ->UseManualTime()
        ->Iterations(1)
        ->Unit(benchmark::kMillisecond);
  }
}

void register_encoders() {
  for (const char* name : {"race", "paper"}) {
    for (const bool prior : {true, false}) {
      if (!prior && std::string(name) == "paper") continue;  // it takes none
      const std::string title = std::string("frame/") + name + (prior ? "/prior" : "/no_prior");
      benchmark::RegisterBenchmark(title.c_str(), [name, prior](benchmark::State& state) {
        auto encoder = perception::DepthEncoder::create(shipped(name));
        if (!encoder) return state.SkipWithError(encoder.error().c_str());
        const CameraModel camera = default_camera();
        const std::vector<float> depth_m = image_of_a_gate(camera);
        std::optional<Eigen::Vector3d> where;
        if (prior) where = Eigen::Vector3d(-0.2, -0.1, 3.0);
        for (auto _ : state) benchmark::DoNotOptimize(encoder.value()->encode(depth_m, camera, where));
      })->Unit(benchmark::kMillisecond);
    }
  }
}

}  // namespace gatefield::bench
