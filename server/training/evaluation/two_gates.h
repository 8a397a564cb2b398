#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "server/training/evaluation/held_out.h"

namespace gatefield::training {

/// Two gates in view at nearly the same distance, and a prior that names one of them: which one does the field show?
struct TwoGatesOptions {
  int count = 400;                 ///< images
  double difference_m = 0.3;       ///< their distances differ by less
  double prior_sigma_m = 0.15;     ///< of the prior, per axis
  std::uint64_t seed = 1'000'007;  ///< of worlds that no training and no held-out set has
};

struct TwoGatesResult {
  int count = 0;
  /// With the prior: the fitted centre is within kWrongGate_m of the named gate and nearer to it than to the other one;
  /// the same with the other; neither.
  int named = 0, other = 0, neither = 0;
  int first_one = 0;  ///< without a prior, the first look: within kWrongGate_m of one of the two
  double center_median_m = 0.0, center_p90_m = 0.0;  ///< with the prior, to the named gate

  double named_percent() const noexcept { return count > 0 ? 100.0 * named / count : 0.0; }
  double first_one_percent() const noexcept { return count > 0 ? 100.0 * first_one / count : 0.0; }
};

/// Draws worlds as for training until enough of them show two valid gates like that (about one in a hundred does).
/// @param progress called with the images found and measured; false stops
/// @return one result for each bundle; empty when stopped
std::optional<std::vector<TwoGatesResult>> measure_two_gates(const TwoGatesOptions& options,
                                                             std::vector<Observers>* threads,
                                                             const std::function<bool(std::uint64_t)>& progress);

}  // namespace gatefield::training
