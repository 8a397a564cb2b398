#include "server/service/workers.h"

#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <utility>

#include "server/service/phases.h"
#include "server/service/processor_time.h"

namespace gatefield::service {
namespace {

using namespace std::chrono_literals;

/// Every wait ends, even when a wake-up should be lost.
constexpr std::chrono::nanoseconds kMaxWait = 100ms;
/// Lockstep has no deadline of its own; this one keeps those that wait for long before those that came just now.
constexpr std::chrono::nanoseconds kLockstepDeadline = 10ms;
constexpr int kControlPriority = 30;
/// Turns of a helper's loop without a block to do: some hundred microseconds. Between two loops over blocks of one step
/// pass some tens of microseconds.
constexpr int kHelpersPatience = 2000;

std::chrono::steady_clock::time_point steady(Stamp stamp) {
  return std::chrono::steady_clock::time_point(std::chrono::duration_cast<std::chrono::steady_clock::duration>(stamp));
}

/// The pilot's entry, held as if it were served, while f runs without the lock; its owner serves it again afterwards.
/// @param find  of the entry; nullptr: there is none @param held, let_go  called under the lock
template <typename Entry>
bool hold(std::mutex* mutex, std::condition_variable* idle, const std::function<Entry*()>& find,
          const std::function<void()>& f, const std::function<void(Entry*)>& held,
          const std::function<void(Entry*)>& let_go) {
  std::unique_lock lock(*mutex);
  idle->wait(lock, [&] {  // ends with the step or frame in progress
    const Entry* const entry = find();
    return entry == nullptr || !entry->busy;
  });
  Entry* const entry = find();
  if (entry == nullptr || entry->leaving) return false;
  entry->busy = true;  // nobody serves or erases it
  held(entry);
  lock.unlock();
  f();
  lock.lock();
  entry->busy = false;
  let_go(entry);
  idle->notify_all();
  return true;
}

void name_thread(const char* role, int index) {
  const std::string name = std::string(role) + std::to_string(index);
  pthread_setname_np(pthread_self(), name.c_str());
}

}  // namespace

int default_control_threads() noexcept {
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  return cores > 2 ? cores - 1 : cores;
}

// ---- control --------------------------------------------------------------------------------------------------------

ControlPool::ControlPool(const Options& options, const Clock* clock, Transport* transport)
    : options_(options), clock_(clock), transport_(transport) {
  for (int i = 0; i < std::max(1, options_.threads); ++i) threads_.emplace_back([this, i] { run(i); });
  for (std::size_t i = 0; i < threads_.size() && !options_.cores.empty(); ++i) {
    const int core = options_.cores[i % options_.cores.size()];
    cpu_set_t set;
    CPU_ZERO(&set);
    if (core >= 0 && core < CPU_SETSIZE) CPU_SET(static_cast<std::size_t>(core), &set);
    if (const int error = pthread_setaffinity_np(threads_[i].native_handle(), sizeof set, &set); error != 0)
      complaint_ = "control thread " + std::to_string(i) + " was not bound to core " + std::to_string(core) + " (" +
                   std::strerror(error) + ")";
  }
  if (!options_.realtime) return;
  sched_param parameters{};
  parameters.sched_priority = kControlPriority;
  for (std::thread& thread : threads_) {
    const int error = pthread_setschedparam(thread.native_handle(), SCHED_FIFO, &parameters);
    if (error != 0)
      complaint_ = "SCHED_FIFO priority " + std::to_string(kControlPriority) +
                   " was not granted to the control threads (" + std::strerror(error) +
                   "), expected CAP_SYS_NICE or an rtprio limit of at least that";
  }
}

ControlPool::~ControlPool() { stop(); }

void ControlPool::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    ++news_;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_)
    if (thread.joinable()) thread.join();
}

std::string ControlPool::complaint() const { return complaint_; }

ControlPool::Spent ControlPool::spent() const {
  return {processor_time_of(threads_), std::chrono::nanoseconds(helping_ns_.load(std::memory_order_relaxed))};
}

Stamp ControlPool::step_since() const {
  const std::lock_guard lock(mutex_);
  Stamp since = pilot::Stepping::kNever;
  for (const auto& entry : entries_)
    if (entry->busy) since = std::min(since, entry->busy_since);
  return since;
}

void ControlPool::add(std::shared_ptr<pilot::Pilot> pilot) {
  auto entry = std::make_unique<Entry>();
  entry->pilot = std::move(pilot);
  {
    const std::lock_guard lock(mutex_);
    if (!entry->pilot->lockstep()) {
      entry->due = clock_->now();
      entry->deadline = entry->due + entry->pilot->control_period();
      entry->first_period = first_period(entry->due, entry->pilot->control_period());
    }
    entries_.push_back(std::move(entry));
    ++news_;
  }
  changed_.notify_one();
}

/// When its second step is due, after its first: as far from the others of its period as may be.
std::chrono::nanoseconds ControlPool::first_period(Stamp due, std::chrono::nanoseconds period) const {
  std::vector<std::chrono::nanoseconds> taken;
  for (const auto& entry : entries_) {
    if (entry->pilot->lockstep() || entry->pilot->control_period() != period) continue;
    const auto phase = (entry->due + entry->first_period - due) % period;
    taken.push_back(phase < 0ns ? phase + period : phase);
  }
  return free_phase(std::move(taken), period);
}

