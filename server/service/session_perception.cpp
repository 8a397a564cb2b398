// From a depth frame to what is remembered of the gates.

#include <cstdio>
#include <exception>
#include <string>

#include "server/service/session.h"

namespace gatefield::service {
namespace {

std::string milliseconds_text(std::chrono::nanoseconds span) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.1f ms", 1e3 * seconds(span));
  return buffer;
}

}  // namespace

bool Session::frame_due() const noexcept {
  if (!frames_.fresh()) return false;
  if (!lockstep()) return true;
  const std::uint64_t named = frame_named_.load(std::memory_order_acquire);
  return named > frame_processed_.load(std::memory_order_relaxed) &&
         frame_arrived_.load(std::memory_order_acquire) >= named;
}

bool Session::perceive(perception::DepthEncoder& encoder) noexcept {
  const DepthSample* const frame = frames_.read();
  if (!frame) return false;
  const Stamp begin = clock_->now();
  const std::uint64_t packed = target_.load(std::memory_order_acquire);
  const auto target = static_cast<std::uint32_t>(packed);
  const auto next = static_cast<std::uint32_t>(packed >> 32);
  try {
    Eigen::Isometry3d X_WB;
    std::chrono::nanoseconds off{0};
    const char* wrong = nullptr;
    switch (history_.pose_at(frame->stamp, &X_WB, &off)) {
      case StateHistory::Found::kYes:
        break;
      case StateHistory::Found::kEmpty:
        wrong = "no state came yet, so its pose is not known";
        break;
      case StateHistory::Found::kTooOld:
        wrong = "captured before the oldest state that is kept";
        break;
      case StateHistory::Found::kTooNew:
        wrong = "captured more than 30 ms after the newest state";
        break;
      case StateHistory::Found::kGap:
        wrong = "captured in a gap between states";
        break;
    }
    if (wrong) {
      Account::count(account_.frames_rejected);
      account_.note("depth: frame " + std::to_string(frame->sequence) + " was " + wrong + " (by " +
                    milliseconds_text(off) + ")");
    } else {
      switch (sight_.look(frame->pixels, frame->encoding, frame->stamp, X_WB, target, next, encoder)) {
        case Sight::Outcome::kLooked:
          good_frame_stamp_.store(frame->stamp.count(), std::memory_order_relaxed);
          break;
        case Sight::Outcome::kEmpty:
          Account::count(account_.frames_invalid);
          account_.note("depth: frame " + std::to_string(frame->sequence) +
                        " has no return in any pixel, expected some between min_depth_m and max_depth_m");
          break;
        case Sight::Outcome::kSaturated:
          Account::count(account_.frames_invalid);
          account_.note("depth: frame " + std::to_string(frame->sequence) +
                        " is saturated, expected some pixels between min_depth_m and max_depth_m");
          break;
      }
    }
    perception::MemorySnapshot& snapshot = memories_.slot();
    sight_.memory().snapshot(target, next, &snapshot);
    snapshot.frame = frame->sequence;
    snapshot.target = target;
    memories_.publish();
  } catch (const std::exception& e) {
    Account::count(account_.frames_rejected);
    account_.note("depth: frame " + std::to_string(frame->sequence) + " could not be encoded: " + e.what());
  }
  account_.encode_time_ns.store((clock_->now() - begin).count(), std::memory_order_relaxed);
  frame_processed_.store(frame->sequence, std::memory_order_release);
  return true;
}

}  // namespace gatefield::service
