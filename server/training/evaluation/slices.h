#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "server/training/data/dataset.h"
#include "server/training/evaluation/observer.h"

/// Pictures of what a field says, beside what is true.
namespace gatefield::training {

/// One gate under six kinds of occlusion and noise: for each the depth image with the true gate and the field in its
/// plane, and under it the field seen from above at the bottom, middle and top of the opening, with its zero line in
/// black and the true one in blue. From one image alone each, without a prior (but where another gate is nearer).
/// Errors: picture can't be written.
Status draw_occlusions(Observer* observer, std::uint64_t seed, const std::filesystem::path& png);

/// A bundle and what the picture calls it.
struct NamedObserver {
  std::string name;
  Observer* observer;
};
/// The same frames through several bundles: in a row the depth image, then for each bundle the field seen from above in
/// the middle of the opening. Frames are spread evenly over those of the set that show one valid gate, 1.5 to 6 m away,
/// half visible at least. Errors: no such frame, picture can't be written.
Status draw_side_by_side(const std::vector<NamedObserver>& observers, const Dataset& dataset, int frames,
                         std::uint64_t seed, const std::filesystem::path& png);

}  // namespace gatefield::training
