#include "server/pilot/intake.h"

#include <algorithm>
#include <string>

#include "common/protocol/validate.h"

namespace gatefield::pilot {
namespace {

Status check_session(std::uint64_t session, std::uint64_t expected) {
  if (session == expected) return {};
  return Error::invalid("session", std::to_string(session), std::to_string(expected), ErrorCode::kWrongSession);
}

/// @param what  "states" or "frames"
Status check_rising(std::uint64_t sequence, Stamp stamp, const Intake::Newest& newest, const char* what) {
  if (sequence <= newest.sequence)
    return Error::invalid("sequence", std::to_string(sequence),
                          "more than " + std::to_string(newest.sequence) + " (" + what + " must rise)",
                          ErrorCode::kNotRising);
  if (newest.sequence != 0 && stamp <= newest.stamp)
    return Error::invalid("stamp", std::to_string(stamp.count()) + " ns",
                          "later than " + std::to_string(newest.stamp.count()) + " ns (time went backwards)",
                          ErrorCode::kNotRising);
  return {};
}

}  // namespace

Intake::Intake(const protocol::SessionRequest* request, std::uint64_t session, Mailboxes* shared)
    : request_(request), session_(session), shared_(shared) {}

Status Intake::check(const protocol::VehicleState& state) const {
  if (auto s = protocol::validate(state); !s) return s;
  if (auto s = check_session(state.session, session_); !s) return s;
  return check_rising(state.sequence, state.stamp, newest_state_, "states");
}

Intake::Outcome Intake::take_state(const protocol::VehicleState& state, Stamp now) {
  const std::lock_guard lock(states_mutex_);
  Account::count(shared_->account.states_received);
  if (lockstep() && state.session == session_ && state.sequence == newest_state_.sequence && state.sequence != 0 &&
      state.stamp == newest_state_.stamp) {
    shared_->last_heard.store(now.count(), std::memory_order_relaxed);
    shared_->repeat_wanted.store(true, std::memory_order_release);
    return Outcome::kRepeated;
  }
  if (const Status status = check(state); !status) {
    Account::count(shared_->account.states_rejected);
    if (state.session == session_) shared_->newest_state_rejected.store(true, std::memory_order_relaxed);
    shared_->account.note(note_of("state", status.failure()));
    return Outcome::kRejected;
  }
  if (newest_state_.sequence == 0) {
    // A vehicle in mid-race that lost its server says where it was; perception has to know before the first plan does.
    gates::CourseProgress from(request_->course);
    from.resume(state.heard_waypoint, state.heard_lap);
    shared_->aim(from);
  }
  newest_state_ = {state.sequence, state.stamp};
  shared_->last_heard.store(now.count(), std::memory_order_relaxed);
  shared_->newest_state_rejected.store(false, std::memory_order_relaxed);
  shared_->history.add(state.stamp, state.state);

  StateSample& sample = shared_->states.slot();
  sample.sequence = state.sequence;
  sample.stamp = state.stamp;
  sample.received = now;
  sample.state = state.state;
  sample.state.q_WB.normalize();
  sample.thrust_known = state.thrust_known;
  sample.round_trip = state.round_trip;
  sample.depth_sequence = state.depth_sequence;
  sample.heard_waypoint = state.heard_waypoint;
  sample.heard_lap = state.heard_lap;
  shared_->states.publish();
  shared_->frame_named.store(std::max(state.depth_sequence, shared_->frame_named.load(std::memory_order_relaxed)),
                             std::memory_order_release);
  return Outcome::kTaken;
}

Status Intake::check(const protocol::DepthFrame& frame) const {
  if (auto s = check_session(frame.session, session_); !s) return s;
  if (auto s = protocol::validate(frame, request_->camera); !s) return s;
  return check_rising(frame.sequence, frame.stamp, newest_frame_, "frames");
}

Intake::Outcome Intake::take_depth(protocol::DepthFrame& frame) {
  const std::lock_guard lock(frames_mutex_);
  Account::count(shared_->account.frames_received);
  if (frame.session == session_ && frame.sequence == newest_frame_.sequence && frame.sequence != 0 &&
      frame.stamp == newest_frame_.stamp)
    return Outcome::kRepeated;
  if (const Status status = check(frame); !status) {
    Account::count(shared_->account.frames_rejected);
    if (frame.session == session_ && frame.sequence > newest_frame_.sequence)
      shared_->frame_refused.store(frame.sequence, std::memory_order_release);
    shared_->account.note(note_of("depth", status.failure()));
    return Outcome::kRejected;
  }
  newest_frame_ = {frame.sequence, frame.stamp};
  DepthSample& sample = shared_->frames.slot();
  sample.sequence = frame.sequence;
  sample.stamp = frame.stamp;
  sample.encoding = frame.encoding;
  sample.pixels.swap(frame.pixels);
  shared_->frames.publish();
  shared_->frame_arrived.store(frame.sequence, std::memory_order_release);
  return Outcome::kTaken;
}

void Intake::note_rejected_state(const Error& why) {
  Account::count(shared_->account.states_received);
  Account::count(shared_->account.states_rejected);
  shared_->newest_state_rejected.store(true, std::memory_order_relaxed);
  shared_->account.note(note_of("state", why));
}

void Intake::note_rejected_frame(const Error& why) {
  Account::count(shared_->account.frames_received);
  Account::count(shared_->account.frames_rejected);
  shared_->account.note(note_of("depth", why));
}

}  // namespace gatefield::pilot
