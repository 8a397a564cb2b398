#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "common/base/clock.h"
#include "common/protocol/asked.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::pilot {

/// What the vehicle was told to do, as pieces of constant input over the client's time: thrust rates, or by body rates
/// what was asked for (RateCommand). A plan holds from its start until the next one's start; what it said beyond that
/// is cut off, because the client switches over there. Past the newest plan's validity, and before the first one, the
/// input is the one that changes nothing (thrust rates of zero; a hover).
///
/// A state may say that something else than the plans holds (protocol::Asked). That is sampled, at the states that were
/// taken in, so each sample counts from half-way between the state before it and its own, and the newest one goes on:
/// a fallback's until the first plan begins that was sent since the client fell back (the client switches over by
/// itself), anything else's until a state says otherwise. Where nobody knows, the input is the one that changes
/// nothing.
/// Thread-safe: no (control step).   Real-time safe: yes (fixed memory).
class InputTimeline {
 public:
  /// @param still  the input where no plan holds
  explicit InputTimeline(const PlainVector4& still = PlainVector4::Zero()) noexcept : still_(still) {}

  /// A plan was sent. @param step  length of each interval, more than 0
  void add(Stamp plan_start, Stamp step, std::span<const PlainVector4> inputs, Stamp validity) noexcept;

  /// What was sent did not hold before `from`: the first plan's delay was not known when it was made.
  void begin_at(Stamp from) noexcept;

  /// A state says what held at its stamp. After this, nothing is asked about what lies before `last`.
  /// @param last  stamp of the state before it; its own when it is the first
  void tell(Stamp last, Stamp stamp, const protocol::Asked& asked) noexcept;

  /// Whether it is known what held during all of [from, to]: plans cover it, or it was told. A time in which plans and
  /// something else took turns is not: when they did is known to half the time between two states only.
  bool covers(Stamp from, Stamp to) const noexcept;
  /// The input that holds at a stamp.
  PlainVector4 at(Stamp stamp) const noexcept;

  /// Calls f(input, from, to) for consecutive pieces that cover [from, to] without a hole.
  template <typename F>
  void visit(Stamp from, Stamp to, F&& f) const noexcept {
    if (from < turn_) {
      const Stamp until = std::min(turn_, to);
      visit_as(before_, from, until, f);
      from = until;
    }
    if (from < to) visit_as(now_, from, to, f);
  }

  struct Piece {
    Stamp from{0};
    Stamp to{0};
    PlainVector4 input = PlainVector4::Zero();
  };
  /// What plans say from `from` on: to be written down. Allocates.
  std::vector<Piece> pieces(Stamp from) const;
  /// @param pieces  one after the other, each longer than nothing; @return false, and nothing changes, when they aren't
  bool restore(std::span<const Piece> pieces) noexcept;

  /// What the newest state told: to be written down.
  struct Told {
    protocol::Asked asked;
    Stamp plan_resumes = Stamp::max();  ///< kFallback: when the first plan begins that was sent since
  };
  const Told& told() const noexcept { return now_; }
  void restore(const Told& told) noexcept;

 private:
  /// 0.89 s of plans at 500 Hz, the fastest control rate, and one plan of 64 intervals on top.
  static constexpr std::size_t kCapacity = 512;
  const Piece& nth(std::size_t index) const noexcept { return ring_[(first_ + index) % kCapacity]; }
  Piece& nth(std::size_t index) noexcept { return ring_[(first_ + index) % kCapacity]; }

  template <typename F>
  void visit_as(const Told& told, Stamp from, Stamp to, F&& f) const noexcept {
    if (told.asked.by == protocol::AskedBy::kPlans) return visit_plans(from, to, f);
    if (!told.asked.told()) return f(still_, from, to);
    const Stamp until = std::min(told.plan_resumes, to);
    if (from < until) f(told.asked.command, from, until);
    if (until < to) visit_plans(std::max(from, until), to, f);
  }
  template <typename F>
  void visit_plans(Stamp from, Stamp to, F&& f) const noexcept {
    std::size_t i = 0;
    std::size_t last = count_;  // nth(i).to > from for all i >= the one found
    while (i < last) {
      const std::size_t middle = i + (last - i) / 2;
      if (nth(middle).to <= from)
        i = middle + 1;
      else
        last = middle;
    }
    for (; from < to && i < count_; ++i) {
      const Piece& piece = nth(i);
      if (piece.from > from) {
        const Stamp until = std::min(piece.from, to);
        f(still_, from, until);
        from = until;
      }
      if (from >= to) return;
      const Stamp until = std::min(piece.to, to);
      f(piece.input, from, until);
      from = until;
    }
    if (from < to) f(still_, from, to);
  }
  bool plans_cover(Stamp from, Stamp to) const noexcept;
  bool covers_as(const Told& told, Stamp from, Stamp to) const noexcept;

  PlainVector4 still_;
  std::array<Piece, kCapacity> ring_;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  Told before_, now_;  // before_ holds until turn_, now_ from there on
  Stamp turn_ = Stamp::min();
};

}  // namespace gatefield::pilot
