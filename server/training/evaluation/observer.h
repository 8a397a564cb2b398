#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/model/bundle.h"
#include "server/perception/learned/decoded_field.h"
#include "server/perception/learned/depth_encoder.h"
#include "server/perception/learned/hourglass_fit.h"
#include "server/training/data/dataset.h"
#include "server/training/evaluation/frame.h"

namespace gatefield::training {

/// True field values at points, as evaluation asks for them: a hybrid mix and a box around one gate.
struct QueryPoints {
  std::vector<float> mix_C, mix_m;  ///< [3 n] interleaved, camera frame; [n]
  std::vector<float> box_C, box_m;
  std::size_t near_n = 0;  ///< the first so many of the mix are near the surface
};
QueryPoints draw_points(const GateLabel& gate, Random* random);

/// One bundle as one thread uses it: the encoder, decoder kernels and fit that the server runs.
/// Thread-safe: no.
class Observer {
 public:
  /// @param bundle must outlive this
  static Result<std::unique_ptr<Observer>> create(const model::Bundle& bundle);

  const model::Bundle& bundle() const noexcept { return *bundle_; }
  perception::DepthEncoder& encoder() noexcept { return *encoder_; }
  /// The bundle's, on the best back end of this machine.
  const std::shared_ptr<const kernels::PreparedDecoder>& decoder() const noexcept { return decoder_; }
  /// Two looks know a centre of their own; for others a fit needs to be told where to begin.
  bool knows_center() const noexcept { return bundle_->manifest().encoder_kind == "two_look"; }

  std::optional<perception::Encoding> encode(std::span<const float> image_m,
                                             const std::optional<Eigen::Vector3d>& prior_C) {
    return encode(image_m, dataset_camera(), prior_C);
  }
  std::optional<perception::Encoding> encode(std::span<const float> image_m, const CameraModel& camera,
                                             const std::optional<Eigen::Vector3d>& prior_C);

  /// Centre and axis from the field alone, in the camera frame; empty when the field shows no gate.
  /// @param around_C  where to begin when the bundle doesn't know a centre
  struct Pose {
    Eigen::Vector3d center_C, axis_C;
    double rms_m = 0.0;  ///< of field minus hourglass
  };
  std::optional<Pose> fit(const perception::Encoding& encoding, const GateShape& shape,
                          const Eigen::Vector3d& around_C);

  /// All there is to say about one image of `gate`. @param prior_C what a fit of a bundle without a centre begins with,
  /// and in mode kPrior what the encoder gets
  Measured measure(std::span<const float> image_m, const SampleView& sample, const GateLabel& gate,
                   const QueryPoints& points, Mode mode, const Eigen::Vector3d& prior_C);

  /// How long encode() took, milliseconds; with a prior and without.
  std::vector<double> prior_ms, first_ms;

 private:
  Observer(const model::Bundle& bundle, std::unique_ptr<perception::DepthEncoder> encoder);
  std::span<const float> decode(const std::vector<float>& points_C);

  const model::Bundle* bundle_;
  std::unique_ptr<perception::DepthEncoder> encoder_;
  std::shared_ptr<const kernels::PreparedDecoder> decoder_;
  perception::DecodedField field_;
  std::vector<float> x_, y_, z_, value_m_;
};

}  // namespace gatefield::training
