#include "server/perception/learned/learned_sensor.h"

#include <algorithm>
#include <cmath>

#include "server/perception/learned/hourglass_fit.h"

namespace gatefield::perception {
namespace {

/// A field that no hourglass explains better than this says nothing about a gate.
constexpr double kPoorFit_m = 0.16;

/// How much a frame's centre and axis can be trusted: grows with distance (held-out evaluation of the shipped model),
/// and with how badly an hourglass explains the field.
gates::GateMeasurement measurement_of(const HourglassFit& fit, double distance_m) {
  gates::GateMeasurement measurement;
  measurement.X_WG = fit.X_WG;
  measurement.center_sigma_m = std::hypot(0.02 + 0.012 * distance_m, fit.rms_m);
  measurement.axis_sigma_rad = std::hypot(0.04 + 0.015 * distance_m, 1.5 * fit.rms_m);
  return measurement;
}

}  // namespace

std::optional<Observation> observation_of(const model::Bundle& bundle,
                                          const std::shared_ptr<const kernels::PreparedDecoder>& decoder,
                                          const Encoding& encoding, const Eigen::Isometry3d& X_WC,
                                          const gates::Expectation& gate, DecodedField* raw) {
  const model::Manifest& manifest = bundle.manifest();
  if (!(encoding.validity >= manifest.validity_threshold)) return std::nullopt;
  kernels::fold(decoder, encoding.latent, X_WC, &raw->decoder);
  const Eigen::Vector3d glimpse_W = X_WC * encoding.center_C.cast<double>();
  const bool has_center = bundle.decoder().kind == model::DecoderKind::kHyper;
  const HourglassFit fit =
      fit_hourglass(*raw, gate.shape, manifest.cone_angle_rad, has_center ? glimpse_W : gate.center_W, gate.axis_W);
  if (!fit.ok || fit.rms_m > kPoorFit_m) return std::nullopt;
  const double distance_m = (fit.X_WG.translation() - X_WC.translation()).norm();
  return Observation{measurement_of(fit, distance_m), encoding.validity, glimpse_W};
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
  std::optional<Eigen::Vector3d> prior_C;
  if (where == Where::kExpected) prior_C = view.X_WC.inverse() * gate.center_W;
  auto encoding = encoders_->encode(view.depth_m, view.camera, prior_C);
  if (!encoding) return std::nullopt;
  auto observation = observation_of(*bundle_, decoder_, *encoding, view.X_WC, gate, &raw_);
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

Result<std::shared_ptr<const gates::Field>> LearnedSensor::restore(const FieldSource& source, const GateShape&) {
  const std::size_t expected = static_cast<std::size_t>(bundle_->decoder().latent_size);
  if (source.latent.size() != expected)
    return Error::invalid("latent", std::to_string(source.latent.size()) + " numbers", std::to_string(expected));
  const auto field = free_field();
  field->source = source;
  kernels::fold(decoder_, source.latent, source.X_WF, &field->decoder);
  return std::shared_ptr<const gates::Field>(field);
}

}  // namespace gatefield::perception
