#pragma once

#include <limits>
#include <vector>

namespace gatefield::training {

/// A centre farther off than this is another gate, or none.
inline constexpr double kWrongGate_m = 0.5;

/// What the network said of one frame, and whether it was right.
struct Candidate {
  double validity = 0.0;
  double predicted_m = std::numeric_limits<double>::infinity();  ///< its own guess of its error; infinity: nothing said
  bool has_gate = true;     ///< false: no gate is in view, so whatever is let through is wrong
  double center_m = 0.0;    ///< error of the centre; large when the field shows none
  bool other_gate = false;  ///< wrong, and on another gate
};

struct Thresholds {
  double validity_min = 0.5;
  double predicted_max_m = std::numeric_limits<double>::infinity();

  bool pass(const Candidate& frame) const noexcept {
    return frame.validity >= validity_min && frame.predicted_m <= predicted_max_m;
  }
};

struct LetThrough {
  int gates_n = 0;    ///< frames with a gate
  int empty_n = 0;    ///< frames without
  int kept_n = 0;     ///< of the frames with a gate, let through
  int wrong_n = 0;    ///< of these, with the centre off by more than kWrongGate_m
  int other_n = 0;    ///< of these, on another gate of the world
  int phantom_n = 0;  ///< of the frames without, let through

  double kept_percent() const noexcept;     ///< of the frames with a gate
  double wrong_percent() const noexcept;    ///< of those let through
  double nowhere_percent() const noexcept;  ///< of those let through: wrong and on no other gate either
  /// (wrong + phantom) of everything let through.
  double wrong_or_phantom_percent() const noexcept;
};

LetThrough let_through(const std::vector<Candidate>& frames, const Thresholds& thresholds);

/// The pair that lets the smallest part of wrong gates through while it keeps at least `min_kept` of the frames with a
/// gate; among equals the one that keeps most. Searched over quantiles of both outputs.
Thresholds best_thresholds(const std::vector<Candidate>& frames, double min_kept);

/// What best_thresholds() is worth on frames that it was not chosen on: chosen on every other frame, counted on the
/// ones between, and the other way round, added up.
LetThrough cross_checked(const std::vector<Candidate>& frames, double min_kept);

}  // namespace gatefield::training
