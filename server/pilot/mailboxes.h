#pragma once

#include <atomic>
#include <cstdint>

#include "common/base/clock.h"
#include "common/base/mailbox.h"
#include "common/protocol/messages.h"
#include "server/gates/course_progress.h"
#include "server/gates/gate_records.h"
#include "server/pilot/account.h"
#include "server/pilot/samples.h"
#include "server/pilot/state_history.h"

namespace gatefield::pilot {

/// The waypoints that matter now.
struct Targets {
  std::uint32_t target = 0;
  std::uint32_t next = 0;  ///< the target itself when there is none
};

/// All that a pilot's three sides share. Data goes one way, from mailbox to mailbox: states from Intake to Stepping,
/// frames from Intake to Looking, beliefs from Looking to Stepping; back go the targets alone. Nobody waits for
/// another.
struct Mailboxes {
  Mailbox<StateSample> states;                ///< Intake -> Stepping
  Mailbox<DepthSample> frames;                ///< Intake -> Looking
  Mailbox<gates::Snapshot> beliefs;           ///< Looking -> Stepping
  Mailbox<protocol::PlannerHealth> healths;   ///< Stepping -> whoever tells telemetry
  Mailbox<protocol::IdentifiedDrive> drives;  ///< Stepping -> whoever tells telemetry
  StateHistory history;                       ///< Intake writes, Looking reads

  std::atomic<bool> newest_state_rejected{false};
  std::atomic<bool> newest_frame_rejected{false};
  std::atomic<bool> stamps_jumped{false};  ///< since the last step: a sample lay off the line of the others
  std::atomic<bool> motion_jumped{false};  ///< since the last step: a state that the speeds don't explain was left out
  std::atomic<protocol::Problems> sensing_problems{0};  ///< what Looking finds wrong, as it stands; Stepping tells it
  std::atomic<bool> repeat_wanted{false};               ///< lockstep: a state came again
  std::atomic<std::uint64_t> frame_named{0};            ///< newest depth_sequence that a state named
  std::atomic<std::uint64_t> frame_arrived{0};          ///< newest in the mailbox
  std::atomic<std::uint32_t> frames_line{0};            ///< its time line's number
  std::atomic<std::uint64_t> frame_refused{0};          ///< newest refused on arrival: nobody needs to wait for it
  std::atomic<std::uint64_t> frame_processed{0};        ///< newest whose result is in `beliefs`
  std::atomic<std::int64_t> good_frame_stamp{-1};       ///< capture of the newest frame with something in it
  std::atomic<std::uint32_t> good_frame_line{0};        ///< the states' time line that it is of (written after it)
  std::atomic<std::int64_t> last_heard{0};              ///< server's clock: the newest good state

  Account account;  ///< all sides

  Targets targets() const noexcept {
    const std::uint64_t packed = targets_.load(std::memory_order_acquire);
    return {static_cast<std::uint32_t>(packed), static_cast<std::uint32_t>(packed >> 32)};
  }
  /// Stepping; and Intake before the first step.
  void aim(const Targets& targets) noexcept {
    targets_.store(std::uint64_t{targets.next} << 32 | targets.target, std::memory_order_release);
  }
  void aim(const gates::CourseProgress& progress) noexcept { aim({progress.target(), progress.next()}); }

 private:
  std::atomic<std::uint64_t> targets_{0};
};

}  // namespace gatefield::pilot
