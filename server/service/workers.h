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
#include "server/perception/depth_encoder.h"
#include "server/service/session.h"
#include "server/service/transport.h"

namespace gatefield::service {

/// The threads that run control steps. Sessions are served by deadline, earliest first, whichever thread is free; one
/// session is never served by two threads at once. Real-time sessions are due at absolute times, one control period
/// apart (a late step does not shift the later ones; times that passed altogether are counted as missed); lockstep
/// sessions are due when something came for them.
/// A thread for which nothing is due helps with the steps in progress, a block of rollouts at a time (kernels::Crew):
/// one vehicle gets all the threads, and many get one each. What is due comes before helping. While a step is in
/// progress up to kMostHelpers threads wait for its next blocks without sleeping; between steps all sleep.
/// A mutex guards the list of who is due; it is held for microseconds and never during a control step.
/// Thread-safe: yes.   @pre the clock is the machine's steady clock.
class ControlPool {
 public:
  struct Options {
    int threads = 1;
    bool realtime = false;          ///< ask for SCHED_FIFO; what came of it is in complaint()
    kernels::Crew* crew = nullptr;  ///< that the sessions' planners share their blocks through; null: no helping
    std::vector<int> cores = {};    ///< thread i runs on core cores[i % size] only; empty: wherever the system likes
  };
  static constexpr int kMostHelpers = 7;  ///< more only wait for each other

  ControlPool(const Options& options, const Clock* clock, Transport* transport);
  ~ControlPool();  ///< stops; the step in progress is finished

  void add(std::shared_ptr<Session> session);
  /// When it returns, no step of the session runs and none will.
  void remove(const Session* session);
  /// Lockstep: something came for this session.
  void wake(const Session* session);
  void stop();
  /// Why real-time scheduling or a core was not granted; empty when all were, or none was asked for.
  std::string complaint() const;

 private:
  struct Entry {
    std::shared_ptr<Session> session;
    Stamp due = Session::kNever;
    Stamp deadline = Session::kNever;
    bool busy = false;
    bool woken = false;    ///< while busy
    bool leaving = false;  ///< being removed: not served any more
  };
  void run(int index);
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
  int helpers_ = 0;                     // threads in help()
  std::atomic<int> stepping_{0};        // steps in progress
  std::atomic<std::uint64_t> news_{0};  // changes of what is due, for threads in help(); written under the mutex
  std::vector<std::thread> threads_;
};

/// The threads that turn depth frames into latents, one encoder each. Sessions with a frame waiting are served in turn.
/// Thread-safe: yes.
class PerceptionPool {
 public:
  /// @param processed  called after each frame, from the thread that processed it
  PerceptionPool(std::vector<std::unique_ptr<perception::DepthEncoder>> encoders,
                 std::function<void(const Session&)> processed);
  ~PerceptionPool();

  void add(std::shared_ptr<Session> session);
  /// When it returns, no frame of the session is being processed and none will be.
  void remove(const Session* session);
  /// A frame came, or a state that names one.
  void wake();
  void stop();

 private:
  struct Entry {
    std::shared_ptr<Session> session;
    bool busy = false;
    bool leaving = false;  ///< being removed: not served any more
  };
  void run(perception::DepthEncoder& encoder, int index);

  std::vector<std::unique_ptr<perception::DepthEncoder>> encoders_;
  std::function<void(const Session&)> processed_;
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
