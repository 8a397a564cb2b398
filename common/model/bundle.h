#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace gatefield::model {

class Graph;  // onnx_graph.h

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

/// Decoder weights as decoder.onnx has them, whatever its nodes are called (decoder_reading.h). Hidden activation is
/// ReLU, the last layer is linear, one output: s in metres. With p in the camera frame and S = position_scale_m:
/// kConcatenated: layers[0] has latent_size + 3 + 6 L inputs in the order
///   [z, p, sin(2^0 pi p / S), cos(2^0 pi p / S), sin(2^1 ...) ...], each sine and cosine a triple x y z.
/// kHyper: `generator` maps z (the latent without its leading 3 centre coordinates) to 4 h numbers, W1 row-major
/// [h][3], then b1 [h], and `layers` are the ones after
///   first hidden = relu(W1 (p - centre) / S + b1).
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

/// What a network takes or gives: float, row-major.
struct NetworkTensor {
  std::string name;
  std::vector<int> shape;
  std::vector<float> values;
};

/// An encoder's network that has been checked, and what it has to answer: whoever runs it by other means (oneDNN,
/// OpenCV) first sees whether that gives the same.
struct Network {
  std::string file;                          ///< "encoder.onnx"
  std::shared_ptr<const Graph> graph;        ///< folded for the shapes of `inputs`
  std::shared_ptr<const std::string> bytes;  ///< the same as an ONNX file, simplified (onnx_simplify.h)
  std::int64_t multiply_adds = 0;
  std::vector<NetworkTensor> inputs;  ///< a test case
  NetworkTensor output;               ///< what ONNX's definition makes of it, computed in double precision
};

/// More multiplications in one encoder's network are an error, or worth a warning.
inline constexpr std::int64_t kMaxEncoderMultiplyAdds = 200'000'000;
inline constexpr std::int64_t kNominalEncoderMultiplyAdds = 30'000'000;

/// A trained model: manifest.txt and its ONNX files (look1.onnx, look2.onnx or encoder.onnx; decoder.onnx) in one
/// folder, and their SHA256SUMS (docs/bring-your-own-network.md). Reading holds every file against its hash (and warns
/// where there is none) and against the manifest, before anything runs it: operators, shapes, sizes, and by a slow
/// evaluation of its own that they compute what they should. Errors name file, node or tensor and what was expected.
/// Thread-safe: yes (const).   Real-time safe: no.
class Bundle {
 public:
  static Result<Bundle> read(const std::filesystem::path& folder);
  /// The same from memory.
  /// @param files   content by name; further files are ignored
  /// @param folder  stands in messages
  static Result<Bundle> parse(const std::filesystem::path& folder, const std::map<std::string, std::string>& files);

  const Manifest& manifest() const noexcept { return manifest_; }
  const DecoderWeights& decoder() const noexcept { return decoder_; }
  /// The encoder's networks: look1.onnx and look2.onnx, or encoder.onnx.
  const std::vector<Network>& networks() const noexcept { return networks_; }
  const std::filesystem::path& folder() const noexcept { return folder_; }
  /// FNV-1a over all files: says which latents fit which decoder.
  std::uint64_t hash() const noexcept { return hash_; }
  /// Sentences about what works but shouldn't be so; empty for most.
  const std::vector<std::string>& warnings() const noexcept { return warnings_; }

 private:
  /// The content of the file of this name; empty: there is none.
  using Take = std::function<Result<std::optional<std::string>>(const std::string& name)>;
  static Result<Bundle> load(const std::filesystem::path& folder, const Take& take);

  std::filesystem::path folder_;
  Manifest manifest_;
  DecoderWeights decoder_;
  std::vector<Network> networks_;
  std::vector<std::string> warnings_;
  std::uint64_t hash_ = 0xcbf29ce484222325ULL;
};

/// manifest.txt as text.
std::string manifest_text(const Manifest& manifest);
Status write_manifest(const Manifest& manifest, const std::filesystem::path& file);
Result<Manifest> read_manifest(const std::filesystem::path& file);
/// @param text  the content of `file`, which stands in messages
Result<Manifest> parse_manifest(const std::string& text, const std::filesystem::path& file);

}  // namespace gatefield::model
