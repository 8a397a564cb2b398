#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/sensor_noise.h"
#include "server/training/data/depth_frames.h"
#include "server/training/data/frame_statistics.h"
#include "server/training/data/noise_fit.h"

namespace gatefield::training {

struct PlainFitOptions {
  double decimation = 1.0;   ///< the sensor's own images are this much finer than the frames
  double baseline_m = 0.05;  ///< of the sensor; depth alone does not tell it
};

/// scene::ActiveStereoNoise fitted to frames of which nobody knows the truth.
struct PlainFit {
  scene::SensorNoise noise;                 ///< with active_stereo
  std::vector<FittedParameter> parameters;  ///< in the order of active_stereo_fields(), then the clouds
  FrameStatistics recorded;
  FrameStatistics drawn;  ///< the fitted noise over estimate_surfaces() of the same frames
};

/// - clouds, white, both radii: the moments of flat windows (flat_windows.h) as a sum of what white noise and two
///   fields of unit variance have there, each measured on drawn fields; least squares with no negative part, in relative
///   errors, by distance; the pair of radii that explains all distances best. Gains: spread of the frames around that.
/// - step: the largest number that 1 / z of most pixels is a multiple of
/// - edges: how often jumps have holes, by their height, against a logistic curve; widths, band and shadow: medians and
///   spreads
/// - patches: holes inside of surfaces, laid to surfaces that reflect 55 %; speckle: pixels unlike all their neighbours
/// What single frames can't tell keeps its default and says so: depth scale, fattening, blur by the matcher, readout,
/// baseline. Errors: images that can't be read; fewer than 3 frames; too few flat windows.
/// Thread-safe: yes.   Real-time safe: no.
Result<PlainFit> fit_plain(const DepthFrames& frames, const PlainFitOptions& options);

/// Recorded and drawn side by side, in Markdown.
std::string to_markdown(const PlainFit& fit);
/// As a table for people: each parameter and where it comes from.
std::string to_text(const PlainFit& fit);

}  // namespace gatefield::training
