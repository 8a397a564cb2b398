#include "server/baseline/perception.h"

#include <cmath>
#include <numbers>

#include "server/baseline/classical_detector.h"
#include "server/planner/analytic_field.h"

namespace gatefield::baseline {
namespace {

using Outcome = perception::GateMemory::Outcome;

/// A gate counts as in view when this part of its frame is.
constexpr double kShownPart = 0.25;
constexpr double kSameDepth_m = 0.15;      ///< and a depth belongs to the frame when it differs by no more than this
constexpr double kSameDepth_per_m = 0.04;  ///< plus this share of the distance
constexpr float kValid = 1.0f;

/// The filter and the rules of the product around poses that come from elsewhere.
class PoseMemory : public service::Memory {
 public:
  explicit PoseMemory(const Course& course) : course_(course), records_(course) {}

  Eigen::Vector3d expected_center_W(std::uint32_t waypoint) const noexcept override {
    return records_.expected_center_W(waypoint);
  }
  bool seen(std::uint32_t waypoint) const noexcept override { return records_.seen(waypoint); }
  void snapshot(std::uint32_t target, std::uint32_t next, perception::MemorySnapshot* out) const override {
    records_.snapshot(target, next, out);
  }

 protected:
  Outcome take(std::uint32_t waypoint, perception::GateMeasurement measurement, Stamp capture) {
    const auto X_WG = records_.take(waypoint, &measurement, capture);
    if (!X_WG) return Outcome::kOutlier;
    records_.gate(waypoint).field.stand_in = std::make_shared<planner::AnalyticField>(*X_WG, shape(waypoint));
    return Outcome::kTaken;
  }
  GateShape shape(std::uint32_t waypoint) const { return course_.waypoints[waypoint].gate; }

 private:
  Course course_;
  perception::GateRecords records_;
};

/// Never sees anything.
class Blind final : public PoseMemory {
 public:
  using PoseMemory::PoseMemory;
  Outcome observe(std::uint32_t, const perception::Encoding&, const Eigen::Isometry3d&, Stamp) override {
    return Outcome::kNotValid;
  }
};

/// The latent is the pose: rows of the gate in the camera's frame.
class Detections final : public PoseMemory {
 public:
  using PoseMemory::PoseMemory;
  Outcome observe(std::uint32_t waypoint, const perception::Encoding& encoding, const Eigen::Isometry3d& X_WC,
                  Stamp capture) override {
    const Eigen::Isometry3d X_CG = pose_from(encoding.latent);
    const double distance_m = X_CG.translation().norm();
    // As far as an honest detector can be trusted; the same growth with distance as the learned field's.
    return take(waypoint, {X_WC * X_CG, 0.02 + 0.012 * distance_m, 0.04 + 0.015 * distance_m}, capture);
  }
};

/// The latent is the depth image: only what it shows is revealed.
class Truth final : public PoseMemory {
 public:
  Truth(const protocol::SessionRequest& request, const config::Scenario& scenario)
      : PoseMemory(request.course),
        camera_(request.camera),
        world_(config::perturbed_world(scenario.track, scenario.perturbation, request.seed)) {}

  Outcome observe(std::uint32_t waypoint, const perception::Encoding& encoding, const Eigen::Isometry3d& X_WC,
                  Stamp capture) override {
    if (waypoint >= world_.gates.size()) return Outcome::kNotValid;
    const Eigen::Isometry3d& X_WG = world_.gates[waypoint].X_WG;
    if (!shown(encoding.latent, shape(waypoint), X_WC.inverse() * X_WG)) return Outcome::kNotValid;
    return take(waypoint, {X_WG, 0.01, 0.01}, capture);
  }

