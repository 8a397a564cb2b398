#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace gatefield::model {

/// A dense layer y = W x + b. W is row-major [outputs][inputs].
struct Dense {
  int inputs = 0;
  int outputs = 0;
  std::vector<float> weight;
  std::vector<float> bias;
};

enum class DecoderKind {
  kConcatenated,  ///< as published: the first layer sees [z, PE(p)]
  kHyper,         ///< ours: z makes the first layer's weights and bias on p - centre (docs/training.md)
};

/// Decoder weights as they stand in decoder.onnx. Hidden activation is ReLU, the last layer is linear, one output: s in
/// metres. kConcatenated: layers[0] has latent_size + 3 + 6 L inputs in the order [z, p, sin(2^0 pi p / S), cos(2^0 pi
/// p / S), sin(2^1 ...) ...]
///   (each a triple x y z), p in the camera frame, S = position_scale_m.
/// kHyper: `generator` maps z (latent without its leading 3 centre coordinates) to 4 h numbers: W1 row-major [h][3],
/// then b1 [h];
///   first hidden = relu(W1 (p - centre) / S + b1); `layers` are the ones after it.
struct DecoderWeights {
  DecoderKind kind = DecoderKind::kHyper;
  int latent_size = 0;            ///< kHyper: 3 + z
  int encoding_octaves = 0;       ///< L of the positional encoding
  double position_scale_m = 1.0;  ///< S
  Dense generator;                ///< kHyper only
  std::vector<Dense> layers;
};

/// manifest.txt of a bundle (protobuf text format, schema common/model/manifest.proto).
struct Manifest {
  std::string name;
  std::string encoder_kind;  ///< "two_look" or "plain"
  DecoderKind decoder_kind = DecoderKind::kHyper;
  int latent_size = 0;
  int image_width_px = 160;
  int image_height_px = 90;
  double horizontal_fov_rad = 0.0;
  double vertical_fov_rad = 0.0;
  double min_depth_m = 0.3;
  double max_depth_m = 10.0;
  int encoding_octaves = 0;
  double position_scale_m = 1.0;
  double cone_angle_rad = 0.0;
  double gate_inner_half_m = 0.5;
  double crop_half_width_m = 1.35;  ///< two_look: the second look's crop
  int crop_size_px = 48;
  double validity_threshold = 0.5;
};

/// A trained model: manifest.txt and its ONNX files (look1.onnx, look2.onnx or encoder.onnx; decoder.onnx) in one
/// folder. Reading checks every file against the manifest before anything runs it; errors name file, tensor and what
/// was expected.
class Bundle {
 public:
  static Result<Bundle> read(const std::filesystem::path& folder);

  const Manifest& manifest() const noexcept { return manifest_; }
  const DecoderWeights& decoder() const noexcept { return decoder_; }
  const std::filesystem::path& folder() const noexcept { return folder_; }
  std::uint64_t hash() const noexcept {
    return hash_;
  }  ///< FNV-1a over all files: says which latents fit which decoder

 private:
  std::filesystem::path folder_;
  Manifest manifest_;
  DecoderWeights decoder_;
  std::uint64_t hash_ = 0;
};

Status write_manifest(const Manifest& manifest, const std::filesystem::path& file);
Result<Manifest> read_manifest(const std::filesystem::path& file);

}  // namespace gatefield::model
