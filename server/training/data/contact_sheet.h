#pragma once

#include <filesystem>

#include "common/base/result.h"
#include "common/scene/sensor_noise.h"
#include "server/training/data/dataset.h"

namespace gatefield::training {

/// A picture of what is in a data set: `count` samples spread evenly over it, 4 pairs in a row; depth in colour (near
/// red, far blue, no return black), on the left without, on the right with noise; outlines of the frames: valid gates
/// white, the others grey. Errors: empty set, picture can't be written.
Status write_contact_sheet(const Dataset& dataset, int count, const scene::SensorNoise& noise,
                           const std::filesystem::path& png);

}  // namespace gatefield::training
