#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "common/base/clock.h"
#include "server/training/data/scenes.h"
#include "server/training/evaluation/held_out.h"

namespace gatefield::training {

/// Flights toward one gate with the whole chain that the server runs (perception::Sight with its gate memory), vehicle
/// state known, waypoint off: how near is the centre, and how much of its error is bias, how much noise?
struct ApproachOptions {
  int count = 200;                  ///< flights
  double from_m = 8.0, to_m = 1.0;  ///< distance to the gate
  double nominal_m = 0.3;           ///< the waypoint is this far from the gate, in any direction
  std::uint64_t seed = 1'000'009;   ///< of worlds that no training and no held-out set has
};

/// One flight: a curve from anywhere within 60 deg of the gate's axis to about before it, at 5 to 9 m/s and 30 to 60
/// frames a second, with the attitude of a racing drone that keeps the gate about in view.
struct Approach {
  Scenario scenario;                    ///< gates[0] is approached
  std::vector<Eigen::Isometry3d> X_WC;  ///< camera poses at the frames
  std::vector<Stamp> stamps;            ///< of the frames
  Eigen::Vector3d nominal_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_W = Eigen::Vector3d::UnitX();  ///< the course's rough passing direction
};
/// The flight named by (seed, index): clear of everything by 0.2 m, and with the gate valid in three quarters of its
/// frames.
Approach draw_approach(const ApproachOptions& options, std::uint64_t index);

/// One frame of a flight. Errors are found minus true centre, in the gate's frame.
struct ApproachFrame {
  double distance_m = 0.0;
  bool valid = false;                       ///< at least kValidVisibleFraction of the gate shows
  std::optional<Eigen::Vector3d> frame_G;   ///< this frame's field alone, looked at where the memory said
  std::optional<Eigen::Vector3d> memory_G;  ///< the gate memory after this frame; empty before the first sight
};

/// What one bundle makes of all flights: [flight][frame].
using ApproachFlights = std::vector<std::vector<ApproachFrame>>;

/// @param progress called with the flights done; false stops
/// @return one for each bundle; empty when stopped
std::optional<std::vector<ApproachFlights>> measure_approaches(const ApproachOptions& options,
                                                               std::vector<Observers>* threads,
                                                               const std::function<bool(std::uint64_t)>& progress);

/// Frames with a valid gate, between two distances.
struct ApproachRow {
  double from_m = 0.0, to_m = 0.0;
  int count = 0;
  double frame_median_m = 0.0, frame_p90_m = 0.0;  ///< the single frame; one without a field counts as kFailedCenter_m
  double memory_median_m = 0.0, memory_p90_m = 0.0;  ///< the memory; before the first sight, the same
};
ApproachRow approach_row(const ApproachFlights& flights, double from_m, double to_m);

/// Where the mean square of the single frames' errors comes from, over windows of `window` frames in a row. The four
/// parts sum up to the whole (each estimated without the share of the noise below it).
struct BiasAndNoise {
  int window = 10;
  int windows = 0;   ///< whole windows of valid frames, none of them off by more than kWrongGate_m
  int left_out = 0;  ///< windows with a wrong or missing centre
  Eigen::Vector3d mean_G = Eigen::Vector3d::Zero();  ///< over everything
  double noise_m2 = 0.0;                             ///< frame to frame, within windows
  double window_m2 = 0.0;        ///< from window to window of a flight: bias that changes on the way
  double flight_m2 = 0.0;        ///< from flight to flight: bias of an approach
  double global_m2 = 0.0;        ///< common to all
  double bias_median_m = 0.0;    ///< length of a window's mean error
  double spread_median_m = 0.0;  ///< root mean square about that mean
  double single_median_m = 0.0;  ///< of the same frames

  double total_m2() const noexcept { return noise_m2 + window_m2 + flight_m2 + global_m2; }
};
BiasAndNoise bias_and_noise(const ApproachFlights& flights, int window);

}  // namespace gatefield::training