 private:
  bool shown(std::span<const float> depth_m, const GateShape& shape, const Eigen::Isometry3d& X_CG) const {
    if (depth_m.size() != static_cast<std::size_t>(camera_.width_px * camera_.height_px)) return false;
    constexpr int kPoints = 64;
    const double middle_m = 0.5 * (shape.inner_half_m + shape.outer_half_m);
    int seen = 0;
    for (int i = 0; i < kPoints; ++i) {
      const double angle = 2.0 * std::numbers::pi * (i + 0.5) / kPoints;
      Eigen::Vector3d p_G(0, std::cos(angle), std::sin(angle));
      const bool square = shape.opening == GateShape::Opening::kSquare;
      p_G *= middle_m / (square ? p_G.cwiseAbs().maxCoeff() : 1.0);
      const Eigen::Vector3d p_C = X_CG * p_G;
      if (!camera_.sees(p_C)) continue;
      const int u = static_cast<int>(camera_.cx_px + camera_.fx_px * p_C.x() / p_C.z());
      const int v = static_cast<int>(camera_.cy_px + camera_.fy_px * p_C.y() / p_C.z());
      const double z = depth_m[static_cast<std::size_t>(v * camera_.width_px + u)];
      if (z > 0 && std::abs(z - p_C.z()) < kSameDepth_m + kSameDepth_per_m * p_C.z()) ++seen;
    }
    return seen >= kShownPart * kPoints;
  }

  CameraModel camera_;
  scene::World world_;
};

/// Hands the image on.
class WholeImage final : public perception::DepthEncoder {
 public:
  std::optional<perception::Encoding> encode(std::span<const float> depth_m, const CameraModel&,
                                             const std::optional<Eigen::Vector3d>&) override {
    return perception::Encoding{{depth_m.begin(), depth_m.end()}, Eigen::Vector3f::Zero(), kValid, 0.0f};
  }
};

class NoEyes final : public perception::DepthEncoder {
 public:
  std::optional<perception::Encoding> encode(std::span<const float>, const CameraModel&,
                                             const std::optional<Eigen::Vector3d>&) override {
    return std::nullopt;
  }
};

class Classical final : public perception::DepthEncoder {
 public:
  /// One detector for each kind of gate on the course; what scores best is what is seen.
  explicit Classical(const Course& course) {
    for (const auto opening : {GateShape::Opening::kSquare, GateShape::Opening::kRound}) {
      for (const Waypoint& waypoint : course.waypoints) {
        if (waypoint.gate.opening != opening) continue;
        detectors_.emplace_back(waypoint.gate);
        break;
      }
    }
  }
  std::optional<perception::Encoding> encode(std::span<const float> depth_m, const CameraModel& camera,
                                             const std::optional<Eigen::Vector3d>& prior_C) override {
    std::optional<Detection> found;
    for (ClassicalDetector& detector : detectors_) {
      const auto detection = detector.detect(depth_m, camera, prior_C);
      if (detection && (!found || detection->score > found->score)) found = detection;
    }
    if (!found) return std::nullopt;
    return perception::Encoding{latent_of(found->X_CG), found->X_CG.translation().cast<float>(), kValid, 0.0f};
  }

 private:
  std::vector<ClassicalDetector> detectors_;
};

}  // namespace

Result<Kind> parse_kind(const std::string& word) {
  for (const Kind kind : {Kind::kNone, Kind::kTruePose, Kind::kClassical})
    if (word == name(kind)) return kind;
  return Error{"'" + word + "' is no perception, expected NONE, TRUE_POSE or CLASSICAL"};
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

std::unique_ptr<perception::DepthEncoder> make_encoder(Kind kind, const Course& course) {
  switch (kind) {
    case Kind::kNone:
      return std::make_unique<NoEyes>();
    case Kind::kTruePose:
      return std::make_unique<WholeImage>();
    case Kind::kClassical:
      return std::make_unique<Classical>(course);
  }
  return nullptr;
}

std::unique_ptr<service::Memory> make_memory(Kind kind, const protocol::SessionRequest& request,
                                             const config::Scenario& scenario) {
  switch (kind) {
    case Kind::kNone:
      return std::make_unique<Blind>(request.course);
    case Kind::kTruePose:
      return std::make_unique<Truth>(request, scenario);
    case Kind::kClassical:
      return std::make_unique<Detections>(request.course);
  }
  return nullptr;
}

}  // namespace gatefield::baseline
