#pragma once

#include <cstdint>
#include <vector>

#include "server/training/data/dataset.h"
#include "server/training/data/noise_fit.h"
#include "server/training/data/true_depth.h"

namespace gatefield::training {

inline constexpr float kFarthest_m = 9.0f;  ///< beyond, noise is cut off by the range's end
inline constexpr double kEnough = 2000.0;   ///< pixels that a parameter needs

/// The frames of a recording that its noise is fitted to, evenly taken from it, each with what is true of it: the clean
/// image, or, of a static scene, what each pixel shows most of the time. Not for use outside of this folder.
/// Thread-safe: no.
class MeasuredFrames {
 public:
  /// @param dataset  outlives this object
  MeasuredFrames(const Dataset& dataset, const NoiseFitOptions& options);

  std::uint64_t count() const noexcept { return count_; }
  /// fx baseline: disparity in pixels times depth in metres.
  float scale_m_px() const noexcept { return scale_m_px_; }
  bool static_scene() const noexcept { return options_.static_scene; }

  /// Calls fun(const TrueDepth&, const std::vector<float>& measured_m) for each frame in turn.
  template <typename Fun>
  void for_each(const Fun& fun) {
    for (std::uint64_t i = 0; i < count_; ++i) {
      load(i);
      fun(truth_, measured_m_);
    }
  }

 private:
  SampleView sample_at(std::uint64_t i) const { return dataset_.at(i * dataset_.size() / count_); }
  void load(std::uint64_t i);
  void find_static_truth();

  const Dataset& dataset_;
  NoiseFitOptions options_;
  std::uint64_t count_ = 0;
  float scale_m_px_ = 0.0f;
  TrueDepth truth_;
  std::vector<float> clean_m_;
  std::vector<float> measured_m_;
};

}  // namespace gatefield::training
