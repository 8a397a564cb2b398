#pragma once

#include <span>

#include "common/scene/depth_camera.h"

namespace gatefield::simulator {

/// What a matching depth camera makes of an exposure during which it moved, from what it would have seen at moments of
/// it. A pixel has the median of its depths, and the surface of that moment: the surface that most of the light came
/// from. Where fewer than 70 % of the moments agree with it, nothing is matched and nothing returned. Two depths agree
/// when their disparities differ by less than 0.6 px at 160 px of width: at steps of that size half of the pixels of a
/// real sensor are lost (docs/hard-world.md). No return counts as a disparity of 0.
/// @param moments   an odd number of images of one size, with their surfaces; one of them is returned as it is
/// @param focal_px, baseline_m  of the sensor
/// Thread-safe: yes.   Real-time safe: no (allocates when the output has another size).
void merge_exposure(std::span<const scene::DepthImage> moments, std::span<const scene::SurfaceImage> surfaces,
                    double focal_px, double baseline_m, scene::DepthImage* depth, scene::SurfaceImage* surface);

}  // namespace gatefield::simulator
