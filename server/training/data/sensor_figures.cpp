#include "server/training/data/sensor_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/training/data/true_depth.h"

namespace gatefield::training {
namespace {

constexpr double kBaseline_m = 0.05;
constexpr double kWrong_px = 0.3;
constexpr float kReflectance = 0.55f;

struct Sums {
  double pixels = 0, measured = 0, gate = 0, gate_measured = 0, gate_error = 0, gate_square = 0, gate_wrong = 0,
         inside = 0, error = 0, square = 0, right = 0, wrong = 0;
  double edge = 0, edge_measured = 0, edge_wrong = 0, pairs = 0, product = 0;
};
using Table = std::array<Sums, kDepths_m.size()>;

void add(const TrueDepth& truth, const std::vector<std::uint8_t>& gate, std::span<const float> measured_m,
         Table* table) {
  const double scale_m_px = dataset_camera().fx_px * kBaseline_m;
  std::vector<float> error_px(kImageSize_px, NAN);  // of what counts as right
  for (std::size_t i = 0; i < kImageSize_px; ++i) {
    const auto z_m = static_cast<double>(truth.z_m[i]);
    if (z_m <= 0.0) continue;
    std::size_t bin = 1;
    while (bin + 1 < kDepths_m.size() && z_m >= kDepths_m[bin]) ++bin;
    const bool there = measured_m[i] > 0.0f;
    const double off_px = there ? scale_m_px / static_cast<double>(measured_m[i]) - scale_m_px / z_m : 0.0;
    const bool wrong = std::abs(off_px) > kWrong_px;
    if (truth.inside[i] != 0 && truth.shadow[i] == 0 && there && !wrong) error_px[i] = static_cast<float>(off_px);
    for (const std::size_t b : {std::size_t{0}, bin}) {
      Sums& s = (*table)[b];
      s.pixels += 1.0;
      s.measured += there ? 1.0 : 0.0;
      if (gate[i] != 0) {
        s.gate += 1.0;
        s.gate_measured += there ? 1.0 : 0.0;
        if (wrong) {
          s.gate_wrong += 1.0;
        } else if (there) {
          s.gate_error += off_px;
          s.gate_square += off_px * off_px;
        }
      }
      if (truth.edge[i] != 0) {
        s.edge += 1.0;
        s.edge_measured += there ? 1.0 : 0.0;
        s.edge_wrong += wrong ? 1.0 : 0.0;
      }
      if (truth.inside[i] == 0 || truth.shadow[i] != 0 || !there) continue;
      s.inside += 1.0;
      if (wrong) {
        s.wrong += 1.0;
      } else {
        s.right += 1.0;
        s.error += off_px;
        s.square += off_px * off_px;
        if (i % kImageWidth_px > 0 && !std::isnan(error_px[i - 1])) {
          s.pairs += 1.0;
          s.product += off_px * static_cast<double>(error_px[i - 1]);
        }
      }
    }
  }
}

SensorFigures figures(const Sums& s) {
  const auto ratio = [](double part, double whole) { return whole > 0.0 ? part / whole : 0.0; };
  SensorFigures f;
  f.pixels = s.pixels;
  f.fill = ratio(s.measured, s.pixels);
  f.fill_gate = ratio(s.gate_measured, s.gate);
  const double gate_right = s.gate_measured - s.gate_wrong;
  f.gate_bias_px = ratio(s.gate_error, gate_right);
  f.gate_sigma_px = std::sqrt(std::max(ratio(s.gate_square, gate_right) - f.gate_bias_px * f.gate_bias_px, 0.0));
  f.gate_wrong = ratio(s.gate_wrong, s.gate_measured);
  f.bias_px = ratio(s.error, s.right);
  const double variance = std::max(ratio(s.square, s.right) - f.bias_px * f.bias_px, 0.0);
  f.sigma_px = std::sqrt(variance);
  f.wrong = ratio(s.wrong, s.inside);
  f.edge_fill = ratio(s.edge_measured, s.edge);
  f.edge_wrong = ratio(s.edge_wrong, s.edge_measured);
  f.neighbour = variance > 0.0 ? (ratio(s.product, s.pairs) - f.bias_px * f.bias_px) / variance : 0.0;
  return f;
}

}  // namespace

Result<SensorComparison> compare_sensors(const Dataset& dataset, const scene::SensorNoise& noise,
                                         std::uint64_t max_frames) {
  if (dataset.size() == 0) return Error{"the data set is empty"};
  if (dataset.at(0).measured_mm.empty() || dataset.at(0).clean_mm.empty()) {
    return Error{"a data set of kind '" + std::string(name(dataset.kind())) +
                 "' lacks measured or true depth, expected 'stereo'"};
  }
  SensorComparison comparison;
  comparison.frames = std::min(dataset.size(), std::max<std::uint64_t>(max_frames, 1));
  Table measured;
  Table model;
  TrueDepth truth;
  scene::DepthImage clean{kImageWidth_px, kImageHeight_px, std::vector<float>(kImageSize_px)};
  scene::DepthImage noisy;
  scene::SurfaceImage surface;
  std::vector<float> measured_m(kImageSize_px);
  std::vector<std::uint8_t> gate(kImageSize_px);
  std::vector<std::uint8_t> one(kImageSize_px);
  Random random(dataset.seed(), 17);
  for (std::uint64_t k = 0; k < comparison.frames; ++k) {
    const SampleView sample = dataset.at(k * dataset.size() / comparison.frames);
    draw_clean(sample, clean.depth_m);
    examine(dataset_camera(), kBaseline_m, clean.depth_m, &truth);
    std::fill(gate.begin(), gate.end(), std::uint8_t{0});
    for (int g = 0; g < sample.valid_count; ++g) {
      frame_mask(sample, sample.gates[static_cast<std::size_t>(g)], one);
      for (std::size_t i = 0; i < kImageSize_px; ++i) gate[i] = static_cast<std::uint8_t>(gate[i] | one[i]);
    }
    for (std::size_t i = 0; i < kImageSize_px; ++i) {
      measured_m[i] = 0.001f * static_cast<float>(sample.measured_mm[i]);
    }
    add(truth, gate, measured_m, &measured);
    surface.cos_incidence = truth.cosine;
    surface.reflectance.assign(kImageSize_px, kReflectance);
    scene::apply_noise(noise, dataset_camera(), clean, surface, &random, &noisy);
    add(truth, gate, noisy.depth_m, &model);
  }
  std::transform(measured.begin(), measured.end(), comparison.measured.begin(), figures);
  std::transform(model.begin(), model.end(), comparison.model.begin(), figures);
  return comparison;
}

std::string to_text(const SensorComparison& comparison) {
  std::string out =
      "| true depth, m | sensor | measured, % | bias, px | sigma, px (m) | wrong, % | neighbours | edges: measured, "
      "wrong, "
      "% | gates: measured, % | bias, px | sigma, px | wrong, % |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  const double scale_m_px = dataset_camera().fx_px * kBaseline_m;
  for (std::size_t bin = 0; bin < kDepths_m.size(); ++bin) {
    for (const bool measured : {true, false}) {
      const SensorFigures& f = (measured ? comparison.measured : comparison.model)[bin];
      std::string depth = "all";
      std::string sigma_m;
      if (bin > 0) {
        depth = fmt::format("{:.3g} to {:.3g}", kDepths_m[bin - 1], kDepths_m[bin]);
        const double middle_m = 0.5 * (kDepths_m[bin - 1] + kDepths_m[bin]);
        sigma_m = fmt::format(" ({:.3f})", f.sigma_px * middle_m * middle_m / scale_m_px);
      }
      out += fmt::format(
          "| {} | {} | {:.1f} | {:+.3f} | {:.3f}{} | {:.2f} | {:.2f} | {:.0f}, {:.0f} | {:.1f} | {:+.3f} | {:.3f} | "
          "{:.1f} |\n",
          depth, measured ? "measured" : "model", 100.0 * f.fill, f.bias_px, f.sigma_px, sigma_m, 100.0 * f.wrong,
          f.neighbour, 100.0 * f.edge_fill, 100.0 * f.edge_wrong, 100.0 * f.fill_gate, f.gate_bias_px, f.gate_sigma_px,
          100.0 * f.gate_wrong);
    }
  }
  return out;
}

}  // namespace gatefield::training
