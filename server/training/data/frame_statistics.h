#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "server/training/data/flat_windows.h"

/// What plain depth frames say of a sensor without anybody knowing the truth. Disparities d = focal baseline / z and
/// lengths are in the sensor's own pixels, whatever the frames were decimated to.
namespace gatefield::training {

inline constexpr std::array kJumps_px{0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0};  ///< limits of bins
inline constexpr std::size_t kJumpBins = kJumps_px.size() - 1;

struct FrameStatistics {
  std::size_t frames = 0;
  std::array<FlatMoments, kBins> flat;
  std::vector<double> gain;  ///< [frame with enough windows] its errors over those of all frames at the same distances

  double lost = 0.0;         ///< part of the pixels without depth
  double lost_left = 0.0;    ///< of these, in the left band
  double lost_inside = 0.0;  ///< in holes whose surroundings span less than 2 px
  double lost_large = 0.0;   ///< part of the lost pixels outside the band in holes larger than 20 px at 160 wide
  double lost_single = 0.0;  ///< in holes of one pixel at 160 wide, about
  double beyond = 0.0;       ///< part of the pixels beyond the camera's range
  double islands = 0.0;      ///< part of the pixels that differ from all their neighbours by more than 5 px
  double rows_lost = 0.0;    ///< part of the rows without any depth, next to rows with

  double band_px = 0.0, band_sigma_px = 0.0;  ///< first measured column less the disparity there; median, spread
  double band_rows_px = 0.0;                  ///< rows over which that is alike (correlation above a half)
  std::array<double, kJumpBins> jump_n{}, jump_holes{};  ///< jumps (vertical ones, and near to far along a row)
  std::vector<double> gap_px;                            ///< holes from near to far along a row: right of things
  std::vector<double> above_px;                          ///< holes along columns
  std::vector<double> shadow_px;                         ///< holes from far to near along a row, less the jump
  std::vector<double> inside_area_px2;                   ///< of holes inside of surfaces
  double slant = 0.0;                                    ///< mean (1 - cos)^3 of the surfaces that are seen
};

/// @param frames  z-depth in metres of geometry.camera's size, not cut to its range
/// Thread-safe: yes.   Real-time safe: no.
FrameStatistics measure_frames(const SensorGeometry& geometry, const std::vector<std::vector<float>>& frames);

}  // namespace gatefield::training
