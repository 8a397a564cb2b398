#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "common/base/result.h"
#include "common/scene/sensor_noise.h"
#include "server/training/data/dataset.h"

namespace gatefield::training {

/// A sensor beside the truth. Disparity at 160 px image width, d = fx 0.05 m / z; 'inside' is 3 px away from any edge.
struct SensorFigures {
  double pixels = 0.0;         ///< with true depth
  double fill = 0.0;           ///< how many of them are measured
  double fill_gate = 0.0;      ///< the same on the frames of valid gates
  double gate_bias_px = 0.0;   ///< mean error there, wrong matches left out
  double gate_sigma_px = 0.0;  ///< its standard deviation
  double gate_wrong = 0.0;     ///< errors beyond 0.3 px there, of the measured pixels
  double bias_px = 0.0;        ///< mean error inside, wrong matches left out
  double sigma_px = 0.0;       ///< its standard deviation
  double wrong = 0.0;          ///< errors beyond 0.3 px inside, of the measured pixels there
  double edge_fill = 0.0;      ///< measured, of the pixels at edges
  double edge_wrong = 0.0;     ///< errors beyond 0.3 px there, of the measured ones
  double neighbour = 0.0;      ///< correlation of the error between neighbours in a row, inside
};

/// By true depth: everything, then 0.3 to 1, 1 to 2, 2 to 4, 4 to 7, 7 to 10 m.
inline constexpr std::array<double, 6> kDepths_m = {0.3, 1.0, 2.0, 4.0, 7.0, 10.0};
struct SensorComparison {
  std::array<SensorFigures, kDepths_m.size()> measured;
  std::array<SensorFigures, kDepths_m.size()> model;  ///< apply_noise() over the same true images
  std::uint64_t frames = 0;
};

/// The set's sensor beside the noise model. The model gets the angle of incidence from the true depth and a reflectance
/// of 0.55 everywhere, as the set has none. Errors: no measured or no true depth.
/// Thread-safe: yes.   Real-time safe: no.
Result<SensorComparison> compare_sensors(const Dataset& dataset, const scene::SensorNoise& noise,
                                         std::uint64_t max_frames);

/// As a table in Markdown.
std::string to_text(const SensorComparison& comparison);

}  // namespace gatefield::training
