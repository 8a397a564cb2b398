#include "common/model/bundle.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <optional>
#include <utility>

#include "common/base/random.h"
#include "common/base/whole_file.h"
#include "common/model/checksums.h"
#include "common/model/decoder_reading.h"
#include "common/model/onnx_file.h"
#include "common/model/onnx_graph.h"
#include "common/model/onnx_simplify.h"
#include "common/model/test_vectors.h"
#include "common/model/two_look.h"

namespace gatefield::model {
namespace {

constexpr std::int64_t kMaxEncoderNumbers = 16'000'000;
constexpr std::size_t kMaxName = 63;
/// Beyond this an encoder's answer is no latent, centre or logit.
constexpr double kMaxAnswer = 1e6;
constexpr int kMaxLatent = 1024;
constexpr int kMaxOctaves = 16;

std::uint64_t fnv1a(const std::string& bytes, std::uint64_t hash) noexcept {
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return hash;
}

/// What reading the other files relies on.
Status check_manifest(const std::filesystem::path& file, const Manifest& manifest) {
  const auto expect = [&](bool good, const std::string& field, const std::string& value,
                          const std::string& expected) -> Status {
    if (good) return {};
    return Error::invalid(field, value, expected).at(file.string());
  };
  const bool hyper = manifest.decoder_kind == DecoderKind::kHyper;
  const int least_latent = hyper ? 4 : 1;
  for (const Status& status :
       {expect(manifest.name.size() <= kMaxName &&
                   std::all_of(manifest.name.begin(), manifest.name.end(), [](char c) { return c >= ' ' && c <= '~'; }),
               "name", in_quotes(manifest.name), "up to " + std::to_string(kMaxName) + " printable letters"),
        expect(manifest.encoder_kind == "two_look" || manifest.encoder_kind == "plain", "encoder_kind",
               in_quotes(manifest.encoder_kind), "'two_look' or 'plain'"),
        expect(manifest.latent_size >= least_latent && manifest.latent_size <= kMaxLatent, "latent_size",
               std::to_string(manifest.latent_size),
               std::to_string(least_latent) + " to " + std::to_string(kMaxLatent)),
        expect(manifest.encoding_octaves >= 0 && manifest.encoding_octaves <= kMaxOctaves, "encoding_octaves",
               std::to_string(manifest.encoding_octaves), "0 to " + std::to_string(kMaxOctaves)),
        expect(std::isfinite(manifest.position_scale_m) && manifest.position_scale_m >= 1e-3 &&
                   manifest.position_scale_m <= 1e3,
               "position_scale_m", std::to_string(manifest.position_scale_m), "0.001 to 1000"),
        expect(manifest.image_width_px >= 16 && manifest.image_width_px <= 1280 && manifest.image_width_px % 16 == 0,
               "image_width_px", std::to_string(manifest.image_width_px), "a multiple of 16 up to 1280"),
        expect(manifest.image_height_px >= 2 && manifest.image_height_px <= 1024 && manifest.image_height_px % 2 == 0,
               "image_height_px", std::to_string(manifest.image_height_px), "an even number up to 1024"),
        expect(manifest.crop_size_px >= 8 && manifest.crop_size_px <= 512, "crop_size_px",
               std::to_string(manifest.crop_size_px), "8 to 512")}) {
    if (!status.ok()) return status;
  }
  return {};
}

Result<Manifest> checked_manifest(const std::filesystem::path& file, const std::string& text) {
  Result<Manifest> manifest = parse_manifest(text, file);
  if (!manifest.ok()) return manifest;
  if (Status status = check_manifest(file, *manifest); !status) return status.failure();
  return manifest;
}

/// What perception feeds a network of the encoder, and what it reads (docs/bring-your-own-network.md).
struct Ports {
  std::vector<Port> inputs;
  Port output;
};

Ports ports_of(const std::string& name, const Manifest& manifest) {
  Ports ports;
  ports.output = {"code", {1, manifest.latent_size + 2}};
  if (name == "look1.onnx") {
    const LookShape shape = look_shape(manifest.image_width_px, manifest.image_height_px);
    ports.inputs = {{"input", {1, kLookChannels, shape.height, shape.width}},
                    {"anchors", {1, kAnchorChannels, shape.anchor_height(), shape.anchor_width()}}};
    ports.output = {"center", {1, 3}};
  } else if (name == "look2.onnx") {
    ports.inputs = {{"crop", {1, kCropChannels, manifest.crop_size_px, manifest.crop_size_px}},
                    {"context", {1, kCropContext}}};
  } else {
    ports.inputs = {{"image", {1, 2, manifest.image_height_px, manifest.image_width_px}}};
  }
  return ports;
}

NetworkTensor tensor_of(const std::string& name, const Array& array) {
  return {name, {array.shape.begin(), array.shape.end()}, {array.values.begin(), array.values.end()}};
}

/// A file of the bundle, and what lies beside it.
struct Content {
  const std::string& bytes;
  Beside beside;
  std::filesystem::path vectors;      ///< "encoder.test.onnx"
  const std::string* test = nullptr;  ///< its content; null: there is none
};

Status hold(const Content& content, const Graph& graph, const std::vector<Port>& ports, const std::string& output) {
  if (content.test == nullptr) return {};
  return hold_test_vectors(content.vectors, *content.test, graph, ports, output,
                           {kMaxEncoderMultiplyAdds, kMaxEncoderNumbers});
}

/// Checks a network of the encoder by running it slowly on numbers of a depth image's size.
Result<Network> check_encoder(const std::filesystem::path& file, const Content& content, const Manifest& manifest) {
  const Ports ports = ports_of(file.filename().string(), manifest);
  const Result<onnx::ModelProto> model = parse_onnx(file, content.bytes, ports.output.name, content.beside);
  if (!model.ok()) return model.failure();
  if (Status status = check_ports(file, model->graph(), ports.inputs, ports.output.name); !status)
    return status.failure();
  const Result<Graph> graph = Graph::compile(file, *model);
  if (!graph.ok()) return graph.failure();

  Network network;
  network.file = file.filename().string();
  Random random(1, Stream("gatefield.encoder_trial"));
  std::map<std::string, Array> inputs;
  for (const Port& port : ports.inputs) {
    Array& array = inputs[port.name];
    array.shape = port.shape;
    std::size_t count = 1;
    for (const std::int64_t size : port.shape) count *= static_cast<std::size_t>(size);
    for (std::size_t i = 0; i < count; ++i) array.values.push_back(random.uniform());  // 24 bits: exact as float
    network.inputs.push_back(tensor_of(port.name, array));
  }
  const Result<Evaluation> evaluation = graph->evaluate(inputs, {kMaxEncoderMultiplyAdds, kMaxEncoderNumbers});
  if (!evaluation.ok()) return evaluation.failure();
  network.multiply_adds = evaluation->multiply_adds;
  const int slot = graph->slot(ports.output.name);
  const Array* const answer = slot < 0 ? nullptr : evaluation->values[static_cast<std::size_t>(slot)];
  if (answer == nullptr || answer->shape != ports.output.shape) {
    return file_error(file, "gives " + in_quotes(ports.output.name) + " of shape " +
                                (answer == nullptr ? "nothing" : shape_text(answer->shape)) + ", expected " +
                                shape_text(ports.output.shape));
  }
  for (std::size_t i = 0; i < answer->values.size(); ++i) {
    if (!(std::abs(answer->values[i]) <= kMaxAnswer)) {
      return file_error(file, "gives " + std::to_string(answer->values[i]) + " as element " + std::to_string(i) +
                                  " of " + in_quotes(ports.output.name) +
                                  " for inputs between 0 and 1, expected a size up to a million");
    }
  }
  network.output = tensor_of(ports.output.name, *answer);
  if (Status status = hold(content, *graph, ports.inputs, ports.output.name); !status) return status.failure();
  network.graph = std::make_shared<const Graph>(graph->folded(*evaluation, slot));
  network.bytes =
      std::make_shared<const std::string>(simplified(*model, *network.graph, ports.output.name).SerializeAsString());
  return network;
}

/// The name of the size that the file leaves open at the front of an input; "?": it has none. Empty: it is fixed.
std::string open_rows(const onnx::GraphProto& graph, const std::string& input) {
  for (const auto& value : graph.input()) {
    if (value.name() != input || value.type().tensor_type().shape().dim_size() == 0) continue;
    const auto& rows = value.type().tensor_type().shape().dim(0);
    if (rows.has_dim_value()) return "";
    return rows.dim_param().empty() ? "?" : rows.dim_param();
  }
  return "";
}

Result<DecoderWeights> check_decoder(const std::filesystem::path& file, const Content& content,
                                     const Manifest& manifest) {
  const Result<onnx::ModelProto> model = parse_onnx(file, content.bytes, "sdf", content.beside);
  if (!model.ok()) return model.failure();
  const std::vector<Port> ports{{"latent", {1, manifest.latent_size}}, {"points", {kOpenSize, 3}}};
  if (Status status = check_ports(file, model->graph(), ports, "sdf"); !status) return status.failure();
  // One latent for all points; or one for each, which then are all the same. A batch axis of its own is of one.
  const std::string latents = open_rows(model->graph(), "latent");
  const bool repeats = !latents.empty() && latents == open_rows(model->graph(), "points");
  const Result<Graph> graph = Graph::compile(file, *model);
  if (!graph.ok()) return graph.failure();
  Result<DecoderWeights> weights = read_decoder(file, *graph, repeats, manifest);
  if (!weights.ok()) return weights;
  const std::vector<Port> sizes{{"latent", {repeats ? kOpenSize : 1, manifest.latent_size}},
                                {"points", {kOpenSize, 3}}};
  if (Status status = hold(content, *graph, sizes, "sdf"); !status) return status.failure();
  return weights;
}

std::vector<std::string> encoder_files(const Manifest& manifest) {
  if (manifest.encoder_kind == "two_look") return {"look1.onnx", "look2.onnx"};
  return {"encoder.onnx"};
}

}  // namespace

Result<Bundle> Bundle::load(const std::filesystem::path& folder, const Take& take) {
  Bundle bundle;
  bundle.folder_ = folder;
  std::optional<Checksums> checksums;
  const Result<std::optional<std::string>> sums = take(kChecksumsFile);
  if (!sums.ok()) return sums.failure();
  if (*sums) {
    Result<Checksums> listed = Checksums::parse(folder, **sums);
    if (!listed.ok()) return listed.failure();
    checksums = std::move(listed).value();
  } else {
    bundle.warnings_.push_back(folder.string() + " has no " + kChecksumsFile +
                               ": a damaged file may go unnoticed; make one: " + checksums_command(folder));
  }

  // Each is held against its hash before anything of it is read: of a damaged file nothing else is worth saying.
  std::map<std::string, std::string> files;  // sorted by name, as the hash wants them
  const auto use = [&](const std::string& name, std::optional<std::string> bytes) -> Status {
    if (!bytes) return file_error(folder / name, "is missing or not a file");
    if (Status status = checksums ? checksums->hold(name, *bytes) : Status(); !status) return status;
    files[name] = std::move(*bytes);
    return {};
  };
  const auto use_named = [&](const std::string& name) -> Status {
    Result<std::optional<std::string>> bytes = take(name);
    return bytes.ok() ? use(name, std::move(bytes).value()) : Status(bytes.failure());
  };
  if (Status status = use_named("manifest.txt"); !status) return status.failure();
  Result<Manifest> manifest = checked_manifest(folder / "manifest.txt", files["manifest.txt"]);
  if (!manifest.ok()) return manifest.failure();
  bundle.manifest_ = std::move(manifest).value();
  const std::vector<std::string> encoders = encoder_files(bundle.manifest_);
  if (Status status = use_named("decoder.onnx"); !status) return status.failure();
  for (const std::string& name : encoders)
    if (Status status = use_named(name); !status) return status.failure();

  // What an ONNX file says lies beside it. A link could lead out of the folder.
  const Beside beside = [&](const std::string& name) -> Result<const std::string*> {
    if (files.contains(name)) return &files[name];
    std::error_code code;
    if (std::filesystem::is_symlink(folder / name, code))
      return file_error(folder / name, "is a link, expected a file of the bundle's own");
    Result<std::optional<std::string>> there = take(name);
    if (!there.ok()) return there.failure();
    if (!*there) return static_cast<const std::string*>(nullptr);
    if (Status status = use(name, std::move(there).value()); !status) return status.failure();
    return &files[name];
  };
  const auto content = [&](const std::string& name) -> Result<Content> {
    const std::string vectors = std::filesystem::path(name).stem().string() + ".test.onnx";
    Result<const std::string*> test = beside(vectors);
    if (!test.ok()) return test.failure();
    return Content{files[name], beside, folder / vectors, *test};
  };
  const Result<Content> decoder_content = content("decoder.onnx");
  if (!decoder_content.ok()) return decoder_content.failure();
  Result<DecoderWeights> decoder = check_decoder(folder / "decoder.onnx", *decoder_content, bundle.manifest_);
  if (!decoder.ok()) return decoder.failure();
  bundle.decoder_ = std::move(decoder).value();
  for (const std::string& name : encoders) {
    const Result<Content> encoder_content = content(name);
    if (!encoder_content.ok()) return encoder_content.failure();
    Result<Network> network = check_encoder(folder / name, *encoder_content, bundle.manifest_);
    if (!network.ok()) return network.failure();
    if (network->multiply_adds > kNominalEncoderMultiplyAdds) {
      bundle.warnings_.push_back((folder / name).string() + " takes " +
                                 std::to_string(network->multiply_adds / 1'000'000) +
                                 " million multiplications an image, expected at most " +
                                 std::to_string(kNominalEncoderMultiplyAdds / 1'000'000) +
                                 " million: the perception thread may not keep up with the camera");
    }
    bundle.networks_.push_back(std::move(network).value());
  }
  for (const auto& [name, bytes] : files) bundle.hash_ = fnv1a(bytes, fnv1a(name, bundle.hash_));
  return bundle;
}

Result<Bundle> Bundle::parse(const std::filesystem::path& folder, const std::map<std::string, std::string>& files) {
  // What reading can still throw (no memory) ends here, as a sentence like everything else.
  try {
    return load(folder, [&](const std::string& name) -> Result<std::optional<std::string>> {
      const auto found = files.find(name);
      return found == files.end() ? std::nullopt : std::optional(found->second);
    });
  } catch (const std::exception& exception) {
    return file_error(folder, std::string("can't read the model bundle: ") + exception.what());
  }
}

Result<Bundle> Bundle::read(const std::filesystem::path& folder) {
  try {
    std::error_code code;
    if (!std::filesystem::is_directory(folder, code)) {
      return Error{folder.string() +
                       " is not a folder, expected a model bundle with manifest.txt, decoder.onnx and the "
                       "encoder's files",
                   ErrorCode::kUnreadable};
    }
    return load(folder, [&](const std::string& name) -> Result<std::optional<std::string>> {
      std::error_code problem;
      if (!std::filesystem::exists(folder / name, problem)) return std::optional<std::string>();
      if (!std::filesystem::is_regular_file(folder / name, problem))  // a pipe would be waited for
        return file_error(folder / name, "is missing or not a file");
      Result<std::string> bytes = read_file(folder / name, kMaxFileBytes);
      if (!bytes.ok()) return bytes.failure();
      return std::optional(std::move(bytes).value());
    });
  } catch (const std::exception& exception) {  // an impossible path
    return file_error(folder, std::string("can't read the model bundle: ") + exception.what());
  }
}

}  // namespace gatefield::model
