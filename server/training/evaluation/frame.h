#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <vector>

namespace gatefield::training {

/// Errors that stand for "the field shows no gate".
inline constexpr double kFailedCenter_m = 10.0;
inline constexpr double kFailedNormal_deg = 90.0;

/// What tells the encoder where to look.
enum class Mode {
  kPrior,      ///< the true centre + noise, as the gate memory would
  kFirstLook,  ///< nothing: the nearest gate in view
};
inline constexpr std::array kModes{Mode::kPrior, Mode::kFirstLook};
inline constexpr std::size_t index_of(Mode mode) noexcept { return static_cast<std::size_t>(mode); }
const char* name_of(Mode mode) noexcept;

/// Where the gate that a frame is judged by stands.
struct GateFacts {
  double distance_m = 0.0;        ///< camera to the opening's centre
  double axis_deg = 0.0;          ///< between the gate's axis and the line of sight, 0 to 90
  double visible_fraction = 0.0;  ///< of the frame's midline
  int in_view = 1;                ///< valid gates in the image
};

/// The truth of one image, the same for every bundle.
struct FrameTruth {
  bool has_gate = false;      ///< a valid gate is in view; without one, only most_visible and has_empty_place count
  double most_visible = 0.0;  ///< of any gate's midline, valid or not
  GateFacts gate;
  Eigen::Vector3f center_C = Eigen::Vector3f::Zero();
  Eigen::Vector3f axis_C = Eigen::Vector3f::UnitX();
  double prior_m = 0.0;             ///< how far the prior is from the true centre
  bool has_empty_place = false;     ///< a place without a gate was looked at too
  std::vector<float> mix_m, box_m;  ///< true field at the query points
  std::size_t near_n = 0;           ///< the first so many of mix_m are near the surface
};

/// What one bundle makes of one image in one mode.
struct Measured {
  bool encoded = false;
  double validity = 0.0;
  double predicted_m = std::numeric_limits<double>::infinity();  ///< the network's own guess of its error
  // From here on only for frames with a gate. A frame that can't be encoded counts as a field of zeros.
  double all_m = 0.0;                 ///< mean |error| at the hybrid query points
  double near_m = 0.0;                ///< at those near the surface
  double box_m = 0.0;                 ///< in |x|, |y|, |z| < 1 m of the gate
  double sign_percent = 0.0;          ///< in the box
  bool fitted = false;                ///< the field shows a gate
  double center_m = kFailedCenter_m;  ///< centre fitted to the field alone
  double normal_deg = kFailedNormal_deg;
  double encoder_center_m = kFailedCenter_m;  ///< the centre that is part of the latent (two looks)
  bool other_gate = false;                    ///< the fitted centre is wrong and on another gate
  bool taken = false;                         ///< the gate memory takes this frame
};

/// What one bundle makes of one image.
struct FrameMeasured {
  std::array<Measured, 2> modes;  ///< [index_of(mode)]; without a gate in view only kFirstLook is there
  double empty_validity = 0.0;    ///< when looking at a place without a gate
};

}  // namespace gatefield::training
