#include "server/training/data/measured_frames.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "common/base/statistics.h"

namespace gatefield::training {

MeasuredFrames::MeasuredFrames(const Dataset& dataset, const NoiseFitOptions& options)
    : dataset_(dataset),
      options_(options),
      count_(std::min(dataset.size(), std::max<std::uint64_t>(options.max_frames, 1))),
      scale_m_px_(static_cast<float>(dataset_camera().fx_px * options.baseline_m)) {
  clean_m_.resize(kImageSize_px);
  measured_m_.resize(kImageSize_px);
  if (options.static_scene) find_static_truth();
}

void MeasuredFrames::load(std::uint64_t i) {
  const SampleView sample = sample_at(i);
  if (!options_.static_scene) {
    draw_clean(sample, clean_m_);
    examine(dataset_camera(), options_.baseline_m, clean_m_, &truth_);
  }
  for (std::size_t k = 0; k < measured_m_.size(); ++k) {
    measured_m_[k] = 0.001f * static_cast<float>(sample.measured_mm[k]);
  }
}

/// Per pixel: mean inverse depth of what lies around the median; nothing when a pixel is there in less than a quarter
/// of the frames.
void MeasuredFrames::find_static_truth() {
  std::vector<float> z_m(kImageSize_px, 0.0f);
  std::vector<float> values;
  for (std::size_t k = 0; k < kImageSize_px; ++k) {
    values.clear();
    for (std::uint64_t i = 0; i < count_; ++i) {
      const std::uint16_t mm = sample_at(i).measured_mm[k];
      if (mm > 0) values.push_back(1000.0f / static_cast<float>(mm));
    }
    if (4 * values.size() < count_ || values.empty()) continue;
    const float median = quantile_in_place(std::span(values), 0.5);
    std::vector<float> away(values.size());
    std::transform(values.begin(), values.end(), away.begin(), [&](float v) { return std::abs(v - median); });
    const float limit = std::max(4.0f * 1.4826f * quantile_in_place(std::span(away), 0.5), 0.002f * median);
    double sum = 0.0;
    double n = 0.0;
    for (const float v : values) {
      if (std::abs(v - median) > limit) continue;
      sum += static_cast<double>(v);
      n += 1.0;
    }
    z_m[k] = static_cast<float>(n / sum);
  }
  examine(dataset_camera(), options_.baseline_m, z_m, &truth_);
}

}  // namespace gatefield::training
