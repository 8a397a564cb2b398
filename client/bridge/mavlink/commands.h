#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "client/firmware/mavlink/constants.h"
#include "client/firmware/mavlink/messages_command.h"
#include "common/base/clock.h"

namespace gatefield::bridge {

namespace mavlink = firmware::mavlink;

/// How a command stands that was asked for: its last answer, or that there is none yet.
struct CommandFate {
  enum class Kind : std::uint8_t {
    kNeverAsked,
    kWaiting,  ///< sent, no answer yet
    kAccepted,
    kInProgress,
    kRefused,     ///< `result` says how
    kUnanswered,  ///< kTries times in a row
  };
  Kind kind = Kind::kNeverAsked;
  mavlink::CommandResult result = mavlink::CommandResult::kAccepted;
};

/// What is wrong with a command's fate, in words: "arming was refused: denied". Empty: nothing.
/// @param said  what is known beside it, added where it was refused
std::string complaint(const std::string& what, const CommandFate& fate, const std::string& said);

/// Commands to an autopilot, with acknowledgements and time limits: what is not answered within kAnswer is sent again
/// with its confirmation counted up, and after kTries taken as unanswered. Then, as after any other answer, the next
/// try comes kRest later: whoever still wants it has not seen it done. There is one place for each kind of command;
/// asking for the same kind with other parameters begins anew.
/// Thread-safe: no.   Real-time safe: yes.
class CommandDesk {
 public:
  static constexpr Stamp kAnswer{std::chrono::milliseconds(500)};
  static constexpr Stamp kProgress{std::chrono::seconds(5)};  ///< an answer, after one that says in progress
  static constexpr Stamp kRest{std::chrono::seconds(1)};
  static constexpr int kTries = 5;

  /// Wants this done; told again for as long as it is wanted. @return what to send now, if anything
  std::optional<mavlink::CommandLong> want(Stamp now, const mavlink::CommandLong& command) noexcept;
  /// No longer wanted: the next want() begins anew.
  void forget(mavlink::Command command) noexcept;
  void on_ack(Stamp now, const mavlink::CommandAck& ack) noexcept;

  CommandFate fate(mavlink::Command command) const noexcept;

 private:
  struct Entry {
    Entry() = default;
    explicit Entry(const mavlink::CommandLong& request) noexcept : command(request) {}
    mavlink::CommandLong command;
    CommandFate fate;
    bool asked = false;    // since want() began
    bool waiting = false;  // for an answer
    Stamp next{0};         // nothing is sent before this
    int tries = 0;         // since the last answer
  };
  Entry* find(std::uint16_t command) noexcept;

  std::array<Entry, 3> entries_{};  // modes, arming, message intervals
  std::size_t size_ = 0;
};

}  // namespace gatefield::bridge
