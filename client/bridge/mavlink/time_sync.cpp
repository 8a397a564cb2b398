#include "client/bridge/mavlink/time_sync.h"

#include <algorithm>
#include <cmath>

#include "common/base/text.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

constexpr Stamp kLatest = 24h * 365 * 120;  // of any clock, since 1970 at most: differences of stamps can be told then
constexpr Stamp kJitter = 500us;            // of a round trip, above the shortest, that still counts as near it

std::string milliseconds(Stamp span) { return text(seconds(span) * 1e3) + " ms"; }

}  // namespace

Status validate(const TimeSyncOptions& options) {
  if (options.ask_every < 10ms || options.ask_every > 1s)
    return Error::invalid("time_sync.ask_every", milliseconds(options.ask_every), "10 to 1000 ms");
  if (options.longest_round_trip < 1ms || options.longest_round_trip > 1s)
    return Error::invalid("time_sync.longest_round_trip", milliseconds(options.longest_round_trip), "1 to 1000 ms");
  if (!(options.most_drift_ppm >= 1 && options.most_drift_ppm <= 10000))
    return Error::invalid("time_sync.most_drift_ppm", text(options.most_drift_ppm) + " ppm", "1 to 10000 ppm");
  return {};
}

bool TimeSync::ask(Stamp now) noexcept {
  if (asked_ && now - *asked_ < options_.ask_every) return false;
  asked_ = now;
  return true;
}

void TimeSync::on_answer(Stamp now, Stamp asked, Stamp theirs) noexcept {
  const bool possible = asked_ && asked >= Stamp{0} && asked <= *asked_ && theirs >= Stamp{0} && theirs <= kLatest;
  const Stamp round_trip = possible ? now - asked : Stamp{-1};
  if (round_trip < Stamp{0} || round_trip > kSilent) {
    ++impossible_;
    return;
  }
  const Answer answer{asked + round_trip / 2, theirs - (asked + round_trip / 2), round_trip};
  if (size_ > 0) {
    const Stamp error = answer.offset - offset_at(answer.at);
    const Stamp drifted = from_seconds(seconds(answer.at - at_) * options_.most_drift_ppm * 1e-6);
    if (std::max(error, -error) > (round_trip + shortest_) / 2 + kJitter + std::max(drifted, -drifted)) {
      if (++contradictions_ < kRestart) return;
      size_ = next_ = 0;
      ++restarts_;
    }
  }
  contradictions_ = 0;
  ++answers_;
  add(answer);
  fit();
}

void TimeSync::add(const Answer& answer) noexcept {
  window_[next_] = answer;
  next_ = (next_ + 1) % kWindow;
  size_ = std::min(size_ + 1, kWindow);
  at_ = answer.at;
}

void TimeSync::fit() noexcept {
  const auto* const begin = window_.begin();
  const auto* const end = begin + size_;
  shortest_ = std::min_element(begin, end, [](const Answer& a, const Answer& b) {
                return a.round_trip < b.round_trip;
              })->round_trip;
  const Stamp base = begin->offset;  // offsets are huge and differ by little
  double weights = 0.0, time = 0.0, offset = 0.0, time_time = 0.0, time_offset = 0.0, first = 0.0;
  for (const auto* answer = begin; answer != end; ++answer) {
    if (answer->round_trip > 2 * shortest_ + kJitter) continue;
    const double t = seconds(answer->at - at_);
    const double y = seconds(answer->offset - base);
    const double weight = 1.0 / std::pow(seconds(answer->round_trip + kJitter), 2);
    weights += weight;
    time += weight * t;
    offset += weight * y;
    time_time += weight * t * t;
    time_offset += weight * t * y;
    first = std::min(first, t);
  }
  const double spread = time_time - time * time / weights;
  drift_ = -first >= seconds(kDriftSpan) ? (time_offset - time * offset / weights) / spread : 0.0;
  offset_ = base + from_seconds((offset - drift_ * time) / weights);
}

Stamp TimeSync::offset_at(Stamp now) const noexcept { return offset_ + from_seconds(drift_ * seconds(now - at_)); }

std::optional<Stamp> TimeSync::ours(Stamp now, Stamp theirs) const noexcept {
  if (trouble(now) != Trouble::kNone) return std::nullopt;
  return theirs - offset_at(now);
}

TimeSync::Trouble TimeSync::trouble(Stamp now) const noexcept {
  if (size_ < kEnough || now - at_ > kSilent) return Trouble::kNoAnswers;
  if (shortest_ > options_.longest_round_trip) return Trouble::kRoundTrip;
  if (std::abs(drift_ppm()) > options_.most_drift_ppm) return Trouble::kDrift;
  return Trouble::kNone;
}

Status describe(TimeSync::Trouble trouble, Stamp round_trip, double drift_ppm, const TimeSyncOptions& options) {
  switch (trouble) {
    case TimeSync::Trouble::kNone:
      return {};
    case TimeSync::Trouble::kNoAnswers:
      return Error(
          "the autopilot answers no TIMESYNC, so its stamps say nothing here; if it never does, set stamps to "
          "ARRIVAL",
          ErrorCode::kNoAnswer, "time_sync");
    case TimeSync::Trouble::kRoundTrip:
      return Error::invalid("time_sync.round_trip", milliseconds(round_trip),
                            "at most " + milliseconds(options.longest_round_trip) +
                                "; a faster link, fewer messages on it, or a larger time_sync.longest_round_trip");
    case TimeSync::Trouble::kDrift:
      return Error::invalid(
          "time_sync.drift", text(drift_ppm) + " ppm",
          "at most " + text(options.most_drift_ppm) + " ppm; one of the clocks is being set or slewed");
  }
  return {};
}

}  // namespace gatefield::bridge
