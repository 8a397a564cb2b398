#include "client/race/runner.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <thread>

#include "common/base/clock.h"

namespace gatefield::race {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kSupervise = 50ms;

/// A trial that no attempt could fly.
Flight lost_flight(const Trial& trial, const std::string& why) {
  Flight flight;
  flight.end = Flight::End::kLost;
  flight.why = why;
  simulator::Report nothing;
  nothing.outcome = simulator::Outcome::kLinkLost;
  flight.result = to_result(trial, nothing);
  flight.result.sentence = "lost the server: " + why;
  flight.result.gates_total =
      trial.cell->scenario.track.course.laps * static_cast<int>(trial.cell->scenario.track.course.waypoints.size());
  flight.result.end_p_W = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  flight.result.clearance_m = std::numeric_limits<double>::quiet_NaN();
  return flight;
}

class Run {
 public:
  Run(const std::vector<Trial>& trials, const RunnerOptions& options, const FlyerFactory& factory,
      const FlightSink& sink, const std::atomic<bool>& stop)
      : trials_(trials), options_(options), factory_(factory), sink_(sink), stop_(stop) {}

  RunSummary go(const std::function<void(const RunProgress&)>& on_progress) {
    const auto begin = Clock::now();
    const auto count = std::min<std::size_t>(static_cast<std::size_t>(std::max(options_.workers, 1)),
                                             std::max<std::size_t>(trials_.size(), 1));
    workers_ = std::vector<Worker>(count);
    running_ = count;
    for (std::size_t i = 0; i < count; ++i) workers_[i].thread = std::thread([this, i] { work(static_cast<int>(i)); });
    while (running_ > 0) {
      std::this_thread::sleep_for(kSupervise);
      for (Worker& worker : workers_) supervise(&worker);
      if (on_progress) on_progress(progress(begin));
    }
    for (Worker& worker : workers_) worker.thread.join();
    if (on_progress) on_progress(progress(begin));
    const std::lock_guard lock(mutex_);
    summary_.interrupted = stop_ && summary_.error.empty() && summary_.flown < trials_.size();
    return summary_;
  }

 private:
  struct Worker {
    std::thread thread;
    std::atomic<bool> cancel{false};
    std::mutex mutex;  // the two that follow
    Flyer* flyer = nullptr;
    Clock::time_point attempt_begin{};
    bool flying = false;
  };

  bool ending() {
    if (stop_) return true;
    const std::lock_guard lock(mutex_);
    return !summary_.error.empty();
  }

  void supervise(Worker* worker) {
    const bool end = ending();
    const std::lock_guard lock(worker->mutex);
    if (worker->flyer == nullptr) return;
    const bool late = worker->flying && Clock::now() - worker->attempt_begin > options_.trial_limit;
    if (end || late || (worker->flying && worker->flyer->lost())) worker->cancel = true;
  }

  RunProgress progress(Clock::time_point begin) {
    const std::lock_guard lock(mutex_);
    RunProgress out{summary_.flown,
                    trials_.size(),
                    summary_.won,
                    summary_.lost_attempts,
                    std::chrono::duration<double>(Clock::now() - begin).count(),
                    std::numeric_limits<double>::quiet_NaN()};
    if (out.done > 0)
      out.left_s = out.elapsed_s / static_cast<double>(out.done) * static_cast<double>(out.total - out.done);
    return out;
  }

  void fail(const std::string& why, bool no_server) {
    const std::lock_guard lock(mutex_);
    if (!summary_.error.empty()) return;
    summary_.error = why;
    summary_.no_server = no_server;
  }

  void work(int index) {
    Worker& worker = workers_[static_cast<std::size_t>(index)];
    {
      const auto flyer = factory_(index);
      {
        const std::lock_guard lock(worker.mutex);
        worker.flyer = flyer.get();
      }
      while (!ending()) {
        const std::size_t next = next_++;
        if (next >= trials_.size()) break;
        if (!fly(&worker, flyer.get(), trials_[next])) break;
      }
      const std::lock_guard lock(worker.mutex);
      worker.flyer = nullptr;
    }
    --running_;
  }

  /// False: this worker is done.
  bool fly(Worker* worker, Flyer* flyer, const Trial& trial) {
    std::string why;
    for (int attempt = 1; attempt <= options_.attempts; ++attempt) {
      if (ending()) return false;
      {
        const std::lock_guard lock(worker->mutex);
        worker->cancel = false;
        worker->flying = true;
        worker->attempt_begin = Clock::now();
      }
      auto flight = flyer->fly(trial, worker->cancel);
      {
        const std::lock_guard lock(worker->mutex);
        worker->flying = false;
      }
      if (!flight) {
        fail(flight.error(), false);
        return false;
      }
      if (flight->end == Flight::End::kFlown) {
        flight.value().result.attempts = attempt;
        return take(trial, *flight);
      }
      if (ending()) return false;
      why = flight->end == Flight::End::kCancelled
                ? "took longer than " + std::to_string(options_.trial_limit.count()) + " s"
                : flight->why;
      const std::lock_guard lock(mutex_);
      ++summary_.lost_attempts;
    }
    Flight lost = lost_flight(trial, why);
    lost.result.attempts = options_.attempts;
    return take(trial, lost);
  }

  bool take(const Trial& trial, const Flight& flight) {
    if (auto status = sink_(trial, flight); !status) {
      fail(status.error(), false);
      return false;
    }
    const bool lost = flight.end != Flight::End::kFlown;
    if (!lost) lost_in_a_row_ = 0;
    if (lost && ++lost_in_a_row_ >= options_.max_lost_in_a_row)
      fail(std::to_string(options_.max_lost_in_a_row) +
               " trials in a row found no server that answers; the last one, " + trial.name() + ": " + flight.why,
           true);
    const std::lock_guard lock(mutex_);
    ++summary_.flown;
    if (flight.result.won()) ++summary_.won;
    return true;
  }

  const std::vector<Trial>& trials_;
  const RunnerOptions& options_;
  const FlyerFactory& factory_;
  const FlightSink& sink_;
  const std::atomic<bool>& stop_;
  std::vector<Worker> workers_;
  std::atomic<std::size_t> next_{0};
  std::atomic<std::size_t> running_{0};
  std::atomic<int> lost_in_a_row_{0};
  std::mutex mutex_;  // the summary
  RunSummary summary_;
};

}  // namespace

RunSummary run_trials(const std::vector<Trial>& trials, const RunnerOptions& options, const FlyerFactory& factory,
                      const FlightSink& sink, const std::atomic<bool>& stop,
                      const std::function<void(const RunProgress&)>& on_progress) {
  return Run(trials, options, factory, sink, stop).go(on_progress);
}

}  // namespace gatefield::race
