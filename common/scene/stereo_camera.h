#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/random.h"
#include "common/base/result.h"
#include "common/scene/depth_camera.h"
#include "common/scene/world.h"

namespace gatefield::scene {

/// A passive stereo depth camera, built like the imagers of an Intel D435 and matched in software. Pixels are the
/// imagers', unless they are said to be the depth image's.
struct StereoOptions {
  // Imagers
  int upsampling = 3;         ///< imager pixels per pixel of the depth image, in each direction
  double baseline_m = 0.05;   ///< the right imager stands this far along +x of the left one, which is the camera's C
  int margin_px = 18;         ///< the imagers see so much more to the left than the depth image (87 -> 91 deg)
  double blur_px = 0.55;      ///< sigma of the lens
  double vignetting = 0.3;    ///< loss of light in the corners
  double white_e = 15000.0;   ///< electrons of a white surface under full ambient light in the longest exposure
  double read_noise_e = 8.0;  ///< electrons
  double gain_difference = 0.03;  ///< the right imager is so much brighter
  // What calibration left over: the right imager against what the matcher assumes
  double shift_x_px = 0.04;     ///< of the disparity: far things seem too near
  double shift_y_px = 0.06;     ///< rows
  double roll_rad = 0.0002;     ///< about the optical axis
  double focal_error = 0.0003;  ///< relative
  // Light
  double ambient = 0.7;  ///< of full ambient light; exposure and gain follow
  double lamp = 0.25;    ///< light beside the camera, at 1 m, relative to full ambient light; falls with the square
  double pattern = 2.5;  ///< projected dots, at 1 m, likewise; 0 = passive
  // Matching
  int block_px = 5;
  int uniqueness_percent = 8;  ///< the best match must be so much better than the second
  double texture = 1.8;        ///< matched only where the mean squared gradient is so many times that of noise alone
  int speckle_px = 90;         ///< smaller islands of depth are dropped
  int min_valid = 3;           ///< a depth pixel needs so many valid ones of its upsampling^2
};

/// Says which field is wrong and why.
Status validate(const StereoOptions& options);

/// What the imagers saw and what the matcher made of it, row-major.
struct StereoPictures {
  int width_px = 0;  ///< upsampling times the depth image's, without the margin
  int height_px = 0;
  std::vector<std::uint8_t> left;
  std::vector<std::uint8_t> right;
  std::vector<float> disparity_px;  ///< < 0 = none
};

/// A second depth sensor that owes nothing to apply_noise(): images of a textured world are ray-cast for two imagers,
/// get light, blur, photon and read noise and 8 bits, and OpenCV's semi-global matching (five directions, left-right
/// check, speckle filter; H. Hirschmueller, "Stereo processing by semiglobal matching and mutual information",
/// doi:10.1109/TPAMI.2007.1166) finds the disparity: mean of the matches around the median of each depth pixel's
/// block, moved to the best fit between pixels (Lucas, Kanade); z = fx baseline / disparity. Errors thus come from
/// where a real camera's come from: surfaces without texture, grazing light, borders of objects, few pixels of
/// disparity far away, an imperfect calibration. Left out: motion blur, rolling shutter, reflections, shadows of the
/// lamp.
/// Thread-safe: render() is const and may be called from several threads at once, each with its own `random`.
/// Real-time safe: no (allocates).
class StereoCamera {
 public:
  /// @param texture_seed names what the surfaces look like
  /// @pre validate(options).ok()
  StereoCamera(const World& world, const StereoOptions& options, std::uint64_t texture_seed);
  ~StereoCamera();
  StereoCamera(StereoCamera&&) noexcept;
  StereoCamera& operator=(StereoCamera&&) noexcept;

  /// What the sensor measures from X_WC: z-depth of `camera` (its size, focal lengths and range), 0 = none.
  /// The same stream gives the same image, whatever the number of threads. `pictures` may be null.
  void render(const CameraModel& camera, const Eigen::Isometry3d& X_WC, Random* random, DepthImage* measured,
              StereoPictures* pictures = nullptr) const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace gatefield::scene
