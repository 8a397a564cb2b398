#include "server/training/data/flight_path.h"

#include <algorithm>

#include "server/training/data/scene_parts.h"

namespace gatefield::training {
namespace {

using Eigen::Vector3d;

constexpr double kMaxTurn_m_s2 = 16.0;    ///< across the path
constexpr double kMaxSpeedUp_m_s2 = 6.0;  ///< along the path
constexpr double kMaxCurvature_per_m = 1.7;
constexpr double kStep_m = 0.05;  ///< between points of a path

}  // namespace

Path round_path(const std::vector<Vector3d>& points, const std::vector<Vector3d>& directions) {
  const std::size_t n = points.size();
  std::vector<Vector3d> raw;
  for (std::size_t k = 0; k < n; ++k) {
    const Vector3d& a = points[k];
    const Vector3d& b = points[(k + 1) % n];
    const double distance_m = (b - a).norm();
    const Vector3d ta = distance_m * directions[k];
    const Vector3d tb = distance_m * directions[(k + 1) % n];
    const int steps = std::max(8, static_cast<int>(distance_m / (0.2 * kStep_m)));
    for (int i = 0; i < steps; ++i) {
      const double t = static_cast<double>(i) / steps;
      const double s = 1.0 - t;
      raw.emplace_back(s * s * (1.0 + 2.0 * t) * a + t * t * (3.0 - 2.0 * t) * b + s * s * t * ta - t * t * s * tb);
    }
  }
  const auto resample = [](const std::vector<Vector3d>& from, double* step_m) {
    std::vector<double> at_m(from.size() + 1, 0.0);
    for (std::size_t i = 0; i < from.size(); ++i) {
      at_m[i + 1] = at_m[i] + (from[(i + 1) % from.size()] - from[i]).norm();
    }
    const auto count = static_cast<std::size_t>(std::max(16.0, std::round(at_m.back() / kStep_m)));
    *step_m = at_m.back() / static_cast<double>(count);
    std::vector<Vector3d> even(count);
    std::size_t i = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const double want_m = static_cast<double>(k) * *step_m;
      while (i + 1 < from.size() && at_m[i + 1] <= want_m) ++i;
      const double part = (want_m - at_m[i]) / std::max(at_m[i + 1] - at_m[i], 1e-9);
      even[k] = from[i] + part * (from[(i + 1) % from.size()] - from[i]);
    }
    return even;
  };
  Path path;
  const std::vector<Vector3d> even = resample(raw, &path.step_m);
  const double sigma = 0.5 / path.step_m;
  const int reach = static_cast<int>(3.0 * sigma);
  const auto count = static_cast<int>(even.size());
  std::vector<Vector3d> rounded(even.size(), Vector3d::Zero());
  double sum = 0.0;
  for (int j = -reach; j <= reach; ++j) sum += std::exp(-0.5 * j * j / (sigma * sigma));
  for (int i = 0; i < count; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      rounded[static_cast<std::size_t>(i)] += std::exp(-0.5 * j * j / (sigma * sigma)) / sum *
                                              even[static_cast<std::size_t>(((i + j) % count + count) % count)];
    }
  }
  path.p_W = resample(rounded, &path.step_m);
  const std::size_t size = path.p_W.size();
  path.along.resize(size);
  path.curvature.resize(size);
  // Differences over four steps: the resampled points have corners of their own.
  constexpr std::size_t kWide = 4;
  const double wide_m = kWide * path.step_m;
  for (std::size_t i = 0; i < size; ++i) {
    const Vector3d& before = path.p_W[(i + size - kWide) % size];
    const Vector3d& after = path.p_W[(i + kWide) % size];
    path.along[i] = (after - before).normalized();
    path.curvature[i] = (after - 2.0 * path.p_W[i] + before) / (wide_m * wide_m);
  }
  return path;
}

bool clear(const Path& path, const std::vector<scene::Box>& boxes, double margin_m) {
  for (const scene::Box& box : boxes) {
    const double reach_m = box.half_m.norm() + margin_m;
    for (std::size_t i = 0; i < path.size(); i += 2) {
      if ((path.p_W[i] - box.X_WO.translation()).squaredNorm() > reach_m * reach_m) continue;
      if (distance_m(box, path.p_W[i]) < margin_m) return false;
    }
  }
  return true;
}

bool flyable(const Path& path, const std::vector<scene::Gate>& gates, const std::vector<scene::Box>& others,
             double margin_m) {
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (path.curvature[i].norm() > kMaxCurvature_per_m || path.p_W[i].z() < 0.35) return false;
  }
  for (const scene::Gate& gate : gates) {
    if (!clear(path, scene::frame_boxes(gate), margin_m)) return false;
  }
  return clear(path, others, margin_m);
}

std::vector<double> plan_speed(const Path& path, double wanted_m_s) {
  const std::size_t n = path.size();
  std::vector<double> speed_m_s(n);
  for (std::size_t i = 0; i < n; ++i) {
    speed_m_s[i] = std::min(wanted_m_s, std::sqrt(kMaxTurn_m_s2 / std::max(path.curvature[i].norm(), 1e-3)));
  }
  const double gain = 2.0 * kMaxSpeedUp_m_s2 * path.step_m;
  for (std::size_t round = 0; round < 2 * n; ++round) {  // twice around: the path is closed
    const std::size_t i = round % n;
    double& after = speed_m_s[(i + 1) % n];
    after = std::min(after, std::sqrt(speed_m_s[i] * speed_m_s[i] + gain));
  }
  for (std::size_t round = 2 * n; round > 0; --round) {
    const std::size_t i = (round - 1) % n;
    const double after = speed_m_s[(i + 1) % n];
    speed_m_s[i] = std::min(speed_m_s[i], std::sqrt(after * after + gain));
  }
  return speed_m_s;
}

}  // namespace gatefield::training
