#include "server/pilot/intake.h"

#include <string>

#include "common/base/text.h"
#include "common/protocol/validate.h"

namespace gatefield::pilot {
namespace {

Status check_session(std::uint64_t session, std::uint64_t expected) {
  if (session == expected) return {};
  return Error::invalid("session", std::to_string(session), std::to_string(expected), ErrorCode::kWrongSession);
}

/// Why a sample is not taken that does not go on along its line.
/// @param what   "states" or "frames"
/// @param order  of the samples before it
Error off_the_line(std::uint64_t sequence, Stamp stamp, const TimeLine& order, TimeLine::Verdict verdict,
                   const char* what) {
  const std::string newest = std::to_string(order.last_sequence());
  const std::string number = std::to_string(sequence);
  if (verdict != TimeLine::Verdict::kOff)
    return Error::invalid("sequence", number, "more than " + newest + " (" + what + " must rise)",
                          ErrorCode::kNotRising);
  const bool stamp_jumped =
      !order.begun() || (sequence > order.last_sequence() && sequence - order.last_sequence() <= TimeLine::kMaxSkip);
  const std::string to = stamp_jumped ? std::to_string(stamp.count()) + " ns" : number;
  std::string from, expected;
  if (!order.begun()) {
    expected = "at most " + std::to_string(TimeLine::kMaxStamp.count()) + " ns";
  } else if (stamp_jumped) {
    from = " from " + std::to_string(order.last_stamp().count()) + " ns";
    expected = "a time that rises with the clock from " + std::to_string(order.last_stamp().count()) + " ns on";
  } else {
    from = " from " + newest;
    expected = "the next number after " + newest + ", or soon after it";
  }
  const std::string field = stamp_jumped ? "stamp" : "sequence";
  Error error(field + " jumped" + from + " to " + to + ": " + what + " are dropped until " +
                  std::to_string(TimeLine::kAgree) + " in a row agree",
              ErrorCode::kNotRising, field);
  error.value = to;
  error.expected = expected;
  return error;
}

std::string text(const Eigen::Ref<const Eigen::VectorXd>& values) {
  std::string out = "(";
  for (Eigen::Index i = 0; i < values.size(); ++i) out += (i > 0 ? " " : "") + fixed(values[i], 2);
  return out + ")";
}

/// Why a state is not taken that the speeds don't explain. @param field  of MotionLine
Error off_the_motion(const std::string& field, const MotionLine::Point& from, const QuadrotorState& to) {
  const auto of = [&](const auto& state) {
    if (field == "p_WB") return text(state.p_WB) + " m";
    if (field == "v_WB") return text(state.v_WB) + " m/s";
    return text(state.q_WB.coeffs());
  };
  Error error(field + " jumped from " + of(from) + " to " + of(to) + ": states are dropped until " +
                  std::to_string(MotionLine::kAgree) + " in a row agree",
              ErrorCode::kInvalid, field);
  error.value = of(to);
  error.expected = "what the speeds explain from " + of(from) + " on";
  return error;
}

}  // namespace

Intake::Intake(const protocol::SessionRequest* request, std::uint64_t session, Mailboxes* shared)
    : request_(request), session_(session), shared_(shared) {}

Intake::State Intake::state() const {
  const std::scoped_lock lock(states_mutex_, frames_mutex_);
  return lines_;
}

Status Intake::check(const protocol::VehicleState& state) const {
  if (auto s = protocol::validate(state); !s) return s;
  return check_session(state.session, session_);
}

Intake::Outcome Intake::take_state(const protocol::VehicleState& state, Stamp now) {
  const std::lock_guard lock(states_mutex_);
  Account::count(shared_->account.states_received);
  const auto reject = [&](const Error& why) {
    Account::count(shared_->account.states_rejected);
    shared_->account.note(note_of("state", why));
    return Outcome::kRejected;
  };
  if (const Status status = check(state); !status) {
    if (state.session == session_) shared_->newest_state_rejected.store(true, std::memory_order_relaxed);
    return reject(status.failure());
  }
  Line& line = lines_.states;
  const TimeLine before = line.order;
  const TimeLine::Verdict verdict = line.order.judge(state.sequence, state.stamp, now, lockstep());
  if (verdict == TimeLine::Verdict::kRepeated && lockstep()) {
    shared_->last_heard.store(now.count(), std::memory_order_relaxed);
    shared_->repeat_wanted.store(true, std::memory_order_release);
    return Outcome::kRepeated;
  }
  const bool off = verdict == TimeLine::Verdict::kOff;
  if (off || verdict == TimeLine::Verdict::kNewLine) shared_->stamps_jumped.store(true, std::memory_order_relaxed);
  if (off) shared_->newest_state_rejected.store(true, std::memory_order_relaxed);
  if (!TimeLine::taken(verdict)) return reject(off_the_line(state.sequence, state.stamp, before, verdict, "states"));
  if (verdict == TimeLine::Verdict::kNewLine) {
    shared_->history.begin_line(++line.number);
    lines_.motion.begin_anew();
  }
  const MotionLine::Point moved_from = lines_.motion.state().newest;
  const MotionLine::Judgement motion = lines_.motion.judge(state.stamp, now, state.state, lockstep());
  if (motion.verdict == MotionLine::Verdict::kOff) {
    line.order = before;  // as if it had not come: in lockstep the same one may come again
    shared_->newest_state_rejected.store(true, std::memory_order_relaxed);
    shared_->motion_jumped.store(true, std::memory_order_relaxed);
    return reject(off_the_motion(motion.field, moved_from, state.state));
  }
  if (motion.verdict == MotionLine::Verdict::kNewLine) shared_->history.begin_line(line.number);

  if (!before.begun()) {
    // A vehicle in mid-race that lost its server says where it was; perception has to know before the first plan does.
    gates::CourseProgress from(request_->course);
    from.resume(state.heard_waypoint, state.heard_lap);
    shared_->aim(from);
  }
  shared_->last_heard.store(now.count(), std::memory_order_relaxed);
  shared_->newest_state_rejected.store(false, std::memory_order_relaxed);
  shared_->history.add(state.stamp, state.state);

  StateSample& sample = shared_->states.slot();
  sample.sequence = state.sequence;
  sample.stamp = state.stamp;
  sample.line = line.number;
  sample.jumps = lines_.motion.jumps();
  sample.received = now;
  sample.state = state.state;
  sample.state.q_WB.normalize();
  sample.thrust_known = state.thrust_known;
  sample.round_trip = state.round_trip;
  if (state.round_trip.count() > 0)
    shared_->account.round_trip_ns.store(state.round_trip.count(), std::memory_order_relaxed);
  sample.depth_sequence = state.depth_sequence;
  sample.heard_waypoint = state.heard_waypoint;
  sample.heard_lap = state.heard_lap;
  sample.asked = state.asked;
  shared_->states.publish();
  if (state.depth_sequence != 0) shared_->frame_named.store(state.depth_sequence, std::memory_order_release);
  return Outcome::kTaken;
}

Status Intake::check(const protocol::DepthFrame& frame) const {
  if (auto s = check_session(frame.session, session_); !s) return s;
  return protocol::validate(frame, request_->camera);
}

Intake::Outcome Intake::take_depth(protocol::DepthFrame& frame, Stamp now) {
  const std::lock_guard lock(frames_mutex_);
  Account::count(shared_->account.frames_received);
  Line& line = lines_.frames;
  const auto reject = [&](const Error& why, bool late) {
    Account::count(shared_->account.frames_rejected);
    shared_->account.note(note_of("depth", why));
    if (frame.session != session_ || late) return Outcome::kRejected;
    shared_->newest_frame_rejected.store(true, std::memory_order_relaxed);
    if (!line.order.begun() || frame.sequence > line.order.last_sequence())
      shared_->frame_refused.store(frame.sequence, std::memory_order_release);
    return Outcome::kRejected;
  };
  if (const Status status = check(frame); !status) return reject(status.failure(), false);
  const TimeLine before = line.order;
  const TimeLine::Verdict verdict = line.order.judge(frame.sequence, frame.stamp, now, lockstep());
  if (verdict == TimeLine::Verdict::kRepeated) return Outcome::kRepeated;
  const bool off = verdict == TimeLine::Verdict::kOff;
  if (off || verdict == TimeLine::Verdict::kNewLine) shared_->stamps_jumped.store(true, std::memory_order_relaxed);
  if (!TimeLine::taken(verdict))
    return reject(off_the_line(frame.sequence, frame.stamp, before, verdict, "frames"), !off);
  if (verdict == TimeLine::Verdict::kNewLine) ++line.number;
  shared_->newest_frame_rejected.store(false, std::memory_order_relaxed);
  DepthSample& sample = shared_->frames.slot();
  sample.sequence = frame.sequence;
  sample.stamp = frame.stamp;
  sample.line = line.number;
  sample.encoding = frame.encoding;
  sample.pixels.swap(frame.pixels);
  shared_->frames.publish();
  shared_->frames_line.store(line.number, std::memory_order_release);
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
  shared_->newest_frame_rejected.store(true, std::memory_order_relaxed);
  shared_->account.note(note_of("depth", why));
}

}  // namespace gatefield::pilot
