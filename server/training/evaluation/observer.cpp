#include "server/training/evaluation/observer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "server/gates/gate_records.h"
#include "server/kernels/backend.h"
#include "server/perception/learned/learned_sensor.h"
#include "server/training/data/sampling.h"
#include "server/training/evaluation/wrong_gate.h"

namespace gatefield::training {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kMixPoints = 192;
constexpr std::size_t kBoxPoints = 256;
constexpr double kBoxHalf_m = 1.0;

/// The camera looking level along the world's x axis: the fit turns its starting poses about the vertical.
const Eigen::Isometry3d& level_camera() {
  static const Eigen::Isometry3d X_WC = forward_camera_mount(0.0);
  return X_WC;
}

/// Whether a memory that has seen nothing yet takes this encoding, when the course says that the gate is at
/// `nominal_C`.
bool memory_takes(const Observer& observer, const perception::Encoding& encoding, const GateShape& shape,
                  const Eigen::Vector3d& nominal_C) {
  Course course;
  course.closed = false;
  course.waypoints.emplace_back(level_camera() * nominal_C, Eigen::Vector3d::UnitX(), shape);
  gates::GateRecords records(course);
  perception::DecodedField raw;
  auto seen = perception::observation_of(observer.bundle(), observer.decoder(), encoding, level_camera(),
                                         records.expectation(0), 1.0, &raw);
  return seen && records.take(0, &seen->gate, Stamp{0});
}

}  // namespace

QueryPoints draw_points(const GateLabel& gate, Random* random) {
  QueryPoints out;
  out.mix_C.resize(3 * kMixPoints);
  out.mix_m.resize(kMixPoints);
  out.box_C.resize(3 * kBoxPoints);
  out.box_m.resize(kBoxPoints);
  const SamplingMix mix;
  sample_points(mix, dataset_camera(), gate.shape, gate.X_CG(), random, out.mix_C, out.mix_m);
  sample_box(kBoxHalf_m, gate.shape, gate.X_CG(), random, out.box_C, out.box_m);
  out.near_n = static_cast<std::size_t>(mix.near_surface * kMixPoints);
  return out;
}

Observer::Observer(const model::Bundle& bundle, std::unique_ptr<perception::DepthEncoder> encoder)
    : bundle_(&bundle), encoder_(std::move(encoder)), decoder_(kernels::best_backend().prepare(bundle.decoder())) {}

Result<std::unique_ptr<Observer>> Observer::create(const model::Bundle& bundle) {
  auto encoder = perception::DepthEncoder::create(bundle);
  if (!encoder) return encoder.failure();
  return std::unique_ptr<Observer>(new Observer(bundle, std::move(encoder).value()));
}

std::optional<perception::Encoding> Observer::encode(std::span<const float> image_m, const CameraModel& camera,
                                                     const std::optional<Eigen::Vector3d>& prior_C) {
  const auto begun = Clock::now();
  auto encoding = encoder_->encode(image_m, camera, prior_C);
  const double spent_ms = std::chrono::duration<double, std::milli>(Clock::now() - begun).count();
  (prior_C ? prior_ms : first_ms).push_back(spent_ms);
  return encoding;
}

std::span<const float> Observer::decode(const std::vector<float>& points_C) {
  const std::size_t n = points_C.size() / 3;
  for (auto* values : {&x_, &y_, &z_, &value_m_}) values->resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d p_W =
        level_camera() * Eigen::Vector3d(points_C[3 * i], points_C[3 * i + 1], points_C[3 * i + 2]);
    x_[i] = static_cast<float>(p_W.x());
    y_[i] = static_cast<float>(p_W.y());
    z_[i] = static_cast<float>(p_W.z());
  }
  field_.evaluate(x_, y_, z_, value_m_);
  return value_m_;
}

std::optional<Observer::Pose> Observer::fit(const perception::Encoding& encoding, const GateShape& shape,
                                            const Eigen::Vector3d& around_C) {
  kernels::fold(decoder_, encoding.latent, level_camera(), &field_.decoder);
  const Eigen::Vector3d begin_C = knows_center() ? Eigen::Vector3d(encoding.center_C.cast<double>()) : around_C;
  const auto found = perception::fit_hourglass(field_, shape, bundle_->manifest().cone_angle_rad,
                                               level_camera() * begin_C, Eigen::Vector3d::UnitX());
  if (!found.ok) return std::nullopt;
  return Pose{level_camera().inverse() * found.X_WG.translation(),
              level_camera().linear().transpose() * found.X_WG.linear().col(0), found.rms_m};
}

Measured Observer::measure(std::span<const float> image_m, const SampleView& sample, const GateLabel& gate,
                           const QueryPoints& points, Mode mode, const Eigen::Vector3d& prior_C) {
  Measured out;
  const auto encoding = encode(image_m, mode == Mode::kPrior ? std::optional<Eigen::Vector3d>(prior_C) : std::nullopt);
  std::optional<Pose> pose;
  if (encoding) {
    out.encoded = true;
    out.validity = encoding->validity;
    out.predicted_m = encoding->predicted_error_m;
    if (knows_center()) out.encoder_center_m = (encoding->center_C - gate.p_CG).norm();
    pose = fit(*encoding, gate.shape, prior_C);
    out.taken = memory_takes(*this, *encoding, gate.shape, prior_C);
  }
  const auto value_at = [&](const std::vector<float>& points_C) {
    if (encoding) return decode(points_C);
    value_m_.assign(points_C.size() / 3, 0.0f);
    return std::span<const float>(value_m_);
  };
  const auto mix = value_at(points.mix_C);
  for (std::size_t i = 0; i < mix.size(); ++i) {
    const double error = std::abs(static_cast<double>(mix[i]) - points.mix_m[i]);
    out.all_m += error / static_cast<double>(mix.size());
    if (i < points.near_n) out.near_m += error / static_cast<double>(points.near_n);
  }
  const auto box = value_at(points.box_C);
  for (std::size_t i = 0; i < box.size(); ++i) {
    out.box_m += std::abs(static_cast<double>(box[i]) - points.box_m[i]) / static_cast<double>(box.size());
    if ((box[i] > 0.0f) == (points.box_m[i] > 0.0f)) out.sign_percent += 100.0 / static_cast<double>(box.size());
  }
  if (pose) {
    out.fitted = true;
    out.center_m = (pose->center_C - gate.p_CG.cast<double>()).norm();
    const double cosine = std::abs(pose->axis_C.dot((gate.q_CG * Eigen::Vector3f::UnitX()).cast<double>()));
    out.normal_deg = std::acos(std::min(1.0, cosine)) * 180.0 / std::numbers::pi;
    for (int i = 0; i < sample.gate_count; ++i) {
      const double other_m = (pose->center_C - sample.gates[static_cast<std::size_t>(i)].p_CG.cast<double>()).norm();
      if (out.center_m > kWrongGate_m && other_m <= kWrongGate_m) out.other_gate = true;
    }
  }
  return out;
}

}  // namespace gatefield::training
