#include "server/training/data/statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "server/training/data/scenes.h"

namespace gatefield::training {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// Counts values into ranges named "a to b unit".
class Ranges {
 public:
  Ranges(std::string title, std::vector<double> limits, const std::string& unit) : limits_(std::move(limits)) {
    group_.title = std::move(title);
    for (std::size_t i = 0; i + 1 < limits_.size(); ++i) {
      group_.parts.push_back({fmt::format("{:g} to {:g}{}", limits_[i], limits_[i + 1], unit), 0, 0});
    }
  }
  void add(double value) {
    const auto above = std::upper_bound(limits_.begin(), limits_.end(), value) - limits_.begin();
    const auto last = static_cast<std::ptrdiff_t>(group_.parts.size()) - 1;
    ++group_.parts[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(above - 1, 0, last))].frames;
    for (auto& part : group_.parts) ++part.of;
  }
  DatasetStatistics::Group group() const { return group_; }

 private:
  std::vector<double> limits_;
  DatasetStatistics::Group group_;
};

/// The angle between the gate's side posts as the camera sees them, in the gate's horizontal plane; 0 or less when one
/// stands (partly) before the other.
double gap_between_posts_rad(const GateLabel& gate) {
  const Eigen::Vector3f p_GC = -(gate.q_CG.conjugate() * gate.p_CG);
  const auto half_x_m = 0.5 * gate.shape.thickness_m;
  // Bearings are taken from the direction to the gate's centre, so that they don't wrap.
  const double middle_rad = std::atan2(-p_GC.y(), -p_GC.x());
  std::array<std::array<double, 2>, 2> ends{};
  for (std::size_t side = 0; side < 2; ++side) {
    ends[side] = {1e9, -1e9};
    for (const double across_m : {gate.shape.inner_half_m, gate.shape.outer_half_m}) {
      for (const double along_m : {half_x_m, -half_x_m}) {
        const double bearing_rad =
            std::atan2((side == 0 ? across_m : -across_m) - p_GC.y(), along_m - p_GC.x()) - middle_rad;
        const double wrapped_rad = std::remainder(bearing_rad, 2.0 * std::numbers::pi);
        ends[side] = {std::min(ends[side][0], wrapped_rad), std::max(ends[side][1], wrapped_rad)};
      }
    }
  }
  return std::max(ends[0][0], ends[1][0]) - std::min(ends[0][1], ends[1][1]);
}

}  // namespace

DatasetStatistics::Part DatasetStatistics::find(const std::string& group, const std::string& part) const {
  for (const Group& each : groups) {
    if (each.title != group) continue;
    for (const Part& found : each.parts) {
      if (found.name == part) return found;
    }
  }
  return {};
}

