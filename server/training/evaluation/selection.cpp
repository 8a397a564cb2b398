#include "server/training/evaluation/selection.h"

#include <cmath>

namespace gatefield::training {
namespace {

/// Less than this is empty in training; between it and kValidVisibleFraction, validity isn't asked there.
constexpr double kLittleVisible = 0.12;

}  // namespace

Selected select(const HeldOut& frames, std::size_t bundle, Mode mode,
                const std::function<bool(const GateFacts&)>& holds) {
  Selected out;
  for (std::size_t i = 0; i < frames.truth.size(); ++i) {
    if (!frames.truth[i].has_gate || !holds(frames.truth[i].gate)) continue;
    out.truth.push_back(&frames.truth[i]);
    out.measured.push_back(&frames.measured[bundle][i].modes[index_of(mode)]);
  }
  return out;
}

std::vector<RocPoint> validity_curve(const HeldOut& frames, std::size_t bundle, Empty empty, int* positives,
                                     int* negatives) {
  const Mode mode = empty == Empty::kPlaces ? Mode::kPrior : Mode::kFirstLook;
  std::vector<double> gates, without;
  for (std::size_t i = 0; i < frames.truth.size(); ++i) {
    const FrameTruth& truth = frames.truth[i];
    const FrameMeasured& measured = frames.measured[bundle][i];
    if (truth.has_gate) gates.push_back(measured.modes[index_of(mode)].validity);
    if (empty == Empty::kPlaces) {
      if (truth.has_empty_place) without.push_back(measured.empty_validity);
    } else if (!truth.has_gate &&
               (empty == Empty::kNoValid || (empty == Empty::kLittle && truth.most_visible < kLittleVisible) ||
                (empty == Empty::kNothing && truth.most_visible <= 0.0))) {
      without.push_back(measured.modes[index_of(Mode::kFirstLook)].validity);
    }
  }
  if (positives != nullptr) *positives = static_cast<int>(gates.size());
  if (negatives != nullptr) *negatives = static_cast<int>(without.size());
  return roc_curve(gates, without);
}

std::vector<Candidate> candidates(const HeldOut& frames, std::size_t bundle, Mode mode) {
  std::vector<Candidate> out;
  for (std::size_t i = 0; i < frames.truth.size(); ++i) {
    const FrameTruth& truth = frames.truth[i];
    if (!truth.has_gate && (mode == Mode::kPrior || truth.most_visible > 0.0)) continue;
    const Measured& measured = frames.measured[bundle][i].modes[index_of(mode)];
    out.push_back({measured.validity, measured.predicted_m, truth.has_gate, measured.center_m, measured.other_gate});
  }
  return out;
}

Predictions predictions(const HeldOut& frames, std::size_t bundle, Mode mode) {
  Predictions out;
  for (const Measured* measured : select(frames, bundle, mode).measured) {
    if (!measured->encoded || !std::isfinite(measured->predicted_m)) continue;
    out.predicted_m.push_back(measured->predicted_m);
    out.actual_m.push_back(measured->box_m);
  }
  return out;
}

}  // namespace gatefield::training
