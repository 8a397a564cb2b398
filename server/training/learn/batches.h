#pragma once

#include <Eigen/Core>
#include <array>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "common/model/two_look.h"
#include "common/scene/sensor_noise.h"
#include "server/training/data/dataset.h"
#include "server/training/data/sampling.h"
#include "server/training/learn/designs.h"

/// Batches for the trainer: noise, mirror images, input tensors, crops, query points. No libtorch here.
namespace gatefield::training {

inline constexpr int kDepthTargetSize = 24;  ///< depth decoder's target of a crop
inline constexpr int kPlainDepthWidth = 20;  ///< depth decoder's target of a whole image (plain encoder)
inline constexpr int kPlainDepthHeight = 12;

struct BatchOptions {
  int images = 32;
  int crops_per_image = 2;
  int points = 96;
  Design design = designs().front();  ///< says which inputs are made
  scene::SensorNoise noise;           ///< of simulated images; its scale is drawn below
  double predicted_part = 0.32;       ///< of the crops: around what the first look says
  double predicted_part_empty = 0.7;  ///< the same in images without a gate
  double predicted_jitter_m = 0.15;   ///< sigma per axis for an image's second such crop and later ones, not the same
  double free_part = 0.20;            ///< around a point where no gate is
  double prior_sigma_min_m = 0.02;    ///< the rest: around a gate's centre + noise, sigma per axis log-uniform
  double prior_sigma_max_m = 0.45;
  double noise_scale_min = 0.5;  ///< sensor noise, uniform per image
  double noise_scale_max = 1.25;
  std::uint64_t seed = 1;
};

/// A gate is at the crop (validity 1, its field is learned) when its centre is at most this far from the crop's.
inline constexpr float kCropCaptureRadius_m = 0.9f;
/// Gates seen less than valid but at least this much are still learned from, at half weight; validity isn't asked
/// there.
inline constexpr float kDimVisibleFraction = 0.12f;

/// Everything one optimiser step needs, row-major and dense.
struct Batch {
  std::uint64_t step = 0;
  int images = 0;
  int crops = 0;
  int points = 0;

  std::vector<float> image;       ///< plain: [B][2][H][W]
  std::vector<float> look_input;  ///< [B] first_look_input
  std::vector<float> anchors;
  std::vector<float> frame_mask;   ///< [B][anchor_h][anchor_w], 1 where the nearest valid gate's frame shows
  std::vector<float> look_target;  ///< [B][4]: centre of the nearest valid gate, weight

  std::vector<std::uint8_t> crop_predicted;  ///< [C] 1: waits for cut_predicted_crops()
  std::vector<float> crop_input;             ///< [C] crop_input
  std::vector<float> crop_context;
  std::vector<float> crop_center;  ///< [C][3]
  // What a crop (plain: an image) is trained towards, in the camera frame.
  std::vector<float> target_center;              ///< [C][3] m
  std::vector<float> target_normal;              ///< [C][6] n n^T: xx yy zz xy xz yz
  std::vector<float> target_weight;              ///< [C] of all losses on the gate, 1 / distance; 0: there is none
  std::vector<float> validity, validity_weight;  ///< [C] 1: a gate is seen; 0 in the weight: it isn't asked
  std::vector<float> points_C, sdf_m;            ///< [C][N][3], [C][N]
  std::vector<float> clean_depth, clean_weight;  ///< depth decoder's target and where it counts

  // For cut_crop(): the images as drawn (mirrored ones mirrored).
  std::vector<float> noisy_m, clean_m;  ///< [B][H][W]
  std::vector<std::array<GateLabel, kMaxGates>> gates;
  std::vector<int> gate_count;
  std::vector<std::uint8_t> has_clean;  ///< [B] 0: nobody knows the true depth (recordings)
};

/// Where images come from, and which part of them (relative to the sum over all sources).
struct Source {
  const Dataset* dataset = nullptr;  ///< nullptr: rendered when they are needed, each one new
  double part = 1.0;
  std::uint64_t seed = 1;   ///< of the rendered ones
  double round_part = 0.0;  ///< of their gates
};

/// Makes batch `step`: a function of (sources, options, step) alone, whichever thread computes it.
/// @pre at least one source, none empty
/// Thread-safe: yes.
void make_batch(std::span<const Source> sources, const BatchOptions& options, std::uint64_t step, Batch* batch);

/// Fills crop `index` (of image index / crops_per_image) around center_C, with its targets and query points.
/// A centre behind or right at the camera is moved to the least depth that can be cropped.
void cut_crop(const BatchOptions& options, int index, Eigen::Vector3d center_C, Batch* batch);

/// Fills those crops of an image that wait for what the first look says: the first one there, the others near by.
void cut_predicted_crops(const BatchOptions& options, int image, const Eigen::Vector3d& center_C, Batch* batch);

/// Makes batches ahead of time in threads of its own and hands them out in order.
/// Thread-safe: next() from one thread.
class BatchQueue {
 public:
  BatchQueue(std::vector<Source> sources, const BatchOptions& options, std::uint64_t first_step, int threads,
             int ahead = 6);
  ~BatchQueue();
  BatchQueue(const BatchQueue&) = delete;
  BatchQueue& operator=(const BatchQueue&) = delete;

  /// The next batch in order; waits for it. Give the previous one back to have its memory reused.
  std::unique_ptr<Batch> next();
  void recycle(std::unique_ptr<Batch> batch);

 private:
  void work();

  const std::vector<Source> sources_;
  const BatchOptions options_;
  const std::uint64_t ahead_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t next_to_make_;
  std::uint64_t next_to_give_;
  bool stop_ = false;
  std::map<std::uint64_t, std::unique_ptr<Batch>> ready_;
  std::vector<std::unique_ptr<Batch>> spare_;
  std::vector<std::thread> threads_;
};

}  // namespace gatefield::training
