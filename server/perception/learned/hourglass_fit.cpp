#include "server/perception/learned/hourglass_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gatefield::perception {
namespace {

constexpr int kPoints = 192;
constexpr int kIterations = 12;
constexpr std::array kStartYaw_rad{0.0, 0.6, -0.6, 1.2, -1.2};
// Lengths, in half-widths of the opening.
constexpr double kRadius = 2.2;
constexpr double kHuber = 0.16;
constexpr double kGoodEnough = 0.1;  ///< a fit from the first starting angle that needs no second try

using Cloud = std::array<Eigen::Vector3d, kPoints>;

/// Offsets from the middle: the R3 low-discrepancy sequence (powers of the inverse of the root of x^4 = x + 1) in the
/// cube of half-width 1.
const Cloud& offsets() noexcept {
  static const Cloud cloud = [] {
    Cloud points;
    constexpr double kRoot = 1.2207440846057596;
    for (int i = 0; i < kPoints; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const double position = 0.5 + (i + 1) * std::pow(kRoot, -(axis + 1));
        points[static_cast<std::size_t>(i)][axis] = 2.0 * (position - std::floor(position)) - 1.0;
      }
    return points;
  }();
  return cloud;
}

struct Sample {
  double value;
  Eigen::Vector3d gradient_G;  ///< of s_guide with respect to the point in the gate frame
};

Sample hourglass(const GateShape& shape, double slope, const Eigen::Vector3d& p_G) noexcept {
  const double x_sign = p_G.x() >= 0 ? 1.0 : -1.0;
  Sample sample{shape.inner_half_m + x_sign * p_G.x() * slope, {x_sign * slope, 0, 0}};
  if (shape.opening == GateShape::Opening::kRound) {
    const double r = std::hypot(p_G.y(), p_G.z());
    sample.value -= r;
    if (r > 1e-9) sample.gradient_G.tail<2>() = -p_G.tail<2>() / r;
  } else {
    const int axis = std::abs(p_G.y()) >= std::abs(p_G.z()) ? 1 : 2;
    sample.value -= std::abs(p_G[axis]);
    sample.gradient_G[axis] = p_G[axis] >= 0 ? -1.0 : 1.0;
  }
  return sample;
}

struct Problem {
  const GateShape& shape;
  double slope;
  const Cloud& points_W;
  const std::array<double, kPoints>& values;

  /// Huber cost of a pose, and (when asked) the normal equations in (dc, rotation on the left).
  double cost(const Eigen::Isometry3d& X_WG, Eigen::Matrix<double, 6, 6>* H,
              Eigen::Matrix<double, 6, 1>* b) const noexcept {
    const Eigen::Matrix3d R_GW = X_WG.linear().transpose();
    const double huber_m = kHuber * shape.inner_half_m;
    double sum = 0.0;
    if (H != nullptr) {
      H->setZero();
      b->setZero();
    }
    for (std::size_t i = 0; i < kPoints; ++i) {
      const Eigen::Vector3d r_W = points_W[i] - X_WG.translation();
      const Sample model = hourglass(shape, slope, R_GW * r_W);
      const double residual = model.value - values[i];
      const double size = std::abs(residual);
      const double weight = size <= huber_m ? 1.0 : huber_m / size;
      sum += size <= huber_m ? 0.5 * residual * residual : huber_m * (size - 0.5 * huber_m);
      if (H == nullptr) continue;
      const Eigen::Vector3d gradient_W = X_WG.linear() * model.gradient_G;
      Eigen::Matrix<double, 6, 1> J;
      J.head<3>() = -gradient_W;
      J.tail<3>() = gradient_W.cross(r_W);  // p_G = R^T exp(-w) r: d/dw (g . R^T (r x w)) = g_W x r
      H->noalias() += weight * J * J.transpose();
      b->noalias() += weight * residual * J;
    }
    return sum;
  }
};

struct Solution {
  Eigen::Isometry3d X_WG;
  double cost;
};

Solution solve(const Problem& problem, Eigen::Isometry3d X_WG) noexcept {
  Eigen::Matrix<double, 6, 6> H;
  Eigen::Matrix<double, 6, 1> b;
  double damping = 1e-2;
  double cost = problem.cost(X_WG, &H, &b);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::Matrix<double, 6, 6> damped = H;
    damped.diagonal() += damping * H.diagonal() + Eigen::Matrix<double, 6, 1>::Constant(1e-9);
    const Eigen::Matrix<double, 6, 1> step = -damped.ldlt().solve(b);
    if (!step.allFinite()) break;
    Eigen::Isometry3d moved = X_WG;
    moved.translation() += step.head<3>();
    const double angle = step.tail<3>().norm();
    if (angle > 1e-12)
      moved.linear() =
          Eigen::AngleAxisd(std::min(angle, 0.5), step.tail<3>() / angle).toRotationMatrix() * X_WG.linear();
    const double moved_cost = problem.cost(moved, nullptr, nullptr);
    if (moved_cost < cost) {
      const bool converged = cost - moved_cost < 1e-6 * cost;
      X_WG = moved;
      damping = std::max(1e-6, 0.3 * damping);
      if (converged) {
        cost = moved_cost;
        break;
      }
      cost = problem.cost(X_WG, &H, &b);
    } else {
      damping *= 8.0;
      if (damping > 1e6) break;
    }
  }
  return {X_WG, cost};
}

