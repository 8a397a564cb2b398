#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "server/kernels/crew.h"
#include "server/pilot/pilot.h"
#include "server/service/transport.h"

namespace gatefield::service {

/// The threads that run control steps. Pilots are served by deadline, earliest first, whichever thread is free; one
/// pilot is never served by two threads at once. Real-time pilots are due at absolute times, one control period apart
/// (a late step does not shift the later ones; times that passed altogether are counted as missed); lockstep pilots are
/// due when something came for them, after every real-time pilot that is due: they have no deadline to miss, and while
/// a real-time pilot is there one thread of several never begins a lockstep step, which could hold that one up.
/// Pilots of one control period are due as far from each other as may be, from their second step on, so that they don't
/// wait for each other; the first is due when they come.
/// What a step takes, in time and processor time, and when its command goes out is measured here, and told to the
/// pilot.
/// A thread for which nothing is due helps with the steps in progress, a block of rollouts at a time (kernels::Crew):
/// one vehicle gets all the threads, and many get one each. What is due comes before helping. While a step is in
/// progress up to kMaxHelpers threads wait for its next blocks without sleeping; between steps all sleep.
/// A mutex guards the list of who is due; it is held for microseconds and never during a control step.
/// Thread-safe: yes.   @pre the clock is the machine's steady clock.
class ControlPool {
 public:
  struct Options {
    int threads = 1;
    bool realtime = false;          ///< ask for SCHED_FIFO; what came of it is in complaint()
    kernels::Crew* crew = nullptr;  ///< that the pilots' planners share their blocks through; null: no helping
    std::vector<int> cores = {};    ///< thread i runs on core cores[i % size] only; empty: wherever the system likes
  };
  static constexpr int kMaxHelpers = 7;  ///< more only wait for each other

  ControlPool(const Options& options, const Clock* clock, Transport* transport);
  ~ControlPool();  ///< stops; the step in progress is finished

  void add(std::shared_ptr<pilot::Pilot> pilot);
  /// When it returns, no step of the pilot runs and none will.
  void remove(const pilot::Pilot* pilot);
  /// Calls f between two steps of the pilot: none runs meanwhile, and its next one waits for f.
  /// @return false, and f was not called: the pilot is not served here (any more)
  bool between_steps(const pilot::Pilot* pilot, const std::function<void()>& f);
  /// Lockstep: something came for this pilot.
  void wake(const pilot::Pilot* pilot);
  void stop();
  /// Why real-time scheduling or a core was not granted; empty when all were, or none was asked for.
  std::string complaint() const;
  /// Processor time so far: of all threads, whatever they did, and of helping with others' steps alone.
  struct Spent {
    std::chrono::nanoseconds all{0}, helping{0};
  };
  Spent spent() const;
  /// Since when the step runs that has been in progress for the longest; kNever when none is.
  Stamp step_since() const;

 private:
  struct Entry {
    std::shared_ptr<pilot::Pilot> pilot;
    Stamp due = pilot::Stepping::kNever;
    Stamp deadline = pilot::Stepping::kNever;
    std::chrono::nanoseconds first_period{0};  ///< from the first due time to the second; 0: that is over
    bool busy = false;
    Stamp busy_since{0};
    bool woken = false;    ///< while busy
    bool leaving = false;  ///< being removed: not served any more
  };
  Entry* find(const pilot::Pilot* pilot);
  std::chrono::nanoseconds first_period(Stamp due, std::chrono::nanoseconds period) const;
  void run(int index);
  Entry* choose(Stamp now, Stamp* next_due);
  bool help(std::unique_lock<std::mutex>& lock, Stamp until);

  const Options options_;
  const Clock* const clock_;
  Transport* const transport_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::condition_variable idle_;  // some entry is not busy any more
  std::vector<std::unique_ptr<Entry>> entries_;
  std::string complaint_;
  bool stopping_ = false;
  int helpers_ = 0;               // threads in help()
  int lockstep_steps_ = 0;        // steps of lockstep pilots in progress
  std::atomic<int> stepping_{0};  // steps in progress
  std::atomic<std::int64_t> helping_ns_{0};
  std::atomic<std::uint64_t> news_{0};  // changes of what is due, for threads in help(); written under the mutex
  std::vector<std::thread> threads_;
};

/// The threads that look at depth frames. Pilots with a frame waiting are served in turn.
/// Thread-safe: yes.
class PerceptionPool {
 public:
  /// @param processed  called after each frame, from the thread that processed it
  PerceptionPool(int threads, const Clock* clock, std::function<void(const pilot::Pilot&)> processed);
  ~PerceptionPool();

  void add(std::shared_ptr<pilot::Pilot> pilot);
  /// When it returns, no frame of the pilot is being looked at and none will be.
  void remove(const pilot::Pilot* pilot);
  /// Calls f between two frames of the pilot, as ControlPool::between_steps() does.
  bool between_frames(const pilot::Pilot* pilot, const std::function<void()>& f);
  /// A frame came, or a state that names one.
  void wake();
  void stop();
  /// Processor time of all threads so far.
  std::chrono::nanoseconds spent() const;

 private:
  struct Entry {
    std::shared_ptr<pilot::Pilot> pilot;
    bool busy = false;
    bool leaving = false;  ///< being removed: not served any more
  };
  Entry* find(const pilot::Pilot* pilot);
  void run(int index);

  const Clock* const clock_;
  std::function<void(const pilot::Pilot&)> processed_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::condition_variable idle_;
  std::vector<std::unique_ptr<Entry>> entries_;
  std::size_t turn_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

/// Control threads when nothing is said: one per core but one, which perception needs; with two cores or one, as many.
int default_control_threads() noexcept;

}  // namespace gatefield::service
