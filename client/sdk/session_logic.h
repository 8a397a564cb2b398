#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/dds/participant_id.h"
#include "common/protocol/messages.h"
#include "gatefield/sdk/client.h"

namespace gatefield::sdk {

/// Whose commands and telemetry a client takes: its server's; its heir's too, once the server says that it leaves, or
/// sent no command for `patience`. Small, so that it can be asked where nothing may wait.
struct Ear {
  dds::ParticipantId server;
  dds::ParticipantId heir;  ///< all zero: none
  bool leaving = false;     ///< the server handed the session over
  Stamp heard{0};           ///< when its newest command came
  Stamp patience{0};

  bool hears(const dds::ParticipantId& from, Stamp now) const noexcept {
    return from == server || (from == heir && heir != dds::ParticipantId() && (leaving || now - heard >= patience));
  }
};

/// The client's side of the session protocol, without a socket or a clock of its own: what comes in, and what to do
/// about it.
///
/// joining --accepted--> joined --refused by our server--> ended --accepted--> joined
///    |--refused, may_pass(code)--> joining, with a new request number after the pause that the refusal asks for
///    '--refused--> failed
///
/// A server is known by its participant; its name is only what it says. Once joined, nobody but the participant whose
/// acceptance was adopted can refuse the session or replace it. An acceptance of the same request by another one is a
/// spare's, adopted when ours is silent although states were sent: for kSilence, or, where it has our server's name (it
/// restarted), for kSilenceOfName.
///
/// Of several servers one may refuse what another one accepts a moment later: until the next request goes out, an
/// acceptance of the one before is as good.
///
/// A refusal that says when asking again is worth while (SessionReply::retry_after_s) is obeyed, up to kLongestPause.
///
/// A server may name an heir: the participant whose commands, of the same session, count as soon as the server leaves
/// or falls silent for two control periods (Ear). With its first one it is the server from then on, and nothing else
/// changes. The server before it isn't heard any more.
///
/// What becomes of the session is kept for who asks (next_change()): a refusal by its server, its silence (no command
/// for kSilence, no word at all for kNoWord: one that withholds its plans still has its say in telemetry), another
/// session or another server after that.
///
/// A request is sent again every kRetry while joining, and every kSilence while the server is silent (servers answer a
/// number that they know already with the same reply).
///
/// Thread-safe: no.
class SessionLogic {
 public:
  static constexpr std::chrono::milliseconds kRetry{500};
  static constexpr std::chrono::milliseconds kRefusedPause{250};  ///< where the refusal names none
  static constexpr std::chrono::milliseconds kLongestPause{60'000};
  static constexpr std::chrono::milliseconds kSilence{1000};
  static constexpr std::chrono::milliseconds kSilenceOfName{500};  ///< longer than any plan: it falls back already
  static constexpr std::chrono::milliseconds kNoWord{1500};        ///< three periods of telemetry
  static constexpr std::size_t kChangesKept = 64;                  ///< of more that nobody asks for, the oldest go

  enum class Phase { kJoining, kJoined, kEnded, kFailed };

  /// @param first_request  number of the first attempt, not 0; later attempts count on from it
  explicit SessionLogic(std::uint64_t first_request) : request_(first_request) {}

  Phase phase() const noexcept { return phase_; }
  /// The number that the next request must carry.
  std::uint64_t request() const noexcept { return request_; }
  /// Why joining failed, or the newest refusal that may pass while it has not; empty: no refusal since joining began.
  const std::optional<Error>& refusal() const noexcept { return refusal_; }
  /// The session in use, and whose it is. @pre joined once
  const protocol::SessionReply& session() const noexcept { return session_; }
  const dds::ParticipantId& server() const noexcept { return ear_.server; }
  const Ear& ear() const noexcept { return ear_; }
  /// Sessions adopted after the first.
  std::uint64_t reconnects() const noexcept { return reconnects_; }
  /// How often an heir went on with a session.
  std::uint64_t take_overs() const noexcept { return take_overs_; }
  /// The longest time from a state that went out to the next command, of this session or the one after it.
  std::chrono::nanoseconds longest_silence() const noexcept { return longest_silence_; }

  /// True when a request is to be sent now; counts as sent.
  bool request_due(Stamp now);

  /// @param from  the participant that sent it
  /// @return true when this reply made a new session the current one.
  bool on_reply(const protocol::SessionReply& reply, const dds::ParticipantId& from, Stamp now);

  /// A state goes out. @return true when the spare server's session was adopted before it.
  bool on_state_sent(Stamp now);

  /// kNew: of the session and newer than the last one. kRepeated: of the session, heard before. kForeign: of another
  /// session, or of who isn't heard.
  enum class Heard { kNew, kRepeated, kForeign };
  Heard on_command(const protocol::ThrustRateCommand& command, const dds::ParticipantId& from, Stamp now);

  /// Telemetry of the session came, from its server.
  void on_telemetry(Stamp now);

  /// The oldest change that was not asked for before.
  std::optional<SessionChange> next_change();

 private:
  struct Spare {
    protocol::SessionReply reply;
    dds::ParticipantId from;
  };
  static Stamp pause_after(const protocol::SessionReply& refusal, std::chrono::milliseconds least);
  void adopt_spare(Stamp now);
  void adopt(const protocol::SessionReply& reply, const dds::ParticipantId& from, Stamp now);
  void adopt_heir();
  void heard(Stamp now);
  void tell(SessionChange change);
  void lose(ErrorCode why, std::string sentence);
  void rejoin();
  std::string silence(Stamp now) const;
  void hear_of(const protocol::SessionReply& reply);
  bool silent(Stamp now, std::chrono::milliseconds limit = kSilence) const {
    return unanswered_since_ && now - *unanswered_since_ >= limit;
  }

  Phase phase_ = Phase::kJoining;
  std::uint64_t request_;
  std::optional<std::uint64_t> refused_;  // number of the attempt before, while no request has gone out since
  std::optional<Error> refusal_;
  protocol::SessionReply session_;
  Ear ear_;
  std::optional<Spare> spare_;
  std::optional<protocol::SessionReply> heirs_;  // what the heir said of the session
  std::deque<SessionChange> changes_;
  bool lost_ = false;  // as told
  Stamp heard_{0};     // when the server said anything last
  std::uint64_t reconnects_ = 0;
  std::uint64_t take_overs_ = 0;
  std::uint64_t last_command_ = 0;
  std::optional<Stamp> next_request_;      // empty: at once
  std::optional<Stamp> unanswered_since_;  // of this session
  std::optional<Stamp> silent_since_;      // whatever became of the session
  std::chrono::nanoseconds longest_silence_{0};
};

}  // namespace gatefield::sdk