Eigen::Isometry3d upright(const Eigen::Vector3d& center_W, const Eigen::Vector3d& axis_W, double yaw_rad) noexcept {
  const Eigen::Vector3d x = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) * axis_W.normalized();
  const Eigen::Vector3d up =
      std::abs(x.z()) < 0.95 ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  const Eigen::Vector3d y = up.cross(x).normalized();
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  X_WG.linear() << x, y, x.cross(y);
  X_WG.translation() = center_W;
  return X_WG;
}

}  // namespace

HourglassFit fit_hourglass(const gates::Field& field, const GateShape& shape, double cone_angle_rad,
                           const Eigen::Vector3d& around_W, const Eigen::Vector3d& axis_W) noexcept {
  HourglassFit fit;
  if (!around_W.allFinite() || !(axis_W.norm() > 0.5)) return fit;
  const double radius_m = kRadius * shape.inner_half_m, good_enough_m = kGoodEnough * shape.inner_half_m;
  Cloud points_W;
  std::array<float, kPoints> x, y, z, s;
  for (std::size_t i = 0; i < kPoints; ++i) {
    points_W[i] = around_W + radius_m * offsets()[i];
    x[i] = static_cast<float>(points_W[i].x());
    y[i] = static_cast<float>(points_W[i].y());
    z[i] = static_cast<float>(points_W[i].z());
  }
  field.evaluate(x, y, z, s);
  std::array<double, kPoints> values;
  for (std::size_t i = 0; i < kPoints; ++i) {
    if (!std::isfinite(s[i])) return fit;
    values[i] = s[i];
  }

  const Problem problem{shape, std::tan(cone_angle_rad), points_W, values};
  Solution best{Eigen::Isometry3d::Identity(), 1e300};
  for (const double yaw_rad : kStartYaw_rad) {
    const Solution solution = solve(problem, upright(around_W, axis_W, yaw_rad));
    if (solution.cost < best.cost) best = solution;
    if (best.cost < 0.5 * kPoints * good_enough_m * good_enough_m) break;
  }
  if (!best.X_WG.matrix().allFinite() || (best.X_WG.translation() - around_W).norm() > radius_m) return fit;

  double squares = 0.0;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double residual = guide_sdf(shape, best.X_WG.inverse() * points_W[i], cone_angle_rad) - values[i];
    squares += residual * residual;
  }
  fit.X_WG = best.X_WG;
  if (fit.X_WG.linear().col(0).dot(axis_W) < 0) {  // the hourglass looks the same from both sides
    fit.X_WG.linear().col(0) *= -1.0;
    fit.X_WG.linear().col(1) *= -1.0;
  }
  fit.rms_m = std::sqrt(squares / kPoints);
  fit.ok = true;
  return fit;
}

}  // namespace gatefield::perception
