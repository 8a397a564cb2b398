#include "server/baseline/sensors.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "server/baseline/classical_detector.h"
#include "server/gates/analytic_field.h"

namespace gatefield::baseline {
namespace {

using perception::Observation;
using perception::View;
using perception::Where;

/// A gate counts as in view when this part of its frame is.
constexpr double kShownPart = 0.25;
constexpr double kSameDepth_m = 0.15;      ///< and a depth belongs to the frame when it differs by no more than this
constexpr double kSameDepth_per_m = 0.04;  ///< plus this share of the distance

/// The field of a gate whose pose is believed.
class Hourglass final : public gates::Field {
 public:
  Hourglass(const Eigen::Isometry3d& X_WG, const GateShape& shape) : X_WG_(X_WG), field_(X_WG, shape) {}
  void evaluate(std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
                std::span<float> sdf_m) const noexcept override {
    field_.evaluate(x_W, y_W, z_W, sdf_m);
  }
  const Eigen::Isometry3d& X_WG() const noexcept { return X_WG_; }

 private:
  Eigen::Isometry3d X_WG_;
  gates::AnalyticField field_;
};

/// What sensors have in common that see poses.
class PoseSensor : public perception::GateSensor {
 public:
  bool steerable() const noexcept override { return false; }
  std::shared_ptr<const gates::Field> field(const Eigen::Isometry3d&, const Eigen::Isometry3d& X_WG,
                                            const GateShape& shape) final {
    return std::make_shared<Hourglass>(X_WG, shape);
  }
  perception::FieldSource source_of(const gates::Field& field) const final {
    return {static_cast<const Hourglass&>(field).X_WG(), {}};
  }
  Result<std::shared_ptr<const gates::Field>> restore(const perception::FieldSource& source,
                                                      const GateShape& shape) final {
    if (!source.latent.empty())
      return Error::invalid("latent", std::to_string(source.latent.size()) + " numbers", "none with this perception");
    return std::shared_ptr<const gates::Field>(std::make_shared<Hourglass>(source.X_WF, shape));
  }
};

/// Never sees anything.
class Blind final : public PoseSensor {
 public:
  std::optional<Observation> look(const View&, const gates::Expectation&, Where) override { return std::nullopt; }
};

/// Knows the true gates, and tells of those that the image shows.
class Truth final : public PoseSensor {
 public:
  explicit Truth(const config::Scenario& scenario)
      : world_(config::perturbed_world(scenario.track, scenario.perturbation, scenario.seed)) {}

  std::optional<Observation> look(const View& view, const gates::Expectation& gate, Where) override {
    if (gate.gate >= world_.gates.size()) return std::nullopt;
    const Eigen::Isometry3d& X_WG = world_.gates[gate.gate].X_WG;
    if (!shown(view, gate.shape, view.X_WC.inverse() * X_WG)) return std::nullopt;
    return Observation{{X_WG, 0.01, 0.01}, 1.0, X_WG.translation()};
  }

 private:
  static bool shown(const perception::View& view, const GateShape& shape, const Eigen::Isometry3d& X_CG) {
    const CameraModel& camera = view.camera;
    constexpr int kPoints = 64;
    const double middle_m = 0.5 * (shape.inner_half_m + shape.outer_half_m);
    int seen = 0;
    for (int i = 0; i < kPoints; ++i) {
      const double angle = 2.0 * std::numbers::pi * (i + 0.5) / kPoints;
      Eigen::Vector3d p_G(0, std::cos(angle), std::sin(angle));
      const bool square = shape.opening == GateShape::Opening::kSquare;
      p_G *= middle_m / (square ? p_G.cwiseAbs().maxCoeff() : 1.0);
      const Eigen::Vector3d p_C = X_CG * p_G;
      if (!camera.sees(p_C)) continue;
      const int u = static_cast<int>(camera.cx_px + camera.fx_px * p_C.x() / p_C.z());
      const int v = static_cast<int>(camera.cy_px + camera.fy_px * p_C.y() / p_C.z());
      const double z = view.depth_m[static_cast<std::size_t>(v * camera.width_px + u)];
      if (z > 0 && std::abs(z - p_C.z()) < kSameDepth_m + kSameDepth_per_m * p_C.z()) ++seen;
    }
    return seen >= kShownPart * kPoints;
  }

  scene::World world_;  // its gates are numbered as the course's
};

/// Its rotation is one to double precision's last digit.
Eigen::Isometry3d in_double_precision(const Eigen::Isometry3f& X) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.matrix().topRows<3>() = X.matrix().topRows<3>().cast<double>();
  out.linear() = Eigen::Quaterniond(out.linear()).normalized().toRotationMatrix();
  return out;
}

/// One detector for each kind of gate on the course; what scores best is what is seen.
class Classical final : public PoseSensor {
 public:
  explicit Classical(const Course& course) {
    for (const auto opening : {GateShape::Opening::kSquare, GateShape::Opening::kRound}) {
      for (const Waypoint& waypoint : course.waypoints) {
        if (waypoint.gate.opening != opening) continue;
        detectors_.emplace_back(waypoint.gate);
        break;
      }
    }
  }

  bool steerable() const noexcept override { return true; }
  std::optional<Observation> look(const View& view, const gates::Expectation& gate, Where where) override {
    std::optional<Eigen::Vector3d> prior_C;
    if (where == Where::kExpected) prior_C = view.X_WC.inverse() * gate.center_W;
    std::optional<Detection> found;
    for (ClassicalDetector& detector : detectors_) {
      const auto detection = detector.detect(view.depth_m, view.camera, prior_C);
      if (detection && (!found || detection->score > found->score)) found = detection;
    }
    if (!found) return std::nullopt;
    const Eigen::Isometry3d X_CG = in_double_precision(found->X_CG);
    const Eigen::Isometry3d X_WG = view.X_WC * X_CG;
    const double distance_m = X_CG.translation().norm();
    // As far as an honest detector can be trusted; the same growth with distance as the learned field's.
    return Observation{
        {X_WG, 0.02 + 0.012 * distance_m, 0.04 + 0.015 * distance_m}, 1.0, view.X_WC * X_CG.translation()};
  }

 private:
  std::vector<ClassicalDetector> detectors_;
};

}  // namespace

Result<Kind> parse_kind(const std::string& word) {
  for (const Kind kind : {Kind::kNone, Kind::kTruePose, Kind::kClassical})
    if (word == name(kind)) return kind;
  return Error{"'" + word + "' is no perception, expected NONE, TRUE_POSE or CLASSICAL", ErrorCode::kUnknownName};
}

const char* name(Kind kind) noexcept {
  switch (kind) {
    case Kind::kNone:
      return "NONE";
    case Kind::kTruePose:
      return "TRUE_POSE";
    case Kind::kClassical:
      return "CLASSICAL";
  }
  return "";
}

std::unique_ptr<perception::GateSensor> make_sensor(Kind kind, const protocol::SessionRequest& request,
                                                    const config::Scenario& scenario) {
  switch (kind) {
    case Kind::kNone:
      return std::make_unique<Blind>();
    case Kind::kTruePose:
      return std::make_unique<Truth>(scenario);
    case Kind::kClassical:
      return std::make_unique<Classical>(request.course);
  }
  return nullptr;
}

}  // namespace gatefield::baseline
