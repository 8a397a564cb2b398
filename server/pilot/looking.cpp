#include "server/pilot/looking.h"

#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "common/base/text.h"

namespace gatefield::pilot {
namespace {

using Found = StateHistory::Found;

/// Why there is no pose for a frame, as it goes on from "frame 7 "; empty: there is one.
/// @param off  StateHistory::pose_at()'s
std::string wrong_with(Found found, std::chrono::nanoseconds off) {
  const auto ms = [](std::chrono::nanoseconds span) { return brief(1e3 * seconds(span)) + " ms"; };
  const std::string by = " (by " + fixed(1e3 * seconds(off), 1) + " ms)";
  switch (found) {
    case Found::kYes:
      return "";
    case Found::kEmpty:
      return "has no pose: no state came yet";
    case Found::kTooOld:
      return "was captured before the oldest state that is kept" + by;
    case Found::kTooNew:
      return "was captured more than " + ms(StateHistory::kMaxExtrapolation) + " after the newest state" + by;
    case Found::kGap:
      return "was captured in a gap of " + fixed(1e3 * seconds(off), 1) + " ms between two states, expected at most " +
             ms(StateHistory::kMaxGap);
  }
  return "";
}

Note frame_note(std::uint64_t sequence, const std::string& what, ErrorCode code = ErrorCode::kFrame) {
  return {code, {}, "depth: frame " + std::to_string(sequence) + " " + what};
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

bool Looking::begins_before_states(Found found, std::chrono::nanoseconds off) const noexcept {
  if (shared_->good_frame_stamp.load(std::memory_order_relaxed) >= 0) return false;
  if (found == Found::kEmpty) return newest_capture_ < Stamp{0};
  return found == Found::kTooOld && off <= StateHistory::kMaxGap;
}

void Looking::look_at(const DepthSample& frame, const Targets& targets) {
  Account& account = shared_->account;
  Eigen::Isometry3d X_WB;
  std::chrono::nanoseconds off{0};
  std::uint32_t line = 0;
  const Found found = shared_->history.pose_at(frame.stamp, &X_WB, &off, &line);
  if (found != Found::kYes) {
    Account::count(account.frames_rejected);
    if (!begins_before_states(found, off)) account.note(frame_note(frame.sequence, wrong_with(found, off)));
    return;
  }
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
      account.note(
          frame_note(frame.sequence, "has no return in any pixel, expected some between min_depth_m and max_depth_m"));
      break;
    case Outcome::kSaturated:
      Account::count(account.frames_invalid);
      account.note(
          frame_note(frame.sequence, "is saturated, expected some pixels between min_depth_m and max_depth_m"));
      break;
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
    // The frame was good: what fails is the server's own.
    shared_->account.note(frame_note(
        frame->sequence, std::string("could not be looked at, since the server's sensor failed: ") + e.what(),
        ErrorCode::kUnsupported));
  }
  shared_->sensing_problems.store(sight_.problems(), std::memory_order_relaxed);
  publish(targets, frame->sequence);
  newest_capture_ = frame->stamp;
  frames_line_.store(frame->line, std::memory_order_relaxed);
  shared_->frame_processed.store(frame->sequence, std::memory_order_release);
  return true;
}

}  // namespace gatefield::pilot
