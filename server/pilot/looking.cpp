#include "server/pilot/looking.h"

#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

namespace gatefield::pilot {
namespace {

using Found = StateHistory::Found;

std::string milliseconds_text(std::chrono::nanoseconds span) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.1f ms", 1e3 * seconds(span));
  return buffer;
}

/// Why there is no pose for a frame; null: there is one.
const char* wrong_with(Found found) noexcept {
  switch (found) {
    case Found::kYes:
      return nullptr;
    case Found::kEmpty:
      return "no state came yet, so its pose is not known";
    case Found::kTooOld:
      return "captured before the oldest state that is kept";
    case Found::kTooNew:
      return "captured more than 30 ms after the newest state";
    case Found::kGap:
      return "captured in a gap between states";
  }
  return nullptr;
}

Note frame_note(std::uint64_t sequence, const std::string& what) {
  return {ErrorCode::kFrame, {}, "depth: frame " + std::to_string(sequence) + " " + what};
}

}  // namespace

Looking::Looking(const protocol::SessionRequest* request, std::unique_ptr<perception::GateSensor> sensor,
                 const perception::SightOptions& options, Mailboxes* shared)
    : request_(request), shared_(shared), sight_(request->camera, request->course, std::move(sensor), options) {}

bool Looking::due() const noexcept {
  if (!shared_->frames.fresh()) return false;
  if (!lockstep()) return true;
  // Numbers of another time line can't be held against each other.
  if (shared_->frames_line.load(std::memory_order_acquire) != frames_line_.load(std::memory_order_relaxed)) return true;
  const std::uint64_t named = shared_->frame_named.load(std::memory_order_acquire);
  return named > shared_->frame_processed.load(std::memory_order_relaxed) &&
         shared_->frame_arrived.load(std::memory_order_acquire) >= named;
}

/// What is remembered of the gates stays true when the vehicle's clock does not: their stamps are moved along, so that
/// the gates are as old as they were at the last good frame.
void Looking::begin_line(Stamp capture) {
  const Stamp last{shared_->good_frame_stamp.load(std::memory_order_relaxed)};
  if (last < Stamp{0}) return;  // nothing is remembered
  const Stamp moved = capture - last;
  gates::GateRecords& gates = sight_.records();
  std::vector<gates::GateRecords::Record> records = gates.records();
  for (gates::GateRecords::Record& record : records) {
    gates::GateEstimate::State estimate = record.estimate.state();
    estimate.stamp += moved;
    record.estimate.restore(estimate);
    record.gate.stamp += moved;
  }
  gates.restore(std::move(records));
}

void Looking::look_at(const DepthSample& frame, const Targets& targets) {
  Account& account = shared_->account;
  Eigen::Isometry3d X_WB;
  std::chrono::nanoseconds off{0};
  std::uint32_t line = 0;
  if (const char* const wrong = wrong_with(shared_->history.pose_at(frame.stamp, &X_WB, &off, &line))) {
    Account::count(account.frames_rejected);
    account.note(frame_note(frame.sequence, std::string("was ") + wrong + " (by " + milliseconds_text(off) + ")"));
  } else {
    if (line != line_) begin_line(frame.stamp);
    line_ = line;
    using Outcome = perception::Sight::Outcome;
    switch (sight_.look(frame.pixels, frame.encoding, frame.stamp, X_WB, targets.target, targets.next)) {
      case Outcome::kLooked:
        shared_->good_frame_stamp.store(frame.stamp.count(), std::memory_order_relaxed);
        shared_->good_frame_line.store(line_, std::memory_order_release);
        break;
      case Outcome::kEmpty:
        Account::count(account.frames_invalid);
        account.note(frame_note(frame.sequence,
                                "has no return in any pixel, expected some between min_depth_m and max_depth_m"));
        break;
      case Outcome::kSaturated:
        Account::count(account.frames_invalid);
        account.note(
            frame_note(frame.sequence, "is saturated, expected some pixels between min_depth_m and max_depth_m"));
        break;
    }
  }
}

void Looking::publish(const Targets& targets, std::uint64_t frame) noexcept {
  gates::Snapshot& snapshot = shared_->beliefs.slot();
  sight_.records().snapshot(targets.target, targets.next, &snapshot);
  snapshot.frame = frame;
  shared_->beliefs.publish();
}

bool Looking::look() noexcept {
  const DepthSample* const frame = shared_->frames.read();
  if (!frame) return false;
  const Targets targets = shared_->targets();
  try {
    look_at(*frame, targets);
  } catch (const std::exception& e) {
    Account::count(shared_->account.frames_rejected);
    shared_->account.note(frame_note(frame->sequence, std::string("could not be looked at: ") + e.what()));
  }
  shared_->sensing_problems.store(sight_.problems(), std::memory_order_relaxed);
  publish(targets, frame->sequence);
  newest_capture_ = frame->stamp;
  frames_line_.store(frame->line, std::memory_order_relaxed);
  shared_->frame_processed.store(frame->sequence, std::memory_order_release);
  return true;
}

}  // namespace gatefield::pilot
