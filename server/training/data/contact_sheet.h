#pragma once

#include <filesystem>

#include "common/base/result.h"
#include "common/scene/sensor_noise.h"
#include "server/training/data/dataset.h"

namespace gatefield::training {

/// A picture of what is in a data set: `count` samples spread evenly over it, 4 pairs in a row; depth in colour (near
/// red, far blue, no return black). On the left the depth that labels are judged by (clean, in recordings measured)
/// with the gates' edges drawn in: valid gates white, the target's middle dotted, gates that count as not seen grey,
/// edges behind something else dashed, the part in view as a number. On the right what a network gets: in simulation
/// the left with `noise`, otherwise the measured image. Errors: empty set, picture can't be written.
Status write_contact_sheet(const Dataset& dataset, int count, const scene::SensorNoise& noise,
                           const std::filesystem::path& png);

}  // namespace gatefield::training
