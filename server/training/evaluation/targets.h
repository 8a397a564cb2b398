#pragma once

#include <string>

namespace gatefield::training {

/// What a model must reach to fly gates at 8 m/s and 60 deg of yaw: about 0.05 m and 3 deg.
/// Everything in one place; evaluation only compares.
struct DistanceBar {
  double from_m, to_m;
  double center_median_m, center_p90_m;
  double normal_median_deg;
  double box_m;
  double sign_percent;
};
inline constexpr DistanceBar kDistanceBars[] = {
    {1.0, 2.0, 0.03, 0.08, 2.0, 0.04, 95.0},
    {2.0, 4.0, 0.04, 0.12, 2.2, 0.045, 94.0},
    {4.0, 7.0, 0.08, 0.30, 3.5, 0.09, 88.0},
};
inline constexpr int kFewestImages = 2000;        ///< with a gate, for the bars above
inline constexpr double kHardFactor = 1.5;        ///< 60 to 80 deg, and half visible: at most this times the bars
inline constexpr double kHalfVisibleFrom = 0.25;  ///< half visible: this part of the midline ...
inline constexpr double kHalfVisibleTo = 0.75;    ///< ... to this
/// Along an approach, with the memory's prior: median centre error.
struct ApproachBar {
  double from_m, to_m, center_median_m;
};
inline constexpr ApproachBar kApproachBars[] = {{1.0, 2.0, 0.03}, {2.0, 4.0, 0.03}, {4.0, 7.0, 0.05}};
inline constexpr double kWrongGatePercent = 0.5;    ///< of what is let through, at most
inline constexpr double kLetThroughPercent = 80.0;  ///< of the frames with a gate, at least
inline constexpr double kNamedGatePercent = 99.0;   ///< two gates: the one that the prior names
inline constexpr double kKeptPart = 0.95;           ///< of the frames with a gate, kept ...
inline constexpr double kEmptyPercent = 95.0;       ///< ... while this part of those without is recognised
inline constexpr double kBetterThanStage1 = 0.8;    ///< second sensor: both stages at most this times stage 1's error
inline constexpr double kBetterThanStage2 = 0.6;    ///< and this times stage 2's
inline constexpr double kOtherSensorFactor = 1.3;   ///< and this times the error in simulation

/// One comparison of a figure with its bar.
struct Target {
  std::string what;   ///< "centre median, 1 to 2 m"
  std::string where;  ///< data set, mode
  int count = 0;      ///< frames, windows or flights that the figure is made of
  double value = 0.0;
  double bar = 0.0;
  bool at_most = true;  ///< false: at least
  int digits = 3;

  bool met() const noexcept { return count > 0 && (at_most ? value <= bar : value >= bar); }
};

}  // namespace gatefield::training
