#include "server/training/evaluation/two_gates.h"

#include <algorithm>
#include <cmath>

#include "common/base/statistics.h"
#include "server/training/data/scenes.h"
#include "server/training/evaluation/parallel.h"
#include "server/training/evaluation/shot.h"
#include "server/training/evaluation/wrong_gate.h"

namespace gatefield::training {
namespace {

constexpr std::uint64_t kBlock = 512;          ///< worlds that are drawn at a time
constexpr std::uint64_t kMaxWorlds = 1 << 20;  ///< far more than are ever needed

struct Pair {
  std::uint64_t world = 0;
  std::size_t named = 0, other = 0;  ///< of the world's gates
};

/// A world, the camera in it, and all that was drawn for it so far.
struct Place {
  Random random;
  Scenario scenario;
};

Place place_of(const TwoGatesOptions& options, std::uint64_t world) {
  Random random(options.seed, world);
  Scenario scenario = draw_scenario(dataset_camera(), &random);
  return {random, std::move(scenario)};
}

Shot shot_of(Place* place) {
  return take_shot(scene::DepthCamera(place->scenario.world), place->scenario.world, place->scenario.gates,
                   place->scenario.X_WC, {}, &place->random);
}

/// The first two gates of a world that are as they should be; rendered only when they could be.
std::optional<Pair> pair_in(const TwoGatesOptions& options, std::uint64_t world) {
  Place place = place_of(options, world);
  const auto& gates = place.scenario.world.gates;
  const Eigen::Isometry3d X_CW = place.scenario.X_WC.inverse();
  const auto alike = [&](std::size_t a, std::size_t b) {
    const Eigen::Vector3d a_C = X_CW * gates[a].X_WG.translation();
    const Eigen::Vector3d b_C = X_CW * gates[b].X_WG.translation();
    return std::abs(a_C.norm() - b_C.norm()) < options.difference_m && a_C.z() > 0.0 && b_C.z() > 0.0;
  };
  bool possible = false;
  for (std::size_t a = 0; a < place.scenario.gates; ++a)
    for (std::size_t b = a + 1; b < place.scenario.gates; ++b) possible = possible || alike(a, b);
  if (!possible) return std::nullopt;
  const Shot shot = shot_of(&place);
  for (std::size_t a = 0; a < shot.gates.size(); ++a) {
    for (std::size_t b = a + 1; b < shot.gates.size(); ++b) {
      if (!alike(a, b) || !shot.gates[a].valid() || !shot.gates[b].valid()) continue;
      return place.random.chance(0.5) ? Pair{world, a, b} : Pair{world, b, a};
    }
  }
  return std::nullopt;
}

struct Seen {
  double named_m = kFailedCenter_m, other_m = kFailedCenter_m;  ///< the fitted centre's distance to them
  bool first_one = false;
};

}  // namespace

std::optional<std::vector<TwoGatesResult>> measure_two_gates(const TwoGatesOptions& options,
                                                             std::vector<Observers>* threads,
                                                             const std::function<bool(std::uint64_t)>& progress) {
  const int thread_n = static_cast<int>(threads->size());
  const std::size_t bundles = threads->front().size();
  const auto wanted = static_cast<std::size_t>(std::max(0, options.count));
  std::vector<Pair> pairs;
  for (std::uint64_t begin = 0; pairs.size() < wanted && begin < kMaxWorlds; begin += kBlock) {
    std::vector<std::optional<Pair>> found(kBlock);
    if (!for_each_index(
            kBlock, thread_n, [&](int, std::uint64_t i) { found[i] = pair_in(options, begin + i); },
            [&](std::uint64_t) { return progress(pairs.size() / 2); }))
      return std::nullopt;
    for (const auto& pair : found)
      if (pair && pairs.size() < wanted) pairs.push_back(*pair);
  }

  std::vector<std::vector<Seen>> seen(bundles, std::vector<Seen>(pairs.size()));
  const auto work = [&](int thread, std::uint64_t index) {
    const Pair& pair = pairs[index];
    Place place = place_of(options, pair.world);
    const Shot shot = shot_of(&place);
    const GateLabel& named = shot.gates[pair.named];
    const GateLabel& other = shot.gates[pair.other];
    Eigen::Vector3d prior_C = named.p_CG.cast<double>();
    for (int axis = 0; axis < 3; ++axis) prior_C[axis] += options.prior_sigma_m * place.random.normal();
    for (std::size_t bundle = 0; bundle < bundles; ++bundle) {
      Observer& observer = *(*threads)[static_cast<std::size_t>(thread)][bundle];
      Seen& out = seen[bundle][index];
      const auto center = [&](const std::optional<Eigen::Vector3d>& prior) -> std::optional<Eigen::Vector3d> {
        const auto encoding = observer.encode(shot.noisy_m, prior);
        if (!encoding) return std::nullopt;
        const auto pose = observer.fit(*encoding, named.shape, prior_C);
        return pose ? std::optional(pose->center_C) : std::nullopt;
      };
      if (const auto at_C = center(prior_C); at_C.has_value()) {
        out.named_m = (*at_C - named.p_CG.cast<double>()).norm();
        out.other_m = (*at_C - other.p_CG.cast<double>()).norm();
      }
      if (const auto at_C = center(std::nullopt); at_C.has_value()) {
        out.first_one = std::min((*at_C - named.p_CG.cast<double>()).norm(),
                                 (*at_C - other.p_CG.cast<double>()).norm()) <= kWrongGate_m;
      }
    }
  };
  if (!for_each_index(pairs.size(), thread_n, work,
                      [&](std::uint64_t done) { return progress((pairs.size() + done) / 2); }))
    return std::nullopt;

  std::vector<TwoGatesResult> out(bundles);
  for (std::size_t bundle = 0; bundle < bundles; ++bundle) {
    TwoGatesResult& result = out[bundle];
    std::vector<double> center_m;
    for (const Seen& frame : seen[bundle]) {
      ++result.count;
      const bool named = frame.named_m <= kWrongGate_m && frame.named_m <= frame.other_m;
      const bool other = frame.other_m <= kWrongGate_m && frame.other_m < frame.named_m;
      result.named += named ? 1 : 0;
      result.other += other ? 1 : 0;
      result.neither += named || other ? 0 : 1;
      result.first_one += frame.first_one ? 1 : 0;
      center_m.push_back(frame.named_m);
    }
    result.center_median_m = quantile(center_m, 0.5);
    result.center_p90_m = quantile(center_m, 0.9);
  }
  return out;
}

}  // namespace gatefield::training
