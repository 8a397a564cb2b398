#include "client/bridge/mavlink/commands.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <string_view>

namespace gatefield::bridge {
namespace {

using mavlink::CommandLong;
using mavlink::CommandResult;

/// By their bits, since a parameter may be NaN.
bool same_request(const CommandLong& a, const CommandLong& b) noexcept {
  const auto bits = [](const CommandLong& command) {
    return std::bit_cast<std::array<std::uint32_t, 7>>(std::array{command.param1, command.param2, command.param3,
                                                                  command.param4, command.param5, command.param6,
                                                                  command.param7});
  };
  return a.command == b.command && bits(a) == bits(b);
}

CommandFate::Kind kind_of(CommandResult result) noexcept {
  switch (result) {
    case CommandResult::kAccepted:
      return CommandFate::Kind::kAccepted;
    case CommandResult::kInProgress:
      return CommandFate::Kind::kInProgress;
    default:
      return CommandFate::Kind::kRefused;
  }
}

std::string_view word(CommandResult result) {
  switch (result) {
    case CommandResult::kTemporarilyRejected:
      return "not now";
    case CommandResult::kDenied:
      return "denied";
    case CommandResult::kUnsupported:
      return "not supported";
    case CommandResult::kFailed:
      return "failed";
    case CommandResult::kCancelled:
      return "cancelled";
    default:
      return "no such answer is known";
  }
}

}  // namespace

std::string complaint(const std::string& what, const CommandFate& fate, const std::string& said) {
  if (fate.kind == CommandFate::Kind::kUnanswered) return what + " was asked for and never answered; look at the link";
  if (fate.kind != CommandFate::Kind::kRefused) return {};
  return what + " was refused: " + std::string(word(fate.result)) + said;
}

CommandDesk::Entry* CommandDesk::find(std::uint16_t command) noexcept {
  const auto end = entries_.begin() + static_cast<std::ptrdiff_t>(size_);
  const auto found = std::find_if(entries_.begin(), end, [&](const Entry& e) { return e.command.command == command; });
  return found == end ? nullptr : &*found;
}

std::optional<CommandLong> CommandDesk::want(Stamp now, const CommandLong& command) noexcept {
  Entry* entry = find(command.command);
  if (entry == nullptr) {
    assert(size_ < entries_.size());
    entry = &entries_[size_++];
    *entry = Entry(command);
  } else if (!same_request(entry->command, command)) {
    *entry = Entry(command);
  }
  if (entry->asked && now < entry->next) return std::nullopt;
  if (entry->waiting && entry->tries == kTries) {
    entry->fate = {CommandFate::Kind::kUnanswered, {}};
    entry->waiting = false;
    entry->next = now + kRest;
    return std::nullopt;
  }
  if (!entry->waiting) entry->tries = 0;
  if (!entry->asked) entry->fate.kind = CommandFate::Kind::kWaiting;
  entry->asked = entry->waiting = true;
  entry->next = now + kAnswer;
  entry->command.confirmation = static_cast<std::uint8_t>(entry->tries++);
  return entry->command;
}

void CommandDesk::forget(mavlink::Command command) noexcept {
  Entry* const entry = find(static_cast<std::uint16_t>(command));
  if (entry != nullptr) *entry = Entry(entry->command);
}

void CommandDesk::on_ack(Stamp now, const mavlink::CommandAck& ack) noexcept {
  Entry* const entry = find(ack.command);
  if (entry == nullptr || !entry->asked) return;
  const auto result = static_cast<CommandResult>(ack.result);
  entry->fate = {kind_of(result), result};
  entry->waiting = result == CommandResult::kInProgress;
  entry->next = now + (entry->waiting ? kProgress : kRest);
}

CommandFate CommandDesk::fate(mavlink::Command command) const noexcept {
  for (std::size_t i = 0; i < size_; ++i)
    if (entries_[i].command.command == static_cast<std::uint16_t>(command)) return entries_[i].fate;
  return {};
}

}  // namespace gatefield::bridge
