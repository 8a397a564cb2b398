#include "server/training/evaluation/held_out.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/training/evaluation/parallel.h"

namespace gatefield::training {
namespace {

/// A place counts as empty when no gate is nearer; nearer ones can be found by looking again around a corrected centre.
constexpr double kEmptyRadius_m = 2.0;

/// A place on something in view, or in the open, that is far from every gate.
std::optional<Eigen::Vector3d> draw_empty_place(const SampleView& sample, std::span<const float> image_m,
                                                Random* random) {
  const int u = static_cast<int>(random->below(kImageWidth_px));
  const int v = static_cast<int>(random->below(kImageHeight_px));
  const double seen_m = image_m[static_cast<std::size_t>(v * kImageWidth_px + u)];
  const Eigen::Vector3d place_C = dataset_camera().ray_C(u, v) * (seen_m > 0.5 ? seen_m : random->uniform(1.0, 8.0));
  const bool clear =
      std::all_of(sample.gates.begin(), sample.gates.begin() + sample.gate_count,
                  [&](const GateLabel& gate) { return (gate.p_CG.cast<double>() - place_C).norm() > kEmptyRadius_m; });
  return clear ? std::optional(place_C) : std::nullopt;
}

}  // namespace

GateFacts facts_of(const GateLabel& gate, int in_view) {
  GateFacts facts;
  facts.distance_m = gate.p_CG.norm();
  const float cosine = std::abs((gate.q_CG * Eigen::Vector3f::UnitX()).dot(gate.p_CG.normalized()));
  facts.axis_deg = std::acos(std::min(1.0f, cosine)) * 180.0 / std::numbers::pi;
  facts.visible_fraction = gate.visible_fraction;
  facts.in_view = in_view;
  return facts;
}

std::optional<HeldOut> measure_held_out(const Dataset& dataset, const HeldOutOptions& options,
                                        std::vector<Observers>* threads,
                                        const std::function<bool(std::uint64_t)>& progress) {
  const std::size_t bundles = threads->front().size();
  HeldOut out;
  out.truth.resize(options.count);
  out.measured.assign(bundles, std::vector<FrameMeasured>(options.count));
  scene::SensorNoise noise;
  noise.scale = options.noise_scale;

  const auto work = [&](int thread, std::uint64_t index) {
    const SampleView sample = dataset.at(index);
    Random random(options.seed, index);
    std::vector<float> image(kImageSize_px);
    draw_noisy(sample, noise, &random, image);
    FrameTruth& truth = out.truth[index];
    for (int i = 0; i < sample.gate_count; ++i) {
      truth.most_visible =
          std::max<double>(truth.most_visible, sample.gates[static_cast<std::size_t>(i)].visible_fraction);
    }
    const auto empty_C = draw_empty_place(sample, image, &random);
    truth.has_empty_place = empty_C.has_value();
    const GateLabel* gate = sample.target();
    QueryPoints points;
    Eigen::Vector3d prior_C = Eigen::Vector3d::Zero();
    if (gate != nullptr) {
      points = draw_points(*gate, &random);
      prior_C = gate->p_CG.cast<double>();
      for (int axis = 0; axis < 3; ++axis) prior_C[axis] += options.prior_sigma_m * random.normal();
      truth.has_gate = true;
      truth.gate = facts_of(*gate, sample.valid_count);
      truth.center_C = gate->p_CG;
      truth.axis_C = gate->q_CG * Eigen::Vector3f::UnitX();
      truth.prior_m = (prior_C - gate->p_CG.cast<double>()).norm();
      truth.mix_m = points.mix_m;
      truth.box_m = points.box_m;
      truth.near_n = points.near_n;
    }
    for (std::size_t bundle = 0; bundle < bundles; ++bundle) {
      Observer& observer = *(*threads)[static_cast<std::size_t>(thread)][bundle];
      FrameMeasured& measured = out.measured[bundle][index];
      if (empty_C) {
        const auto encoding = observer.encode(image, empty_C);
        measured.empty_validity = encoding ? encoding->validity : 0.0;
      }
      if (gate != nullptr) {
        for (const Mode mode : kModes)
          measured.modes[index_of(mode)] = observer.measure(image, sample, *gate, points, mode, prior_C);
      } else if (const auto encoding = observer.encode(image, std::nullopt); encoding.has_value()) {
        Measured& first = measured.modes[index_of(Mode::kFirstLook)];
        first.encoded = true;
        first.validity = encoding->validity;
        first.predicted_m = encoding->predicted_error_m;
      }
    }
  };
  if (!for_each_index(options.count, static_cast<int>(threads->size()), work, progress)) return std::nullopt;
  return out;
}

}  // namespace gatefield::training
