#include "client/sdk/session_logic.h"

#include <algorithm>
#include <utility>

#include "common/base/text.h"

namespace gatefield::sdk {
namespace {

Error refusal_in(const protocol::SessionReply& reply) {
  Error refusal(reply.reason, reply.code, reply.field);
  refusal.value = reply.value;
  refusal.expected = reply.expected;
  return refusal;
}

std::string named(const protocol::SessionReply& session) { return "server " + session.server; }

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
      heard(now);
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
    const bool told = phase_ == Phase::kEnded && refusal_->code == reply.code;
    phase_ = Phase::kEnded;
    refusal_ = refusal_in(reply);
    if (!told) lose(reply.code, named(session_) + " has no session for the vehicle any more: " + reply.reason);
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
  if (phase_ != Phase::kJoined) return false;
  if (!lost_ && silent(now) && now - heard_ >= kNoWord) lose(ErrorCode::kNoAnswer, silence(now));
  if (!spare_ || !silent(now, spare_->reply.server == session_.server ? kSilenceOfName : kSilence)) return false;
  if (!lost_) lose(ErrorCode::kNoAnswer, silence(now));
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
  heard(now);
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
  const bool anew = phase_ != Phase::kJoining;
  if (anew) ++reconnects_;
  phase_ = Phase::kJoined;
  ear_ = {from, {}, false, now, {}};
  heirs_.reset();
  hear_of(reply);
  spare_.reset();
  refused_.reset();
  refusal_.reset();
  last_command_ = 0;
  unanswered_since_.reset();
  heard_ = now;
  if (anew) rejoin();
}

/// The heir is the server from now on, and who comes after it is its to say.
void SessionLogic::adopt_heir() {
  ++take_overs_;
  const ErrorCode why = ear_.leaving ? ErrorCode::kLeaving : ErrorCode::kNoAnswer;
  const std::string before = named(session_) + (ear_.leaving ? " handed it over" : " fell silent");
  ear_.server = ear_.heir;
  ear_.leaving = false;
  last_command_ = 0;  // it counts on from what it knows of
  protocol::SessionReply reply = heirs_ ? std::move(*heirs_) : session_;
  if (!heirs_) reply.heir = {};
  reply.code = ErrorCode::kOther;
  heirs_.reset();
  hear_of(reply);
  lost_ = false;
  tell({SessionChange::Kind::kTakenOver, why, session_.server,
        "the session goes on with " + named(session_) + ": " + before});
}

/// Our server said something.
void SessionLogic::heard(Stamp now) {
  heard_ = now;
  if (lost_ && phase_ == Phase::kJoined) rejoin();
}

void SessionLogic::on_telemetry(Stamp now) { heard(now); }

void SessionLogic::lose(ErrorCode why, std::string sentence) {
  lost_ = true;
  tell({SessionChange::Kind::kLost, why, session_.server, std::move(sentence)});
}

void SessionLogic::rejoin() {
  lost_ = false;
  tell(
      {SessionChange::Kind::kRejoined, ErrorCode::kOther, session_.server, "a session again, with " + named(session_)});
}

std::string SessionLogic::silence(Stamp now) const {
  return named(session_) + " fell silent: no plan for " + fixed(seconds(now - *unanswered_since_), 1) + " s";
}

void SessionLogic::tell(SessionChange change) {
  if (changes_.size() == kChangesKept) changes_.pop_front();
  changes_.push_back(std::move(change));
}

std::optional<SessionChange> SessionLogic::next_change() {
  if (changes_.empty()) return std::nullopt;
  SessionChange oldest = std::move(changes_.front());
  changes_.pop_front();
  return oldest;
}

/// What our server says of the session that we have.
void SessionLogic::hear_of(const protocol::SessionReply& reply) {
  session_ = reply;
  ear_.heir.bytes = reply.heir;
  ear_.leaving = reply.code == ErrorCode::kLeaving;
  ear_.patience = 2 * from_seconds(reply.control_period_s);
}

}  // namespace gatefield::sdk