ControlPool::Entry* ControlPool::find(const pilot::Pilot* pilot) {
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const auto& entry) { return entry->pilot.get() == pilot; });
  return found == entries_.end() ? nullptr : found->get();
}

void ControlPool::remove(const pilot::Pilot* pilot) {
  std::unique_lock lock(mutex_);
  Entry* const entry = find(pilot);
  if (entry == nullptr) return;
  entry->leaving = true;
  idle_.wait(lock, [&] { return !entry->busy; });  // ends with the step in progress
  std::erase_if(entries_, [&](const auto& one) { return one.get() == entry; });
}

bool ControlPool::between_steps(const pilot::Pilot* pilot, const std::function<void()>& f) {
  const auto held = [this](Entry* entry) {
    entry->busy_since = clock_->now();
    entry->woken = false;
  };
  const auto let_go = [this](Entry* entry) {
    if (entry->woken) {  // lockstep: something came meanwhile
      entry->due = clock_->now();
      entry->deadline = entry->due + kLockstepDeadline;
    }
    changed_.notify_one();  // it may be due by now
  };
  return hold<Entry>(
      &mutex_, &idle_, [&] { return find(pilot); }, f, held, let_go);
}

void ControlPool::wake(const pilot::Pilot* pilot) {
  {
    const std::lock_guard lock(mutex_);
    for (const auto& entry : entries_) {
      if (entry->pilot.get() != pilot) continue;
      if (entry->busy) {
        entry->woken = true;
      } else {
        entry->due = clock_->now();
        entry->deadline = entry->due + kLockstepDeadline;
      }
    }
    ++news_;
  }
  changed_.notify_one();
}

/// Does blocks of steps in progress until no step is, something is due or has changed.
/// @return false when there were no blocks for long: the scheduler has put the step's own thread aside, and waiting
///         would keep the processor from it
bool ControlPool::help(std::unique_lock<std::mutex>& lock, Stamp until) {
  const std::uint64_t news = news_.load(std::memory_order_relaxed);
  ++helpers_;
  lock.unlock();
  int idle = 0;
  // Waiting for blocks is no work, and asking for the processor time at each turn would be.
  std::chrono::nanoseconds working{0};
  const std::chrono::nanoseconds cpu = processor_time_of_thread();
  for (Stamp now = clock_->now(); idle < kHelpersPatience && stepping_.load(std::memory_order_relaxed) > 0 &&
                                  news_.load(std::memory_order_relaxed) == news && now < until;) {
    const Stamp begin = now;
    const bool helped = options_.crew->help();
    now = clock_->now();
    if (helped) {
      idle = 0;
      working += now - begin;
    } else {
      ++idle;
      kernels::relax();
    }
  }
  // The scheduler may have put this thread aside in the middle of a block.
  helping_ns_.fetch_add(std::min(working, processor_time_of_thread() - cpu).count(), std::memory_order_relaxed);
  lock.lock();
  --helpers_;
  return idle < kHelpersPatience;
}

/// Whose step is next, if anybody's is due. @param next_due  brought forward to when the next one will be
ControlPool::Entry* ControlPool::choose(Stamp now, Stamp* next_due) {
  Entry* chosen = nullptr;
  Entry* lockstep = nullptr;
  bool deadlines = false;  // some pilot has any
  for (const auto& entry : entries_) {
    deadlines = deadlines || !entry->pilot->lockstep();
    if (entry->busy || entry->leaving) continue;
    if (entry->due > now) {
      *next_due = std::min(*next_due, entry->due);
      continue;
    }
    Entry*& first = entry->pilot->lockstep() ? lockstep : chosen;
    if (!first || entry->deadline < first->deadline) first = entry.get();
  }
  if (chosen) return chosen;
  // The thread that steps a lockstep pilot comes for the next one when it is done.
  const bool all_busy = deadlines && threads_.size() > 1 && lockstep_steps_ + 1 >= static_cast<int>(threads_.size());
  return all_busy ? nullptr : lockstep;
}

