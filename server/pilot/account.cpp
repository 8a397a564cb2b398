#include "server/pilot/account.h"

#include <utility>

#include "common/base/text.h"

namespace gatefield::pilot {

void Account::note(Note note) {
  count(noted[index(note.code)]);
  note.sentence = shown(note.sentence, protocol::kMaxReasonLength);
  for (std::string* const part : {&note.field, &note.value, &note.expected})
    *part = shown(*part, protocol::kMaxFieldLength);
  const std::lock_guard lock(mutex_);
  last_note_ = std::move(note);
  ++unlogged_;
}

void Account::withhold(Withheld why) noexcept {
  withheld_.store(static_cast<int>(why), std::memory_order_relaxed);
  count(commands_withheld_);
}

void Account::fill(protocol::Telemetry* telemetry) {
  telemetry->states_received = states_received.load(std::memory_order_relaxed);
  telemetry->states_rejected = states_rejected.load(std::memory_order_relaxed);
  telemetry->frames_received = frames_received.load(std::memory_order_relaxed);
  telemetry->frames_rejected = frames_rejected.load(std::memory_order_relaxed);
  telemetry->frames_invalid = frames_invalid.load(std::memory_order_relaxed);
  telemetry->commands_sent = commands_sent.load(std::memory_order_relaxed);
  telemetry->deadlines_missed = deadlines_missed.load(std::memory_order_relaxed);
  telemetry->encode_time_s = 1e-9 * static_cast<double>(encode_time_ns.load(std::memory_order_relaxed));
  const std::lock_guard lock(mutex_);
  const Note note = last_note_.value_or(Note{});
  telemetry->last_code = note.code;
  telemetry->last_field = note.field;
  telemetry->last_value = note.value;
  telemetry->last_expected = note.expected;
  telemetry->last_reason = note.sentence;
}

std::optional<Note> Account::last_note() {
  const std::lock_guard lock(mutex_);
  return last_note_;
}

std::optional<std::string> Account::complaints() {
  const std::lock_guard lock(mutex_);
  std::string text;
  if (unlogged_ > 0)
    text = std::to_string(unlogged_) + (unlogged_ == 1 ? " complaint" : " complaints") +
           ", the last: " + last_note_->sentence;
  unlogged_ = 0;
  if (const std::uint64_t withheld = commands_withheld_.load(std::memory_order_relaxed); withheld != withheld_logged_) {
    const char* const why = sentence(static_cast<Withheld>(withheld_.load(std::memory_order_relaxed)));
    if (!text.empty()) text += "; ";
    text += std::to_string(withheld - withheld_logged_) + " times " + why;
    last_note_ = Note{ErrorCode::kOther, {}, why};
    withheld_logged_ = withheld;
  }
  if (const std::uint64_t lost = commands_lost.load(std::memory_order_relaxed); lost != lost_logged_) {
    if (!text.empty()) text += "; ";
    text += std::to_string(lost - lost_logged_) + " times the transport took no command";
    lost_logged_ = lost;
  }
  if (text.empty()) return std::nullopt;
  return text;
}

}  // namespace gatefield::pilot
