#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/course/course.h"
#include "common/model/bundle.h"
#include "server/perception/gate_sensor.h"
#include "server/perception/learned/decoded_field.h"
#include "server/perception/learned/encoder_pool.h"

namespace gatefield::perception {

/// What an encoding says of a gate: its validity, and centre and axis of the opening, fitted to its field's values.
/// The encoding is in the network's metres (of an image whose depths were divided by unit_m), the observation and the
/// field in the world's. How far to trust it follows from the network's: a gate of twice the size is measured from
/// twice as far as well.
/// @param decoder  the bundle's, prepared by the back end that computes the field
/// @param X_WC     pose of the camera at the capture
/// @param gate     where the fit begins when the encoding has no centre of its own
/// @param unit_m   metres of the world in one of the network's
/// @param raw      out: the field as captured
/// @return empty: it shows no gate (manifest's threshold), or no hourglass explains the field
/// Thread-safe: yes, on different `raw`.   Real-time safe: no (raw's memory).
std::optional<Observation> observation_of(const model::Bundle& bundle,
                                          const std::shared_ptr<const kernels::PreparedDecoder>& decoder,
                                          const Encoding& encoding, const Eigen::Isometry3d& X_WC,
                                          const gates::Expectation& gate, double unit_m, DecodedField* raw);

/// Metres of the world in one of the network's, for a gate of this shape: its opening over the one that the network was
/// trained with. The network sees any gate as one of that opening, at a distance that is smaller by as much.
double unit_of(const model::Manifest& manifest, const GateShape& shape) noexcept;

/// Openings that a network can be shown, against the one it was trained with: smaller ones are too near, and larger
/// ones too far for what a camera sees.
inline constexpr double kSmallestUnit = 0.3, kLargestUnit = 3.0;

/// Says which gate of the course is too small or too large for the network.
Status check_openings(const model::Manifest& manifest, const Course& course);

/// The product's sensor (paper, E_theta and g_phi): an encoder turns the image into a latent, the decoder's field
/// speaks of the gate's surroundings, and the gate's pose is what the field itself says, fitted to decoder values. The
/// network knows one opening; images and fields of gates of other sizes are scaled (unit_of()).
/// Thread-safe: no (perception).   Real-time safe: no.
class LearnedSensor final : public GateSensor {
 public:
  /// @param decoder   the bundle's, prepared by the back end that computes the fields
  /// @param encoders  of this bundle; both outlive this
  /// Gates that are looked for pass check_openings().
  LearnedSensor(const model::Bundle* bundle, std::shared_ptr<const kernels::PreparedDecoder> decoder,
                EncoderPool* encoders);
  ~LearnedSensor() override;

  bool steerable() const noexcept override;
  std::optional<Observation> look(const View& view, const gates::Expectation& gate, Where where) override;
  std::shared_ptr<const gates::Field> field(const Eigen::Isometry3d& measured_X_WG, const Eigen::Isometry3d& X_WG,
                                            const GateShape& shape) override;
  FieldSource source_of(const gates::Field& field) const override;
  Result<std::shared_ptr<const gates::Field>> restore(const FieldSource& source, const GateShape& shape) override;

 private:
  class Remembered;
  std::shared_ptr<Remembered> free_field();

  const model::Bundle* bundle_;
  std::shared_ptr<const kernels::PreparedDecoder> decoder_;
  EncoderPool* encoders_;
  DecodedField raw_;            ///< scratch: the newest latent as captured
  std::vector<float> depth_m_;  ///< scratch: an image in the network's metres
  std::vector<float> latent_;   ///< of the newest observation
  Eigen::Isometry3d X_WC_ = Eigen::Isometry3d::Identity();
  /// All fields made so far. One that nobody else holds is folded into again: references are taken and dropped by the
  /// thread that looks alone.
  std::vector<std::shared_ptr<Remembered>> fields_;
};

}  // namespace gatefield::perception
