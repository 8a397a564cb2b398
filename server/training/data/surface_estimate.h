#pragma once

#include <span>
#include <vector>

#include "server/training/data/flat_windows.h"

namespace gatefield::training {

/// What a frame without a known truth most likely shows: holes are filled with what is far beside them, and the
/// disparity is averaged over what belongs to the same surface (within 1 px of the sensor's, 24 px around), which takes
/// the small errors out and leaves those wider than that. For drawing noise over surfaces as they are in reality.
/// @param depth_m  z-depth, 0 = no return   @return the same size, 0 only where a row has nothing at all
/// Thread-safe: yes.   Real-time safe: no.
std::vector<float> estimate_surfaces(const SensorGeometry& geometry, const std::vector<float>& depth_m);

/// Cosine of the angle of incidence on what a pixel shows, from the slopes of the disparity across cosine_reach()
/// pixels to each side; NaN where something is missing there or jumps. @pre the pixel is that far from the image's edge
double cosine_at(const SensorGeometry& geometry, std::span<const float> d_px, int u, int v);
int cosine_reach(const SensorGeometry& geometry);
/// The same for every pixel of a depth image; 1 where it is not known.
std::vector<float> surface_cosines(const SensorGeometry& geometry, const std::vector<float>& depth_m);

/// Holes alone. Disparities or depths: the far side is the larger depth.
std::vector<float> fill_holes(const std::vector<float>& depth_m, int width_px);

}  // namespace gatefield::training
