#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/base/random.h"
#include "common/base/result.h"
#include "common/geometry/camera.h"
#include "common/geometry/gate.h"
#include "common/scene/depth_camera.h"
#include "common/scene/sensor_noise.h"

/// What the networks are trained on: rendered depth images of gates among clutter, with the true gate poses.
/// Nothing here includes libtorch.
namespace gatefield::training {

inline constexpr int kImageWidth_px = 160;
inline constexpr int kImageHeight_px = 90;
inline constexpr int kImageSize_px = kImageWidth_px * kImageHeight_px;
inline constexpr int kMaxGates = 4;
/// A gate counts as seen (valid) when at least this part of its frame's midline shows in the clean image.
inline constexpr float kValidVisibleFraction = 0.25f;

/// A true gate of a sample. Frame C is the camera's (optical), G the gate's (x through the opening).
struct GateLabel {
  Eigen::Vector3f p_CG = Eigen::Vector3f::Zero();            ///< centre of the opening, metres
  Eigen::Quaternionf q_CG = Eigen::Quaternionf::Identity();  ///< gate's axes in the camera frame
  float visible_fraction = 0.0f;                             ///< see visible_fraction()
  GateShape shape;

  bool valid() const noexcept { return visible_fraction >= kValidVisibleFraction; }
  Eigen::Isometry3f X_CG() const noexcept {
    Eigen::Isometry3f X = Eigen::Isometry3f::Identity();
    X.linear() = q_CG.toRotationMatrix();
    X.translation() = p_CG;
    return X;
  }
};

/// One image as it lies in memory or in a mapped file; copying it copies no pixels. Pixels are row-major, kImageSize_px
/// of them.
struct SampleView {
  std::span<const std::uint16_t> clean_mm;  ///< z-depth without noise in millimetres, 0 = no return
  std::span<const std::uint8_t> surface;    ///< high 4 bits: cosine of incidence * 15, low 4 bits: reflectance * 15
  std::array<GateLabel, kMaxGates> gates;   ///< valid ones first, nearest first within each kind
  int gate_count = 0;                       ///< gates of the right size that exist in the world, in view or not
  int valid_count = 0;                      ///< of these, how many are valid: gates[0 .. valid_count - 1]

  /// The nearest valid gate, or nullptr when none is in view.
  const GateLabel* target() const noexcept { return valid_count > 0 ? &gates[0] : nullptr; }
};

/// A sample that owns its pixels.
struct Sample {
  std::vector<std::uint16_t> clean_mm;
  std::vector<std::uint8_t> surface;
  std::array<GateLabel, kMaxGates> gates;
  int gate_count = 0;
  int valid_count = 0;

  SampleView view() const noexcept { return {clean_mm, surface, gates, gate_count, valid_count}; }
};

/// The camera of every sample: default_camera().
const CameraModel& dataset_camera();

/// Makes sample `index` of the set named by `seed`, from (seed, index) alone: poses all over the approach volume of a
/// target gate (0.4 to 10 m, up to 80 deg off its axis from either side, attitudes as in racing), one to four gates,
/// clutter; about a fifth of the samples show no valid gate. Thread-safe:
/// yes.   Real-time safe: no.
Sample generate(std::uint64_t seed, std::uint64_t index);

/// The part of 64 points on the frame's midline (half-way between inner and outer edge, x = 0) that the image shows:
/// inside the image and the depth range, with the image's depth within 0.15 m of the point's.
/// @param clean_mm row-major depth of `camera`, millimetres
float visible_fraction(const CameraModel& camera, std::span<const std::uint16_t> clean_mm, const GateShape& shape,
                       const Eigen::Isometry3f& X_CG);

/// Marks the pixels that show the gate's frame: mask[i] = 1 when the clean pixel's point lies in the frame's solid
/// grown by 0.03 m, else 0. For segmentation targets.
/// @pre mask.size() == kImageSize_px
/// Thread-safe: yes.
void frame_mask(const SampleView& sample, const GateLabel& gate, std::span<std::uint8_t> mask);

/// Draws the sensor's noise over a sample afresh.
/// @param noisy_m z-depth in metres, 0 = no return; kImageSize_px values
/// Thread-safe: yes (each thread with its own `random`).   Real-time safe: allocates on a thread's first call.
void draw_noisy(const SampleView& sample, const scene::SensorNoise& noise, Random* random, std::span<float> noisy_m);
/// The same without noise.
void draw_clean(const SampleView& sample, std::span<float> clean_m);

/// What generate_dataset() reports while it runs.
struct Progress {
  std::uint64_t done_n = 0;
  std::uint64_t total_n = 0;
  double rate_hz = 0.0;  ///< samples per second in this run
  double time_left_s = 0.0;
};

struct DatasetOptions {
  std::uint64_t seed = 1;
  std::uint64_t first_index = 0;  ///< record i of the file is generate(seed, first_index + i)
  std::uint64_t count = 250'000;
  int threads = 2;
};

/// Fills the file with `count` samples. A file that is there already and has the same seed, first index, format and
/// camera is continued where it stopped (a record cut short is written again); one that is long enough is left as it
/// is. `progress` is called from the calling thread after every 256 samples; it returns false to stop (the file stays
/// usable). Errors: folder or file can't be written, disk full, file of another kind or another set.
Status generate_dataset(const std::filesystem::path& file, const DatasetOptions& options,
                        const std::function<bool(const Progress&)>& progress = {});

/// Random access to such a file (memory-mapped; the kernel's page cache is the cache).
/// Thread-safe: yes (const).
class Dataset {
 public:
  /// Errors: file missing, truncated header, other format, version or camera. A file still being written can be opened:
  /// size() is the number of whole records at that moment.
  static Result<Dataset> open(const std::filesystem::path& file);
  ~Dataset();
  Dataset(Dataset&&) noexcept;
  Dataset& operator=(Dataset&&) noexcept;

  std::uint64_t size() const noexcept;
  std::uint64_t seed() const noexcept;
  std::uint64_t first_index() const noexcept;
  /// @pre index < size(). The view's spans live as long as this object.
  SampleView at(std::uint64_t index) const noexcept;

 private:
  struct Mapping;
  explicit Dataset(std::unique_ptr<Mapping> mapping) noexcept;
  std::unique_ptr<Mapping> mapping_;
};

}  // namespace gatefield::training
