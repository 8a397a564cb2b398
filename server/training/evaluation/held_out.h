#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "server/training/data/dataset.h"
#include "server/training/evaluation/frame.h"
#include "server/training/evaluation/observer.h"

namespace gatefield::training {

/// One thread's observers, one for every bundle.
using Observers = std::vector<std::unique_ptr<Observer>>;

struct HeldOutOptions {
  std::uint64_t count = 0;  ///< images, from the first on
  double prior_sigma_m = 0.1;
  double noise_scale = 1.0;
  std::uint64_t seed = 99;
};

/// What every bundle makes of the images of a data set.
struct HeldOut {
  std::vector<FrameTruth> truth;                     ///< [image]
  std::vector<std::vector<FrameMeasured>> measured;  ///< [bundle][image]
};

/// @param threads one set of observers a thread; the result doesn't depend on how many there are
/// @return empty when `progress` (called with the images done) returned false
std::optional<HeldOut> measure_held_out(const Dataset& dataset, const HeldOutOptions& options,
                                        std::vector<Observers>* threads,
                                        const std::function<bool(std::uint64_t)>& progress);

/// Where a labelled gate stands as seen from the camera.
GateFacts facts_of(const GateLabel& gate, int in_view);

}  // namespace gatefield::training
