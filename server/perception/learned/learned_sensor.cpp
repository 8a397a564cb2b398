#include "server/perception/learned/learned_sensor.h"

#include <algorithm>
#include <cmath>

#include "common/base/text.h"
#include "server/perception/learned/hourglass_fit.h"

namespace gatefield::perception {
namespace {

/// A field that no hourglass explains better than this says nothing about a gate. The network's metres.
constexpr double kPoorFit_m = 0.16;
constexpr double kRounding = 1e-6;

/// How much a frame's centre and axis can be trusted: grows with distance (held-out evaluation of the shipped model),
/// and with how badly an hourglass explains the field.
/// @param fit, distance_m  metres of the world, @param unit_m of them in one of the network's
gates::GateMeasurement measurement_of(const HourglassFit& fit, double distance_m, double unit_m) {
  const double distance = distance_m / unit_m, rms = fit.rms_m / unit_m;
  gates::GateMeasurement measurement;
  measurement.X_WG = fit.X_WG;
  measurement.distance_m = distance_m;
  measurement.center_sigma_m = unit_m * std::hypot(0.02 + 0.012 * distance, rms);
  measurement.axis_sigma_rad = std::hypot(0.04 + 0.015 * distance, 1.5 * rms);
  return measurement;
}

}  // namespace

std::optional<Observation> observation_of(const model::Bundle& bundle,
                                          const std::shared_ptr<const kernels::PreparedDecoder>& decoder,
                                          const Encoding& encoding, const Eigen::Isometry3d& X_WC,
                                          const gates::Expectation& gate, double unit_m, DecodedField* raw) {
  const model::Manifest& manifest = bundle.manifest();
  if (!(encoding.validity >= manifest.validity_threshold)) return std::nullopt;
  kernels::fold(decoder, encoding.latent, X_WC, &raw->decoder, unit_m);
  const Eigen::Vector3d glimpse_W = X_WC * (unit_m * encoding.center_C.cast<double>());
  const bool has_center = bundle.decoder().kind == model::DecoderKind::kHyper;
  const HourglassFit fit =
      fit_hourglass(*raw, gate.shape, manifest.cone_angle_rad, has_center ? glimpse_W : gate.center_W, gate.axis_W);
  if (!fit.ok || fit.rms_m > unit_m * kPoorFit_m) return std::nullopt;
  const double distance_m = (fit.X_WG.translation() - X_WC.translation()).norm();
  return Observation{measurement_of(fit, distance_m, unit_m), encoding.validity, glimpse_W};
}

double unit_of(const model::Manifest& manifest, const GateShape& shape) noexcept {
  return shape.inner_half_m / manifest.gate_inner_half_m;
}

Status check_openings(const model::Manifest& manifest, const Course& course) {
  for (std::size_t i = 0; i < course.waypoints.size(); ++i) {
    const GateShape& shape = course.waypoints[i].gate;
    const double unit_m = unit_of(manifest, shape);
    if (unit_m >= kSmallestUnit - kRounding && unit_m <= kLargestUnit + kRounding) continue;
    return Error::invalid(
        "course.waypoints[" + std::to_string(i) + "].gate.inner_half_m", text(shape.inner_half_m) + " m",
        text(kSmallestUnit * manifest.gate_inner_half_m) + " to " + text(kLargestUnit * manifest.gate_inner_half_m) +
            " m: model " + manifest.name + " was trained with " + text(manifest.gate_inner_half_m) +
            " m and sees openings of 0.3 to 3 times that");
  }
  return {};
}

/// A field with what it was made from.
class LearnedSensor::Remembered final : public DecodedField {
 public:
  FieldSource source;
};

LearnedSensor::LearnedSensor(const model::Bundle* bundle, std::shared_ptr<const kernels::PreparedDecoder> decoder,
                             EncoderPool* encoders)
    : bundle_(bundle), decoder_(std::move(decoder)), encoders_(encoders) {}

LearnedSensor::~LearnedSensor() = default;

bool LearnedSensor::steerable() const noexcept { return bundle_->manifest().encoder_kind == "two_look"; }

std::optional<Observation> LearnedSensor::look(const View& view, const gates::Expectation& gate, Where where) {
  const double unit_m = unit_of(bundle_->manifest(), gate.shape);
  std::optional<Eigen::Vector3d> prior_C;
  if (where == Where::kExpected) prior_C = view.X_WC.inverse() * gate.center_W / unit_m;
  std::span<const float> depth_m = view.depth_m;
  if (unit_m != 1.0) {
    depth_m_.resize(depth_m.size());
    const auto scale = static_cast<float>(1.0 / unit_m);
    std::transform(depth_m.begin(), depth_m.end(), depth_m_.begin(), [scale](float z_m) { return scale * z_m; });
    depth_m = depth_m_;
  }
  auto encoding = encoders_->encode(depth_m, view.camera, prior_C);
  if (!encoding) return std::nullopt;
  auto observation = observation_of(*bundle_, decoder_, *encoding, view.X_WC, gate, unit_m, &raw_);
  if (!observation) return std::nullopt;
  latent_ = std::move(encoding->latent);
  X_WC_ = view.X_WC;
  return observation;
}

std::shared_ptr<LearnedSensor::Remembered> LearnedSensor::free_field() {
  auto free = std::find_if(fields_.begin(), fields_.end(), [](const auto& field) { return field.use_count() == 1; });
  if (free == fields_.end()) free = fields_.insert(fields_.end(), std::make_shared<Remembered>());
  return *free;
}

std::shared_ptr<const gates::Field> LearnedSensor::field(const Eigen::Isometry3d& measured_X_WG,
                                                         const Eigen::Isometry3d& X_WG, const GateShape&) {
  // Moved by what separates this frame's fit from the estimate over all frames; the latent's part stays as it is.
  const Eigen::Isometry3d correction = X_WG * measured_X_WG.inverse();
  const auto field = free_field();
  field->source = {correction * X_WC_, latent_};
  field->decoder = raw_.decoder;
  field->decoder.place(field->source.X_WF);
  return field;
}

FieldSource LearnedSensor::source_of(const gates::Field& field) const {
  return static_cast<const Remembered&>(field).source;
}

Result<std::shared_ptr<const gates::Field>> LearnedSensor::restore(const FieldSource& source, const GateShape& shape) {
  const std::size_t expected = static_cast<std::size_t>(bundle_->decoder().latent_size);
  if (source.latent.size() != expected)
    return Error::invalid("latent", std::to_string(source.latent.size()) + " numbers", std::to_string(expected));
  const auto field = free_field();
  field->source = source;
  kernels::fold(decoder_, source.latent, source.X_WF, &field->decoder, unit_of(bundle_->manifest(), shape));
  return std::shared_ptr<const gates::Field>(field);
}

}  // namespace gatefield::perception
