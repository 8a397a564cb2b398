#include "client/bridge/sources/admission.h"

#include <algorithm>

#include "common/base/text.h"

namespace gatefield::bridge::sources {
namespace {

std::string milliseconds(Stamp span) { return fixed(1e3 * seconds(span), 1) + " ms"; }

}  // namespace

std::optional<Stamp> Admission::refuse(Refusal reason) noexcept {
  ++refused_[static_cast<std::size_t>(reason)];
  return std::nullopt;
}

void Admission::refuse(Refusal reason, const Error& why) {
  refuse(reason);
  const std::lock_guard lock(mutex_);
  why_ = why;
}

std::optional<Stamp> Admission::admit(const Moment& moment, std::chrono::nanoseconds stamp,
                                      std::uint64_t program) noexcept {
  const bool speaking = last_ && moment.now - last_heard_ < kSilent;
  if (speaking && program != program_) return refuse(Refusal::kTwoPrograms);
  Stamp age = options_.delay;
  if (options_.from == TimeOptions::From::kSystemClock) {
    age = moment.wall - stamp;
    if (age < -kFuture || age > options_.oldest) {
      wrong_age_ns_ = age.count();
      return refuse(age < Stamp{0} ? Refusal::kFuture : Refusal::kOld);
    }
  }
  const Stamp held = moment.now - age;
  if (last_ && held <= *last_) return refuse(Refusal::kNotRising);
  if (speaking) {
    constexpr std::int64_t kSmoothing = 16;
    const std::int64_t spacing = (held - *last_).count(), before = spacing_ns_;
    spacing_ns_ = before == 0 ? spacing : before + (spacing - before) / kSmoothing;
  }
  last_ = held;
  last_heard_ = moment.now;
  program_ = program;
  age_ns_ = age.count();
  ++taken_;
  return held;
}

double Admission::rate_hz() const noexcept {
  const std::int64_t spacing = spacing_ns_;
  return spacing > 0 ? 1e9 / static_cast<double>(spacing) : 0.0;
}

std::optional<Error> Admission::complaint(const std::string& topic) const {
  const auto most = std::max_element(refused_.begin(), refused_.end(),
                                     [](const auto& a, const auto& b) { return a.load() < b.load(); });
  constexpr std::uint64_t kOneIn = 20;  // a stray one is no reason to complain
  if (most->load() == 0 || most->load() * kOneIn < taken_) return std::nullopt;
  const auto reason = static_cast<Refusal>(most - refused_.begin());
  const auto told = [&](std::string field, std::string value, std::string expected) {
    Error error = Error::invalid(std::move(field), std::move(value), std::move(expected));
    error.message = topic + ": " + text(most->load()) + " messages were refused; " + error.message;
    return error;
  };
  switch (reason) {
    case Refusal::kFuture:
    case Refusal::kOld:
      return told("header.stamp", milliseconds(Stamp(wrong_age_ns_)) + " old",
                  milliseconds(-kFuture) + " to " + milliseconds(options_.oldest) +
                      ": keep both machines' clocks together (PTP, chrony), stamp by the system clock, or say "
                      "from: ARRIVAL and how long a message takes (delay)");
    case Refusal::kNotRising:
      return told("header.stamp", "not newer than the one before",
                  "stamps that rise: the publisher repeats messages, or stamps them by whole milliseconds");
    case Refusal::kTwoPrograms:
      return told("publisher", "more than one program", "one: stop the other, or give it another topic");
    case Refusal::kMalformed:
    case Refusal::kFrame:
    case Refusal::kSize:
      break;
  }
  const std::lock_guard lock(mutex_);
  Error error = why_.value_or(Error("they make no sense"));
  error.message = topic + ": " + text(most->load()) + " messages were refused; " + error.message;
  return error;
}

}  // namespace gatefield::bridge::sources
