#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/sensor_noise.h"

namespace gatefield::config {

class SensorNoiseSpec;

/// Says which field can't stand beside another: the measured model replaces all others but scale.
Status validate(const SensorNoiseSpec& spec);

/// What a person wrote; what is not set keeps its default.
scene::SensorNoise to_sensor_noise(const SensorNoiseSpec& spec);

/// Reads a file with the fields of SensorNoiseSpec (scenario.proto), e.g. 'disparity_noise_px: 0.04', as
/// `gatefield-train fit-noise` writes it. Errors: as load_text(), or the field that is out of range.
/// Thread-safe: yes.   Real-time safe: no.
Result<scene::SensorNoise> load_sensor_noise(const std::filesystem::path& file);

/// Writes such a file with all fields (of the model that is used); `remarks` are put before a field as comments ("" =
/// the file's head).
struct NoiseRemark {
  std::string field;
  std::string text;
};
Status save_sensor_noise(const std::filesystem::path& file, const scene::SensorNoise& noise,
                         const std::vector<NoiseRemark>& remarks = {});

}  // namespace gatefield::config
