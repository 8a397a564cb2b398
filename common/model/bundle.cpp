#include "common/model/bundle.h"

#include <cmath>
#include <exception>
#include <map>
#include <optional>

#include "common/model/onnx_file.h"
#include "common/model/two_look.h"

namespace gatefield::model {
namespace {

constexpr int kMaxLayers = 8;
constexpr int kMaxWidth = 256;
constexpr int kMaxLatent = 1024;
constexpr int kMaxOctaves = 16;

Error wrong(const std::filesystem::path& file, const std::string& what) { return Error{file.string() + ": " + what}; }

std::uint64_t fnv1a(const std::string& bytes, std::uint64_t hash) noexcept {
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return hash;
}

/// What reading the other files relies on.
Status check_manifest(const std::filesystem::path& file, const Manifest& manifest) {
  const auto expect = [&](bool good, const std::string& field, const std::string& value,
                          const std::string& expected) -> Status {
    if (good) return {};
    return wrong(file, field + " is " + value + ", expected " + expected);
  };
  const bool hyper = manifest.decoder_kind == DecoderKind::kHyper;
  const int least_latent = hyper ? 4 : 1;
  for (const Status& status :
       {expect(manifest.encoder_kind == "two_look" || manifest.encoder_kind == "plain", "encoder_kind",
               "'" + manifest.encoder_kind + "'", "'two_look' or 'plain'"),
        expect(manifest.latent_size >= least_latent && manifest.latent_size <= kMaxLatent, "latent_size",
               std::to_string(manifest.latent_size),
               std::to_string(least_latent) + " to " + std::to_string(kMaxLatent)),
        expect(manifest.encoding_octaves >= 0 && manifest.encoding_octaves <= kMaxOctaves, "encoding_octaves",
               std::to_string(manifest.encoding_octaves), "0 to " + std::to_string(kMaxOctaves)),
        expect(std::isfinite(manifest.position_scale_m) && manifest.position_scale_m >= 1e-3 &&
                   manifest.position_scale_m <= 1e3,
               "position_scale_m", std::to_string(manifest.position_scale_m), "0.001 to 1000"),
        expect(manifest.image_width_px >= 16 && manifest.image_width_px <= 4096 && manifest.image_width_px % 16 == 0,
               "image_width_px", std::to_string(manifest.image_width_px), "a multiple of 16 up to 4096"),
        expect(manifest.image_height_px >= 2 && manifest.image_height_px <= 4096 && manifest.image_height_px % 2 == 0,
               "image_height_px", std::to_string(manifest.image_height_px), "an even number up to 4096"),
        expect(manifest.crop_size_px >= 8 && manifest.crop_size_px <= 1024, "crop_size_px",
               std::to_string(manifest.crop_size_px), "8 to 1024")}) {
    if (!status.ok()) return status;
  }
  return {};
}

/// layer<i>.weight [outputs][inputs] and layer<i>.bias, or generator.*; outputs from the file, within bounds.
Result<Dense> read_dense(const std::filesystem::path& file, const onnx::GraphProto& graph, const std::string& name,
                         int inputs, int multiple_of, int max_outputs) {
  Result<std::vector<float>> weight = tensor(file, graph, name + ".weight", {kAnySize, inputs});
  if (!weight.ok()) return Error{weight.error()};
  const std::int64_t outputs = find_tensor(graph, name + ".weight")->dims(0);
  if (outputs < 1 || outputs > max_outputs || outputs % multiple_of != 0) {
    return wrong(file, "tensor '" + name + ".weight' has " + std::to_string(outputs) + " rows, expected " +
                           (multiple_of > 1 ? "a multiple of " + std::to_string(multiple_of) + " up to "
                                            : std::string("1 to ")) +
                           std::to_string(max_outputs));
  }
  Result<std::vector<float>> bias = tensor(file, graph, name + ".bias", {outputs});
  if (!bias.ok()) return Error{bias.error()};
  return Dense{inputs, static_cast<int>(outputs), std::move(weight).value(), std::move(bias).value()};
}

Result<DecoderWeights> read_decoder(const std::filesystem::path& file, const onnx::GraphProto& graph,
                                    const Manifest& manifest) {
  if (Status status = check_input(file, graph, "latent", {kAnySize, manifest.latent_size}); !status.ok())
    return Error{status.error()};
  if (Status status = check_input(file, graph, "points", {kAnySize, 3}); !status.ok()) return Error{status.error()};
  if (Status status = check_output(file, graph, "sdf", {kAnySize, 1}); !status.ok()) return Error{status.error()};

  DecoderWeights weights;
  weights.kind = manifest.decoder_kind;
  weights.latent_size = manifest.latent_size;
  weights.position_scale_m = manifest.position_scale_m;
  int inputs = 0;
  if (weights.kind == DecoderKind::kHyper) {
    Result<Dense> generator = read_dense(file, graph, "generator", manifest.latent_size - 3, 4, 4 * kMaxWidth);
    if (!generator.ok()) return Error{generator.error()};
    weights.generator = std::move(generator).value();
    inputs = weights.generator.outputs / 4;
  } else {
    if (find_tensor(graph, "generator.weight") != nullptr) {
      return wrong(
          file, "has a tensor 'generator.weight', expected none: the manifest says that the decoder is concatenated");
    }
    weights.encoding_octaves = manifest.encoding_octaves;
    inputs = manifest.latent_size + 3 + 6 * manifest.encoding_octaves;
  }
  const auto name_of = [](int layer) { return "layer" + std::to_string(layer); };
  int count = 0;
  while (count <= kMaxLayers && find_tensor(graph, name_of(count) + ".weight") != nullptr) ++count;
  if (count > kMaxLayers)
    return wrong(file, "has a tensor '" + name_of(kMaxLayers) + ".weight', expected at most " +
                           std::to_string(kMaxLayers) + " layers");
  if (count == 0)
    return wrong(file, "tensor 'layer0.weight' is missing, expected shape [any, " + std::to_string(inputs) + "]");
  for (int i = 0; i < count; ++i) {
    const bool last = i + 1 == count;
    Result<Dense> layer = read_dense(file, graph, name_of(i), inputs, 1, last ? 1 : kMaxWidth);
    if (!layer.ok()) return Error{layer.error()};
    inputs = layer->outputs;
    weights.layers.push_back(std::move(layer).value());
  }
  return weights;
}

/// The inputs and outputs that perception will feed and read (docs/training.md).
Status check_encoder(const std::filesystem::path& file, const std::string& name, const onnx::GraphProto& graph,
                     const Manifest& manifest) {
  struct Port {
    const char* name;
    std::vector<std::int64_t> shape;
  };
  std::vector<Port> inputs;
  Port output{"code", {1, manifest.latent_size + 2}};
  if (name == "look1.onnx") {
    const LookShape shape = look_shape(manifest.image_width_px, manifest.image_height_px);
    inputs = {{"input", {1, kLookChannels, shape.height, shape.width}},
              {"anchors", {1, kAnchorChannels, shape.anchor_height(), shape.anchor_width()}}};
    output = {"center", {1, 3}};
  } else if (name == "look2.onnx") {
    inputs = {{"crop", {1, kCropChannels, manifest.crop_size_px, manifest.crop_size_px}},
              {"context", {1, kCropContext}}};
  } else {
    inputs = {{"image", {1, 2, manifest.image_height_px, manifest.image_width_px}}};
  }
  for (const Port& input : inputs) {
    if (Status status = check_input(file, graph, input.name, input.shape); !status.ok()) return status;
  }
  return check_output(file, graph, output.name, output.shape);
}

struct Content {
  Manifest manifest;
  DecoderWeights decoder;
  std::uint64_t hash = 0xcbf29ce484222325ULL;
};

Result<Content> read_content(const std::filesystem::path& folder) {
  std::error_code code;
  if (!std::filesystem::is_directory(folder, code)) {
    return Error{folder.string() +
                 " is not a folder, expected a model bundle with manifest.txt, decoder.onnx and the encoder's files"};
  }
  Content content;
  std::map<std::string, std::string> files;  // sorted by name, as the hash wants them
  Result<std::string> manifest_text = read_file(folder / "manifest.txt");
  if (!manifest_text.ok()) return Error{manifest_text.error()};
  files["manifest.txt"] = std::move(manifest_text).value();
  Result<Manifest> manifest = read_manifest(folder / "manifest.txt");
  if (!manifest.ok()) return Error{manifest.error()};
  content.manifest = std::move(manifest).value();
  if (Status status = check_manifest(folder / "manifest.txt", content.manifest); !status.ok())
    return Error{status.error()};

  std::vector<std::string> names{"decoder.onnx"};
  if (content.manifest.encoder_kind == "two_look") {
    names.insert(names.end(), {"look1.onnx", "look2.onnx"});
  } else {
    names.emplace_back("encoder.onnx");
  }
  for (const std::string& name : names) {
    const std::filesystem::path file = folder / name;
    Result<std::string> bytes = read_file(file);
    if (!bytes.ok()) return Error{bytes.error()};
    const Result<onnx::ModelProto> network = parse_onnx(file, *bytes);
    if (!network.ok()) return Error{network.error()};
    if (name == "decoder.onnx") {
      Result<DecoderWeights> decoder = read_decoder(file, network->graph(), content.manifest);
      if (!decoder.ok()) return Error{decoder.error()};
      content.decoder = std::move(decoder).value();
    } else if (Status status = check_encoder(file, name, network->graph(), content.manifest); !status.ok()) {
      return Error{status.error()};
    }
    files[name] = std::move(bytes).value();
  }
  for (const auto& [name, bytes] : files) content.hash = fnv1a(bytes, fnv1a(name, content.hash));
  return content;
}

}  // namespace

Result<Bundle> Bundle::read(const std::filesystem::path& folder) {
  // What reading can still throw (no memory, an impossible path) ends here, as a sentence like everything else.
  try {
    Result<Content> content = read_content(folder);
    if (!content.ok()) return Error{content.error()};
    Bundle bundle;
    bundle.folder_ = folder;
    bundle.manifest_ = std::move(content.value().manifest);
    bundle.decoder_ = std::move(content.value().decoder);
    bundle.hash_ = content->hash;
    return bundle;
  } catch (const std::exception& exception) {
    return Error{folder.string() + ": can't read the model bundle: " + exception.what()};
  }
}

}  // namespace gatefield::model
