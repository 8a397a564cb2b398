// What comes from the vehicle: states and depth frames, checked and put where the other sides find them.

#include <algorithm>
#include <string>

#include "common/protocol/validate.h"
#include "server/service/session.h"

namespace gatefield::service {

Status Session::check(const protocol::VehicleState& state) const {
  if (auto s = protocol::validate(state); !s) return s;
  if (state.session != id_)
    return Error{"session is " + std::to_string(state.session) + ", expected " + std::to_string(id_)};
  if (state.sequence <= last_state_sequence_)
    return Error{"sequence is " + std::to_string(state.sequence) + ", expected more than " +
                 std::to_string(last_state_sequence_) + " (states must rise)"};
  if (last_state_sequence_ != 0 && state.stamp <= last_state_stamp_)
    return Error{"stamp is " + std::to_string(state.stamp.count()) + " ns, expected later than " +
                 std::to_string(last_state_stamp_.count()) + " ns (time went backwards)"};
  return {};
}

Session::Intake Session::take_state(const protocol::VehicleState& state) {
  const Stamp now = clock_->now();
  const std::lock_guard lock(states_mutex_);
  Account::count(account_.states_received);
  if (lockstep() && state.session == id_ && state.sequence == last_state_sequence_ && state.sequence != 0 &&
      state.stamp == last_state_stamp_) {
    last_heard_.store(now.count(), std::memory_order_relaxed);
    repeat_wanted_.store(true, std::memory_order_release);
    return Intake::kRepeated;
  }
  if (const Status status = check(state); !status) {
    Account::count(account_.states_rejected);
    if (state.session == id_) newest_state_rejected_.store(true, std::memory_order_relaxed);
    account_.note("state: " + status.error());
    return Intake::kRejected;
  }
  if (last_state_sequence_ == 0) {
    // A vehicle in mid-race that lost its server says where it was; perception has to know before the first plan does.
    planner::CourseProgress from(request_.course);
    from.resume(state.heard_waypoint, state.heard_lap);
    publish_target(from);
  }
  last_state_sequence_ = state.sequence;
  last_state_stamp_ = state.stamp;
  last_heard_.store(now.count(), std::memory_order_relaxed);
  newest_state_rejected_.store(false, std::memory_order_relaxed);
  history_.add(state.stamp, state.state);

  StateSample& sample = states_.slot();
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
  states_.publish();
  frame_named_.store(std::max(state.depth_sequence, frame_named_.load(std::memory_order_relaxed)),
                     std::memory_order_release);
  return Intake::kTaken;
}

Status Session::check(const protocol::DepthFrame& frame) const {
  if (frame.session != id_)
    return Error{"session is " + std::to_string(frame.session) + ", expected " + std::to_string(id_)};
  if (auto s = protocol::validate(frame, request_.camera); !s) return s;
  if (frame.sequence <= last_frame_sequence_)
    return Error{"sequence is " + std::to_string(frame.sequence) + ", expected more than " +
                 std::to_string(last_frame_sequence_) + " (frames must rise)"};
  if (last_frame_sequence_ != 0 && frame.stamp <= last_frame_stamp_)
    return Error{"stamp is " + std::to_string(frame.stamp.count()) + " ns, expected later than " +
                 std::to_string(last_frame_stamp_.count()) + " ns (time went backwards)"};
  return {};
}

Session::Intake Session::take_depth(protocol::DepthFrame& frame) {
  const std::lock_guard lock(frames_mutex_);
  Account::count(account_.frames_received);
  if (frame.session == id_ && frame.sequence == last_frame_sequence_ && frame.sequence != 0 &&
      frame.stamp == last_frame_stamp_)
    return Intake::kRepeated;
  if (const Status status = check(frame); !status) {
    Account::count(account_.frames_rejected);
    if (frame.session == id_ && frame.sequence > last_frame_sequence_)
      frame_refused_.store(frame.sequence, std::memory_order_release);
    account_.note("depth: " + status.error());
    return Intake::kRejected;
  }
  last_frame_sequence_ = frame.sequence;
  last_frame_stamp_ = frame.stamp;
  DepthSample& sample = frames_.slot();
  sample.sequence = frame.sequence;
  sample.stamp = frame.stamp;
  sample.encoding = frame.encoding;
  sample.pixels.swap(frame.pixels);
  frames_.publish();
  frame_arrived_.store(frame.sequence, std::memory_order_release);
  return Intake::kTaken;
}

void Session::note_rejected_state(const std::string& reason) {
  Account::count(account_.states_received);
  Account::count(account_.states_rejected);
  newest_state_rejected_.store(true, std::memory_order_relaxed);
  account_.note("state: " + reason);
}

void Session::note_rejected_frame(const std::string& reason) {
  Account::count(account_.frames_received);
  Account::count(account_.frames_rejected);
  account_.note("depth: " + reason);
}

}  // namespace gatefield::service
