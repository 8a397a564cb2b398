#pragma once

#include <functional>
#include <vector>

#include "server/training/evaluation/calibration.h"
#include "server/training/evaluation/evaluate.h"
#include "server/training/evaluation/grouping.h"
#include "server/training/evaluation/roc.h"
#include "server/training/evaluation/wrong_gate.h"

/// Parts of an evaluation, as tables, charts and targets ask for them.
namespace gatefield::training {

struct Selected {
  std::vector<const FrameTruth*> truth;
  std::vector<const Measured*> measured;  ///< [i] of truth[i]
};
/// The frames with a gate for which `holds`.
Selected select(
    const HeldOut& frames, std::size_t bundle, Mode mode,
    const std::function<bool(const GateFacts&)>& holds = [](const GateFacts&) { return true; });

/// Which frames count as empty when validity is judged.
enum class Empty {
  kNothing,  ///< first look; not one point of any gate's midline shows
  kLittle,   ///< first look; less than 12 % of any: what training calls empty
  kNoValid,  ///< first look; no valid gate (less than 25 % of any)
  kPlaces,   ///< looking with a prior at a place at least 2 m from every gate
};
/// Against the frames with a valid gate, in the same mode.
std::vector<RocPoint> validity_curve(const HeldOut& frames, std::size_t bundle, Empty empty, int* positives = nullptr,
                                     int* negatives = nullptr);

/// Every frame as the two outputs judge it; with kFirstLook also those without any gate in view.
std::vector<Candidate> candidates(const HeldOut& frames, std::size_t bundle, Mode mode);

/// Predicted and actual box errors of the encoded frames with a gate.
struct Predictions {
  std::vector<double> predicted_m, actual_m;
};
Predictions predictions(const HeldOut& frames, std::size_t bundle, Mode mode);

}  // namespace gatefield::training