DatasetStatistics count_statistics(const Dataset& dataset, std::uint64_t limit) {
  const CameraModel& camera = dataset_camera();
  const std::uint64_t count = limit == 0 ? dataset.size() : std::min(limit, dataset.size());
  const double pixel_rad = std::atan(1.0 / camera.fx_px);

  DatasetStatistics statistics;
  statistics.frames = count;
  DatasetStatistics::Group seen{"valid gates", {{"none", 0, 0}, {"1", 0, 0}, {"2", 0, 0}, {"3", 0, 0}, {"4", 0, 0}}};
  DatasetStatistics::Group none{
      "frames without a valid gate",
      {{"no gate in the world", 0, 0}, {"out of view or hidden", 0, 0}, {"a little in view (12 to 25 %)", 0, 0}}};
  Ranges distance("distance", {0.0, 0.5, 1.0, 2.0, 4.0, 7.0, 10.0}, " m");
  Ranges angle("angle off the gate's axis", {0, 20, 40, 60, 70, 80, 90}, " deg");
  Ranges visible("part in view", {0.25, 0.5, 0.7, 0.9, 1.0}, "");
  DatasetStatistics::Group posts{"side posts", {{"less than a pixel apart or overlapping", 0, 0}}};
  DatasetStatistics::Group pairs{"two valid gates, difference of distance",
                                 {{"below 0.1 m", 0, 0}, {"below 0.3 m", 0, 0}, {"below 1 m", 0, 0}}};
  Ranges roll("roll of the body, either way", {0, 15, 30, 45, 60}, " deg");
  Ranges pitch("pitch of the body, nose down", {-35, -15, 0, 15, 30, 45}, " deg");
  DatasetStatistics::Group around{
      "around the gates",
      {{"frame of the wrong size in the world", 0, 0}, {"frame of the wrong size in view", 0, 0}, {"clutter", 0, 0}}};

  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t index = i * dataset.size() / std::max<std::uint64_t>(count, 1);
    const SampleView sample = dataset.at(index);
    ++seen.parts[static_cast<std::size_t>(sample.valid_count)].frames;
    if (sample.X_WC) {
      const Eigen::Matrix3d R_WB = sample.X_WC->linear().cast<double>() * camera.X_BC.linear().transpose();
      roll.add(std::abs(std::atan2(R_WB(2, 1), R_WB(2, 2))) / kDegree);
      pitch.add(std::asin(std::clamp(-R_WB(2, 0), -1.0, 1.0)) / kDegree);
    }
    if (const GateLabel* gate = sample.target()) {
      const auto distance_m = static_cast<double>(gate->p_CG.norm());
      distance.add(distance_m);
      const Eigen::Vector3f normal = gate->q_CG * Eigen::Vector3f::UnitX();
      angle.add(std::acos(std::min(1.0, std::abs(static_cast<double>(normal.dot(gate->p_CG))) / distance_m)) / kDegree);
      visible.add(gate->visible_fraction);
      ++posts.parts[0].of;
      posts.parts[0].frames += gap_between_posts_rad(*gate) < pixel_rad ? 1 : 0;
      double closest_m = 1e9;
      for (int g = 1; g < sample.valid_count; ++g) {
        const double other_m = static_cast<double>(sample.gates[static_cast<std::size_t>(g)].p_CG.norm());
        const double before_m = static_cast<double>(sample.gates[static_cast<std::size_t>(g - 1)].p_CG.norm());
        closest_m = std::min(closest_m, other_m - before_m);
      }
      pairs.parts[0].frames += closest_m < 0.1 ? 1 : 0;
      pairs.parts[1].frames += closest_m < 0.3 ? 1 : 0;
      pairs.parts[2].frames += closest_m < 1.0 ? 1 : 0;
    } else {
      const bool some = std::any_of(sample.gates.begin(), sample.gates.begin() + sample.gate_count,
                                    [](const GateLabel& each) { return each.visible_fraction >= 0.12f; });
      ++none.parts[sample.gate_count == 0 ? 0 : some ? 2 : 1].frames;
    }
    if (dataset.kind() == DatasetKind::kSimulation) {
      Random random(dataset.seed(), dataset.first_index() + index);
      const Scenario scenario = draw_scenario(camera, &random, {.round_part = dataset.info().round_part});
      bool shown = false;
      for (std::size_t g = scenario.gates; g < scenario.world.gates.size(); ++g) {
        const scene::Gate& wrong = scenario.world.gates[g];
        const Eigen::Isometry3f X_CG = (scenario.X_WC.inverse() * wrong.X_WG).cast<float>();
        shown = shown || visible_fraction(camera, sample.clean_mm, wrong.shape, X_CG) >= kValidVisibleFraction;
      }
      around.parts[0].frames += scenario.world.gates.size() > scenario.gates ? 1 : 0;
      around.parts[1].frames += shown ? 1 : 0;
      around.parts[2].frames += scenario.world.boxes.empty() ? 0 : 1;
    }
  }
  for (auto* group : {&seen, &pairs, &around}) {
    for (auto& part : group->parts) part.of = count;
  }
  for (auto& part : none.parts) part.of = seen.parts[0].frames;
  statistics.groups = {seen, none, distance.group(), angle.group(), posts, visible.group(), pairs};
  if (dataset.columns().X_WC) {
    statistics.groups.push_back(roll.group());
    statistics.groups.push_back(pitch.group());
  }
  if (dataset.kind() == DatasetKind::kSimulation) statistics.groups.push_back(around);
  return statistics;
}

std::string to_text(const DatasetStatistics& statistics) {
  std::string text = std::to_string(statistics.frames) + " frames\n";
  for (const auto& group : statistics.groups) {
    text += group.title + "\n";
    for (const auto& part : group.parts) {
      text += fmt::format("  {:<40} {:9}  {:5.1f} %\n", part.name, part.frames, 100.0 * part.part());
    }
  }
  return text;
}

}  // namespace gatefield::training
