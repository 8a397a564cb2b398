#include "client/sdk/session_logic.h"

#include <algorithm>
#include <utility>

namespace gatefield::sdk {
namespace {

Error refusal_in(const protocol::SessionReply& reply) {
  Error refusal(reply.reason, reply.code, reply.field);
  refusal.value = reply.value;
  refusal.expected = reply.expected;
  return refusal;
}

}  // namespace

Stamp SessionLogic::pause_after(const protocol::SessionReply& refusal, std::chrono::milliseconds least) {
  return std::clamp<Stamp>(from_seconds(refusal.retry_after_s), least, kLongestPause);
}

bool SessionLogic::request_due(Stamp now) {
  const bool wanted =
      phase_ == Phase::kJoining || ((phase_ == Phase::kJoined || phase_ == Phase::kEnded) && silent(now));
  if (!wanted || (next_request_ && now < *next_request_)) return false;
  refused_.reset();
  next_request_ = now + (phase_ == Phase::kJoining ? kRetry : kSilence);
  return true;
}

bool SessionLogic::on_reply(const protocol::SessionReply& reply, const dds::ParticipantId& from, Stamp now) {
  const bool late_acceptance = reply.accepted && refused_ && reply.request == *refused_;
  if (phase_ == Phase::kFailed || (reply.request != request_ && !late_acceptance)) return false;
  request_ = reply.request;
  const bool ours = phase_ != Phase::kJoining && from == ear_.server;

  if (reply.accepted) {
    const bool known = phase_ == Phase::kJoined && reply.session == session_.session;
    if (known && ours) {
      hear_of(reply);
      return false;
    }
    if (known && from.bytes == session_.heir) {
      heirs_ = reply;
      return false;
    }
    if (phase_ == Phase::kJoined && !ours) {
      spare_ = {reply, from};
      return false;
    }
    adopt(reply, from, now);
    return true;
  }

  if (phase_ == Phase::kJoining) {
    refusal_ = refusal_in(reply);
    if (may_pass(reply.code)) {
      refused_ = request_;
      ++request_;
      if (request_ == 0) request_ = 1;
      next_request_ = now + pause_after(reply, kRefusedPause);
    } else {
      phase_ = Phase::kFailed;
    }
  } else if (ours) {
    phase_ = Phase::kEnded;
    refusal_ = refusal_in(reply);
    if (reply.retry_after_s > 0) next_request_ = now + pause_after(reply, kSilence);
    if (spare_) {
      adopt_spare(now);
      return true;
    }
  } else if (spare_ && spare_->from == from) {
    spare_.reset();
  }
  return false;
}

bool SessionLogic::on_state_sent(Stamp now) {
  if (!unanswered_since_) unanswered_since_ = now;
  if (!silent_since_) silent_since_ = now;
  if (phase_ != Phase::kJoined || !spare_) return false;
  if (!silent(now, spare_->reply.server == session_.server ? kSilenceOfName : kSilence)) return false;
  adopt_spare(now);
  unanswered_since_ = now;
  return true;
}

SessionLogic::Heard SessionLogic::on_command(const protocol::ThrustRateCommand& command, const dds::ParticipantId& from,
                                             Stamp now) {
  if (phase_ == Phase::kJoining || phase_ == Phase::kFailed || command.session != session_.session)
    return Heard::kForeign;
  if (from != ear_.server) {
    if (phase_ != Phase::kJoined || !ear_.hears(from, now)) return Heard::kForeign;
    adopt_heir();
  }
  if (command.sequence <= last_command_) return Heard::kRepeated;
  last_command_ = command.sequence;
  ear_.heard = now;
  unanswered_since_.reset();
  if (silent_since_) longest_silence_ = std::max<std::chrono::nanoseconds>(longest_silence_, now - *silent_since_);
  silent_since_.reset();
  return Heard::kNew;
}

void SessionLogic::adopt_spare(Stamp now) {
  const Spare spare = std::move(*spare_);
  adopt(spare.reply, spare.from, now);
}

void SessionLogic::adopt(const protocol::SessionReply& reply, const dds::ParticipantId& from, Stamp now) {
  if (phase_ != Phase::kJoining) ++reconnects_;
  phase_ = Phase::kJoined;
  ear_ = {from, {}, false, now, {}};
  heirs_.reset();
  hear_of(reply);
  spare_.reset();
  refused_.reset();
  refusal_.reset();
  last_command_ = 0;
  unanswered_since_.reset();
}

/// The heir is the server from now on, and who comes after it is its to say.
void SessionLogic::adopt_heir() {
  ++take_overs_;
  ear_.server = ear_.heir;
  ear_.leaving = false;
  last_command_ = 0;  // it counts on from what it knows of
  protocol::SessionReply reply = heirs_ ? std::move(*heirs_) : session_;
  if (!heirs_) reply.heir = {};
  reply.code = ErrorCode::kOther;
  heirs_.reset();
  hear_of(reply);
}

/// What our server says of the session that we have.
void SessionLogic::hear_of(const protocol::SessionReply& reply) {
  session_ = reply;
  ear_.heir.bytes = reply.heir;
  ear_.leaving = reply.code == ErrorCode::kLeaving;
  ear_.patience = 2 * from_seconds(reply.control_period_s);
}

}  // namespace gatefield::sdk
