#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "common/base/error_name.h"
#include "common/protocol/messages.h"
#include "server/pilot/note.h"
#include "server/pilot/plan_guard.h"
#include "server/pilot/step_times.h"

namespace gatefield::pilot {

/// What became of one vehicle's samples and plans, in numbers and in words: for telemetry and log.
/// Thread-safe: yes. Real-time safe: counting and withhold(); the rest takes a mutex that the control step never takes.
class Account {
 public:
  using Counter = std::atomic<std::uint64_t>;
  static void count(Counter& counter, std::uint64_t by = 1) noexcept {
    counter.fetch_add(by, std::memory_order_relaxed);
  }

  Counter states_received{0}, states_rejected{0};
  Counter frames_received{0}, frames_rejected{0}, frames_invalid{0};
  Counter commands_sent{0}, commands_lost{0}, deadlines_missed{0};  ///< lost: not taken by the transport
  Counter ticks_narrow{0};  ///< in time, but the step waited for a thread through more than half of the time it had
  std::atomic<std::int64_t> encode_time_ns{0};  ///< of the newest frame
  std::array<Counter, kErrorCodes> noted{};     ///< note() by its code
  std::atomic<std::int64_t> round_trip_ns{0};   ///< newest that the client told; 0: none yet
  StepTimes steps;
  std::atomic<std::int64_t> step_cpu_ns{0};  ///< processor time of all steps, of the threads that made them
  std::atomic<std::int64_t> look_cpu_ns{0};  ///< of all looks at frames
  Counter frames_looked_at{0};

  /// Why a sample was not used. Texts are cut to what telemetry carries, without control characters.
  void note(Note note);
  /// A plan was not sent.
  void withhold(Withheld why) noexcept;

  /// The counters, and the newest reason.
  void fill(protocol::Telemetry* telemetry);
  /// The newest note; nothing when there was none.
  std::optional<Note> last_note();
  /// What went wrong since the last call, for the log: samples, plans, commands. Empty when nothing did.
  std::optional<std::string> complaints();

 private:
  std::atomic<int> withheld_{0};
  Counter commands_withheld_{0};
  std::mutex mutex_;
  std::optional<Note> last_note_;
  std::uint64_t unlogged_ = 0;
  std::uint64_t withheld_logged_ = 0;
  std::uint64_t lost_logged_ = 0;
};

}  // namespace gatefield::pilot
