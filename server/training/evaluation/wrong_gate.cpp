#include "server/training/evaluation/wrong_gate.h"

#include <algorithm>
#include <array>

namespace gatefield::training {
namespace {

constexpr int kValiditySteps = 40;
constexpr int kPredictedSteps = 200;

double percent(int part, int whole) {
  return whole > 0 ? 100.0 * part / whole : std::numeric_limits<double>::quiet_NaN();
}

/// `steps` values spread evenly over the sorted ones, first and last among them, each once.
std::vector<double> spread(std::vector<double> values, int steps) {
  std::sort(values.begin(), values.end());
  std::vector<double> out;
  for (int i = 0; i <= steps; ++i)
    out.push_back(values[static_cast<std::size_t>(i) * (values.size() - 1) / static_cast<std::size_t>(steps)]);
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace

double LetThrough::kept_percent() const noexcept { return percent(kept_n, gates_n); }
double LetThrough::wrong_percent() const noexcept { return percent(wrong_n, kept_n); }
double LetThrough::nowhere_percent() const noexcept { return percent(wrong_n - other_n, kept_n); }
double LetThrough::wrong_or_phantom_percent() const noexcept {
  return percent(wrong_n + phantom_n, kept_n + phantom_n);
}

LetThrough let_through(const std::vector<Candidate>& frames, const Thresholds& thresholds) {
  LetThrough out;
  for (const Candidate& frame : frames) {
    const bool passed = thresholds.pass(frame);
    if (frame.has_gate) {
      ++out.gates_n;
      out.kept_n += passed ? 1 : 0;
      const bool wrong = passed && frame.center_m > kWrongGate_m;
      out.wrong_n += wrong ? 1 : 0;
      out.other_n += wrong && frame.other_gate ? 1 : 0;
    } else {
      ++out.empty_n;
      out.phantom_n += passed ? 1 : 0;
    }
  }
  return out;
}

Thresholds best_thresholds(const std::vector<Candidate>& frames, double min_kept) {
  std::vector<double> validity, predicted;
  for (const Candidate& frame : frames) {
    if (!frame.has_gate) continue;
    validity.push_back(frame.validity);
    predicted.push_back(frame.predicted_m);
  }
  Thresholds best{0.0, std::numeric_limits<double>::infinity()};
  if (validity.empty()) return best;
  double best_wrong = std::numeric_limits<double>::infinity();
  int best_kept = 0;
  for (const double validity_min : spread(validity, kValiditySteps)) {
    for (const double predicted_max_m : spread(predicted, kPredictedSteps)) {
      const Thresholds tried{validity_min, predicted_max_m};
      const LetThrough result = let_through(frames, tried);
      if (result.kept_n < min_kept * result.gates_n || result.kept_n == 0) continue;
      const double wrong = result.wrong_percent();
      if (wrong < best_wrong || (wrong == best_wrong && result.kept_n > best_kept)) {
        best = tried;
        best_wrong = wrong;
        best_kept = result.kept_n;
      }
    }
  }
  return best;
}

LetThrough cross_checked(const std::vector<Candidate>& frames, double min_kept) {
  std::array<std::vector<Candidate>, 2> halves;
  for (std::size_t i = 0; i < frames.size(); ++i) halves[i % 2].push_back(frames[i]);
  LetThrough out;
  for (std::size_t half = 0; half < 2; ++half) {
    const LetThrough part = let_through(halves[1 - half], best_thresholds(halves[half], min_kept));
    out.gates_n += part.gates_n;
    out.empty_n += part.empty_n;
    out.kept_n += part.kept_n;
    out.wrong_n += part.wrong_n;
    out.other_n += part.other_n;
    out.phantom_n += part.phantom_n;
  }
  return out;
}

}  // namespace gatefield::training