void ControlPool::run(int index) {
  name_thread("control-", index);
  planner::Planner::prepare_thread();
  prctl(PR_SET_TIMERSLACK, 1000UL);  // ns; the default of 50 us is a fair part of a control period at 500 Hz
  bool tired = false;                // of helping
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    const Stamp now = clock_->now();
    Stamp next_due = now + kMaxWait;
    Entry* const chosen = choose(now, &next_due);
    if (!chosen) {
      if (options_.crew != nullptr && !tired && helpers_ < kMaxHelpers &&
          stepping_.load(std::memory_order_relaxed) > 0) {
        tired = !help(lock, next_due);  // and then looks again, for what became due meanwhile
      } else {
        tired = false;
        changed_.wait_until(lock, steady(next_due));
      }
      continue;
    }

    chosen->busy = true;
    chosen->busy_since = now;
    chosen->woken = false;
    stepping_.fetch_add(1, std::memory_order_relaxed);
    const Stamp due = chosen->due;
    pilot::Pilot& pilot = *chosen->pilot;
    if (pilot.lockstep()) ++lockstep_steps_;
    // Another thread has to keep an eye on the rest, whose due times may have changed since it began to wait; and those
    // that sleep could help.
    const int rouse = options_.crew != nullptr ? std::min<int>(kMaxHelpers, static_cast<int>(threads_.size()) - 1)
                                               : (entries_.size() > 1 ? 1 : 0);
    lock.unlock();
    for (int i = 0; i < rouse; ++i) changed_.notify_one();
    pilot::Stepping& stepping = pilot.stepping();
    const std::chrono::nanoseconds cpu = processor_time_of_thread();
    const Stamp begin = clock_->now();
    const pilot::Stepping::Answer answer = stepping.step(begin);
    stepping_.fetch_sub(1, std::memory_order_relaxed);
    if (answer.command) {
      stepping.solved(clock_->now() - begin);
      const bool ok = transport_->send(*answer.command);
      stepping.sent(clock_->now(), ok);
    }
    stepping.spent(processor_time_of_thread() - cpu);
    const Stamp done = clock_->now();
    lock.lock();

    chosen->busy = false;
    if (pilot.lockstep()) {
      --lockstep_steps_;
      chosen->due = chosen->woken ? done : answer.wake_at;
      chosen->deadline =
          chosen->due == pilot::Stepping::kNever ? pilot::Stepping::kNever : chosen->due + kLockstepDeadline;
    } else {
      const auto period = pilot.control_period();
      const auto missed = std::max<std::int64_t>(0, (done - due) / period);
      if (missed > 0) {
        stepping.missed_deadlines(static_cast<std::uint64_t>(missed));
      } else if (2 * (begin - due) > period - (done - begin)) {
        stepping.narrow_tick();
      }
      const auto first_period = std::exchange(chosen->first_period, 0ns);
      chosen->due = due + (first_period > 0ns ? missed * period + first_period : (missed + 1) * period);
      chosen->deadline = chosen->due + period;
    }
    idle_.notify_all();
  }
}

// ---- perception -----------------------------------------------------------------------------------------------------

PerceptionPool::PerceptionPool(int threads, const Clock* clock, std::function<void(const pilot::Pilot&)> processed)
    : clock_(clock), processed_(std::move(processed)) {
  for (int i = 0; i < std::max(1, threads); ++i) threads_.emplace_back([this, i] { run(i); });
}

PerceptionPool::~PerceptionPool() { stop(); }

void PerceptionPool::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_)
    if (thread.joinable()) thread.join();
}

std::chrono::nanoseconds PerceptionPool::spent() const { return processor_time_of(threads_); }

void PerceptionPool::add(std::shared_ptr<pilot::Pilot> pilot) {
  auto entry = std::make_unique<Entry>();
  entry->pilot = std::move(pilot);
  const std::lock_guard lock(mutex_);
  entries_.push_back(std::move(entry));
}

PerceptionPool::Entry* PerceptionPool::find(const pilot::Pilot* pilot) {
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const auto& entry) { return entry->pilot.get() == pilot; });
  return found == entries_.end() ? nullptr : found->get();
}

void PerceptionPool::remove(const pilot::Pilot* pilot) {
  std::unique_lock lock(mutex_);
  Entry* const entry = find(pilot);
  if (entry == nullptr) return;
  entry->leaving = true;
  idle_.wait(lock, [&] { return !entry->busy; });  // ends with the frame in progress
  std::erase_if(entries_, [&](const auto& one) { return one.get() == entry; });
}

bool PerceptionPool::between_frames(const pilot::Pilot* pilot, const std::function<void()>& f) {
  return hold<Entry>(
      &mutex_, &idle_, [&] { return find(pilot); }, f, [](Entry*) {}, [this](Entry*) { changed_.notify_one(); });
}

void PerceptionPool::wake() {
  // The lock makes sure that a thread which just found nothing to do is waiting by now and hears this.
  { const std::lock_guard lock(mutex_); }
  changed_.notify_one();
}

void PerceptionPool::run(int index) {
  name_thread("perception-", index);
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    Entry* chosen = nullptr;
    for (std::size_t i = 0; i < entries_.size() && !chosen; ++i) {
      const std::size_t at = (turn_ + i) % entries_.size();
      Entry& entry = *entries_[at];
      if (entry.busy || entry.leaving || !entry.pilot->looking().due()) continue;
      chosen = &entry;
      turn_ = at + 1;
    }
    if (!chosen) {
      changed_.wait_for(lock, kMaxWait);
      continue;
    }
    chosen->busy = true;
    pilot::Pilot& pilot = *chosen->pilot;
    lock.unlock();
    const std::chrono::nanoseconds cpu = processor_time_of_thread();
    const Stamp begin = clock_->now();
    if (pilot.looking().look()) {
      pilot.looking().looked(clock_->now() - begin);
      pilot.looking().spent(processor_time_of_thread() - cpu);
      processed_(pilot);
    }
    lock.lock();
    chosen->busy = false;
    idle_.notify_all();
  }
}

}  // namespace gatefield::service
