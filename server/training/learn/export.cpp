#include "server/training/learn/export.h"

#include <fcntl.h>
#include <onnx/onnx_pb.h>
#include <stdio.h>

#include <cstring>
#include <initializer_list>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "common/base/whole_file.h"
#include "common/model/bundle.h"
#include "common/model/checksums.h"
#include "common/model/two_look.h"
#include "server/training/data/dataset.h"

namespace gatefield::training {
namespace {

using Shape = std::vector<std::int64_t>;

/// A weight that the graph needs isn't there; stays inside this file.
struct MissingWeight : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::string text(const Shape& shape) {
  std::string out = "[";
  for (std::size_t i = 0; i < shape.size(); ++i) out += (i == 0 ? "" : ", ") + std::to_string(shape[i]);
  return out + "]";
}

/// Writes an ONNX graph (opset 11) node by node. A tensor is named after the node that makes it.
class GraphWriter {
 public:
  GraphWriter(std::string name, const Weights& weights, std::string prefix)
      : weights_(weights), prefix_(std::move(prefix)) {
    model_.set_ir_version(6);
    model_.set_producer_name("gatefield-train");
    auto* opset = model_.add_opset_import();
    opset->set_domain("");
    opset->set_version(11);
    model_.mutable_graph()->set_name(std::move(name));
  }

  /// Dimension 0 is written as a free size N.
  std::string input(const std::string& name, const Shape& shape) {
    declare(model_.mutable_graph()->add_input(), name, shape);
    return name;
  }
  void output(const std::string& from, const std::string& name, const Shape& shape) {
    node("Identity", {from}, name);
    declare(model_.mutable_graph()->add_output(), name, shape);
  }

  std::string node(const std::string& op, const std::vector<std::string>& inputs, const std::string& name) {
    last_ = model_.mutable_graph()->add_node();
    last_->set_op_type(op);
    last_->set_name(name);
    for (const std::string& in : inputs) last_->add_input(in);
    last_->add_output(name);
    return name;
  }
  void ints(const char* name, const Shape& values) {
    auto* attribute = last_->add_attribute();
    attribute->set_name(name);
    attribute->set_type(onnx::AttributeProto::INTS);
    for (const std::int64_t value : values) attribute->add_ints(value);
  }
  void integer(const char* name, std::int64_t value) {
    auto* attribute = last_->add_attribute();
    attribute->set_name(name);
    attribute->set_type(onnx::AttributeProto::INT);
    attribute->set_i(value);
  }
  void word(const char* name, const char* value) {
    auto* attribute = last_->add_attribute();
    attribute->set_name(name);
    attribute->set_type(onnx::AttributeProto::STRING);
    attribute->set_s(value);
  }

  std::string constant(const std::string& name, const Shape& shape, const std::vector<float>& values) {
    auto* tensor = model_.mutable_graph()->add_initializer();
    tensor->set_name(name);
    tensor->set_data_type(onnx::TensorProto::FLOAT);
    for (const std::int64_t size : shape) tensor->add_dims(size);
    tensor->set_raw_data(values.data(), values.size() * sizeof(float));
    return name;
  }
  std::string integers(const std::string& name, const Shape& values) {
    auto* tensor = model_.mutable_graph()->add_initializer();
    tensor->set_name(name);
    tensor->set_data_type(onnx::TensorProto::INT64);
    tensor->add_dims(static_cast<std::int64_t>(values.size()));
    tensor->set_raw_data(values.data(), values.size() * sizeof(std::int64_t));
    return name;
  }

  const NamedTensor& weight(const std::string& name) const {
    const auto found = weights_.find(prefix_ + name);
    if (found == weights_.end()) throw MissingWeight("weight '" + prefix_ + name + "' is missing");
    return found->second;
  }
  std::string take(const std::string& name) {
    const NamedTensor& tensor = weight(name);
    return constant(name, tensor.shape, tensor.values);
  }

  std::string relu(const std::string& x) { return node("Relu", {x}, x + "_relu"); }

  /// Same-padded convolution; the rows [first, first + count) of layer `name` when count > 0.
  std::string conv(const std::string& x, const std::string& name, int stride, int first = 0, int count = 0,
                   const std::string& part = "") {
    const NamedTensor& kernel = weight(name + ".weight");
    if (kernel.shape.size() != 4)
      throw MissingWeight("weight '" + prefix_ + name + ".weight' has shape " + text(kernel.shape) +
                          ", expected four sizes");
    const std::string full = name + part;
    if (count > 0) {
      const NamedTensor& bias = weight(name + ".bias");
      Shape shape = kernel.shape;
      shape[0] = count;
      const auto row = static_cast<std::ptrdiff_t>(shape[1] * shape[2] * shape[3]);
      constant(full + ".weight", shape,
               {kernel.values.begin() + first * row, kernel.values.begin() + (first + count) * row});
      constant(full + ".bias", {count}, {bias.values.begin() + first, bias.values.begin() + first + count});
    } else {
      take(name + ".weight");
      take(name + ".bias");
    }
    const std::int64_t side = kernel.shape[2];
    std::string out = node("Conv", {x, full + ".weight", full + ".bias"}, full);
    ints("kernel_shape", {side, side});
    ints("strides", {stride, stride});
    ints("pads", {side / 2, side / 2, side / 2, side / 2});
    ints("dilations", {1, 1});
    integer("group", 1);
    return out;
  }

  std::string gemm(const std::string& x, const std::string& name) {
    take(name + ".weight");
    take(name + ".bias");
    std::string out = node("Gemm", {x, name + ".weight", name + ".bias"}, name);
    integer("transB", 1);
    return out;
  }

  /// Nearest-neighbour enlargement.
  std::string enlarge(const std::string& x, int rows, int columns, const std::string& name) {
    constant(name + "_roi", {0}, {});
    constant(name + "_scales", {4}, {1.0f, 1.0f, static_cast<float>(rows), static_cast<float>(columns)});
    std::string out = node("Resize", {x, name + "_roi", name + "_scales"}, name);
    word("mode", "nearest");
    word("coordinate_transformation_mode", "asymmetric");
    word("nearest_mode", "floor");
    return out;
  }

  std::string concat(const std::vector<std::string>& inputs, int axis, const std::string& name) {
    std::string out = node("Concat", inputs, name);
    integer("axis", axis);
    return out;
  }
  std::string reshape(const std::string& x, const Shape& shape, const std::string& name) {
    integers(name + "_shape", shape);
    return node("Reshape", {x, name + "_shape"}, name);
  }
  std::string transpose(const std::string& x, const Shape& order, const std::string& name) {
    std::string out = node("Transpose", {x}, name);
    ints("perm", order);
    return out;
  }
  std::string slice(const std::string& x, std::int64_t axis, std::int64_t from, std::int64_t to,
                    const std::string& name) {
    integers(name + "_from", {from});
    integers(name + "_to", {to});
    integers(name + "_axis", {axis});
    return node("Slice", {x, name + "_from", name + "_to", name + "_axis"}, name);
  }

  Status write(const std::filesystem::path& file) const {
    std::string bytes;
    if (!model_.SerializeToString(&bytes)) return Error{file.string() + " can't be written: it is larger than 2 GiB"};
    return write_file(file, bytes);
  }

 private:
  static void declare(onnx::ValueInfoProto* info, const std::string& name, const Shape& shape) {
    info->set_name(name);
    auto* type = info->mutable_type()->mutable_tensor_type();
    type->set_elem_type(onnx::TensorProto::FLOAT);
    for (const std::int64_t size : shape) {
      auto* dimension = type->mutable_shape()->add_dim();
      if (size == 0) {
        dimension->set_dim_param("N");
      } else {
        dimension->set_dim_value(size);
      }
    }
  }

  const Weights& weights_;
  std::string prefix_;
  onnx::ModelProto model_;
  onnx::NodeProto* last_ = nullptr;
};

// The graphs below mirror networks.cpp line by line; tests/unit/server/training holds them against libtorch's output.

Status write_first_look(const Weights& weights, const std::filesystem::path& file) {
  GraphWriter g("first_look", weights, "first.");
  const auto shape = model::look_shape(kImageWidth_px, kImageHeight_px);
  const std::int64_t blocks = shape.anchor_width() * shape.anchor_height();
  const auto heads = g.weight("maps.weight").shape[0] - 4;
  const auto features_n = g.weight("maps.weight").shape[1];
  const auto input = g.input("input", {1, model::kLookChannels, shape.height, shape.width});
  const auto anchors = g.input("anchors", {1, model::kAnchorChannels, shape.anchor_height(), shape.anchor_width()});

  const auto fine = g.relu(g.conv(input, "conv1", 2));
  const auto middle = g.relu(g.conv(g.relu(g.conv(fine, "conv2", 2)), "conv3", 1));
  auto deep = g.relu(g.conv(middle, "deep1", 2));
  const auto pooled =
      g.concat({g.node("GlobalAveragePool", {deep}, "mean"), g.node("GlobalMaxPool", {deep}, "most")}, 1, "pooled");
  const auto context = g.enlarge(g.conv(pooled, "context", 1), shape.height / 8, shape.width / 8, "context_everywhere");
  deep = g.relu(g.node("Add", {g.conv(deep, "deep2", 1), context}, "deep2_context"));
  deep = g.relu(g.conv(deep, "deep3", 1));
  const auto joined = g.relu(g.node("Add", {middle, g.enlarge(deep, 2, 2, "deep_enlarged")}, "joined"));
  const auto wide =
      g.relu(g.node("Add", {fine, g.enlarge(g.conv(joined, "lateral", 1), 2, 2, "lateral_enlarged")}, "wide"));
  g.constant("anchor_scale", {1}, {1.0f / model::kLookScale_m});
  const auto scaled = g.node("Mul", {anchors, "anchor_scale"}, "anchors_scaled");
  const auto features = g.relu(g.conv(g.concat({wide, scaled}, 1, "wide_anchors"), "head", 1));

  const auto offsets = g.conv(features, "maps", 1, 1, 3, ".offset");
  const auto logits = g.conv(features, "maps", 1, 4, static_cast<int>(heads), ".attention");
  const auto votes = g.node("Add", {g.slice(anchors, 1, 0, 3, "anchor_points"), offsets}, "votes");
  const auto votes_flat = g.transpose(g.reshape(votes, {1, 3, blocks}, "votes_flat"), {0, 2, 1}, "votes_rows");
  const auto features_flat =
      g.transpose(g.reshape(features, {1, features_n, blocks}, "features_flat"), {0, 2, 1}, "features_rows");
  const auto attention = g.node("Softmax", {g.reshape(logits, {1, heads, blocks}, "logits_flat")}, "attention");
  g.integer("axis", 2);
  const auto centers = g.reshape(g.node("MatMul", {attention, votes_flat}, "centers"), {1, heads * 3}, "centers_flat");
  const auto summary_features =
      g.reshape(g.node("MatMul", {attention, features_flat}, "attended"), {1, heads * features_n}, "attended_flat");
  const auto summary = g.concat({centers, summary_features}, 1, "summary");
  const auto correction = g.gemm(g.relu(g.gemm(summary, "correction1")), "correction2");
  std::vector<float> average(static_cast<std::size_t>(3 * 3 * heads), 0.0f);
  for (std::int64_t axis = 0; axis < 3; ++axis) {
    for (std::int64_t head = 0; head < heads; ++head) {
      average[static_cast<std::size_t>(axis * 3 * heads + 3 * head + axis)] = 1.0f / static_cast<float>(heads);
    }
  }
  g.constant("average.weight", {3, 3 * heads}, average);
  g.constant("average.bias", {3}, {0.0f, 0.0f, 0.0f});
  const auto mean = g.node("Gemm", {centers, "average.weight", "average.bias"}, "average");
  g.integer("transB", 1);
  g.output(g.node("Add", {mean, correction}, "coarse"), "center", {1, 3});
  return g.write(file);
}

Status write_second_look(const Weights& weights, const Design& design, const std::filesystem::path& file) {
  GraphWriter g("second_look", weights, "second.");
  const std::int64_t size = design.crop_size;
  auto x = g.input("crop", {1, model::kCropChannels, size, size});
  const auto context = g.input("context", {1, model::kCropContext});
  x = g.relu(g.conv(x, "conv1", design.crop_size / kCropFeatureSize));
  for (const char* layer : {"conv2", "conv3"}) x = g.relu(g.conv(x, layer, 2));
  for (const char* layer : {"conv4", "squeeze"}) x = g.relu(g.conv(x, layer, 1));
  const auto channels = g.weight("squeeze.weight").shape[0];
  x = g.reshape(x, {1, channels * (kCropFeatureSize / 4) * (kCropFeatureSize / 4)}, "flat");
  x = g.relu(g.gemm(g.concat({x, context}, 1, "flat_context"), "dense"));
  g.output(g.gemm(x, "output"), "code", {1, g.weight("output.bias").shape[0]});
  return g.write(file);
}

Status write_plain_encoder(const Weights& weights, const std::filesystem::path& file) {
  GraphWriter g("plain_encoder", weights, "encoder.");
  auto x = g.input("image", {1, 2, kImageHeight_px, kImageWidth_px});
  for (const char* layer : {"conv1", "conv2", "conv3", "conv4"}) x = g.relu(g.conv(x, layer, 2));
  x = g.relu(g.conv(x, "conv5", 1));
  x = g.reshape(x, {1, g.weight("dense.weight").shape[1]}, "flat");
  x = g.relu(g.gemm(x, "dense"));
  g.output(g.gemm(x, "output"), "code", {1, g.weight("output.bias").shape[0]});
  return g.write(file);
}

Status write_hyper_decoder(const Weights& weights, const std::filesystem::path& file) {
  GraphWriter g("hyper_decoder", weights, "decoder.");
  const auto z_n = g.weight("generator.weight").shape[1];
  const auto hidden = g.weight("generator.weight").shape[0] / 4;
  const auto latent = g.input("latent", {1, 3 + z_n});
  const auto points = g.input("points", {0, 3});
  const auto made = g.gemm(g.slice(latent, 1, 3, 3 + z_n, "z"), "generator");
  const auto matrix =
      g.transpose(g.reshape(g.slice(made, 1, 0, 3 * hidden, "matrix_flat"), {hidden, 3}, "matrix"), {1, 0}, "matrix_T");
  const auto bias = g.slice(made, 1, 3 * hidden, 4 * hidden, "bias");
  g.constant("inverse_scale", {1}, {static_cast<float>(1.0 / kHyperScale_m)});
  const auto offset = g.node(
      "Mul", {g.node("Sub", {points, g.slice(latent, 1, 0, 3, "center")}, "offset"), "inverse_scale"}, "offset_scaled");
  auto x = g.relu(g.node("Add", {g.node("MatMul", {offset, matrix}, "turned"), bias}, "moved"));
  x = g.relu(g.gemm(x, "layer0"));
  g.output(g.gemm(x, "layer1"), "sdf", {0, 1});
  return g.write(file);
}

Status write_concatenated_decoder(const Weights& weights, const std::filesystem::path& file) {
  GraphWriter g("concatenated_decoder", weights, "decoder.");
  const std::int64_t z_n = g.weight("layer0.weight").shape[1] - 3 - 6 * kPlainOctaves;
  const auto latent = g.input("latent", {1, z_n});
  const auto points = g.input("points", {0, 3});
  // z is repeated for every point: a column of zeros, one per point, added to the row.
  g.constant("nothing", {3, z_n}, std::vector<float>(static_cast<std::size_t>(3 * z_n), 0.0f));
  std::vector<std::string> parts = {g.node("Add", {g.node("MatMul", {points, "nothing"}, "rows"), latent}, "z"),
                                    points};
  for (int octave = 0; octave < kPlainOctaves; ++octave) {
    const std::string n = std::to_string(octave);
    g.constant("frequency" + n, {1}, {static_cast<float>((1 << octave) * std::numbers::pi / kPlainScale_m)});
    const auto angle = g.node("Mul", {points, "frequency" + n}, "angle" + n);
    parts.push_back(g.node("Sin", {angle}, "sin" + n));
    parts.push_back(g.node("Cos", {angle}, "cos" + n));
  }
  auto x = g.concat(parts, 1, "encoded");
  for (const char* layer : {"layer0", "layer1", "layer2"}) x = g.relu(g.gemm(x, layer));
  g.output(g.gemm(x, "layer3"), "sdf", {0, 1});
  return g.write(file);
}

model::Manifest make_manifest(const Design& design, const std::string& name) {
  const CameraModel& camera = dataset_camera();
  model::Manifest manifest;
  manifest.name = name;
  const bool concatenated = design.decoder == model::DecoderKind::kConcatenated;
  manifest.encoder_kind = design.plain() ? "plain" : "two_look";
  manifest.decoder_kind = design.decoder;
  manifest.latent_size = design.latent_size();
  manifest.encoding_octaves = concatenated ? kPlainOctaves : 0;
  manifest.position_scale_m = concatenated ? kPlainScale_m : kHyperScale_m;
  manifest.image_width_px = camera.width_px;
  manifest.image_height_px = camera.height_px;
  manifest.horizontal_fov_rad = 2.0 * std::atan(0.5 * camera.width_px / camera.fx_px);
  manifest.vertical_fov_rad = 2.0 * std::atan(0.5 * camera.height_px / camera.fy_px);
  manifest.min_depth_m = camera.min_depth_m;
  manifest.max_depth_m = camera.max_depth_m;
  manifest.cone_angle_rad = kGuideConeAngle_rad;
  manifest.gate_inner_half_m = GateShape{}.inner_half_m;
  manifest.crop_half_width_m = design.crop().half_width_m;
  manifest.crop_size_px = design.crop_size;
  manifest.validity_threshold = 0.5;
  return manifest;
}

}  // namespace

Status export_bundle(const Weights& weights, const Design& design, const std::string& name,
                     const std::filesystem::path& folder) {
  try {
    const std::filesystem::path part = folder.string() + ".part";
    std::filesystem::remove_all(part);
    std::filesystem::create_directories(part);
    const auto output = weights.find(design.plain() ? "encoder.output.bias" : "second.output.bias");
    if (output == weights.end() || output->second.shape != Shape{design.latent_size() + 2})
      return Error{"bundle " + folder.string() + ": the weights belong to other networks than the design '" +
                   std::string(design.name) + "'"};
    if (design.plain()) {
      if (Status status = write_plain_encoder(weights, part / "encoder.onnx"); !status) return status;
    } else {
      if (Status status = write_first_look(weights, part / "look1.onnx"); !status) return status;
      if (Status status = write_second_look(weights, design, part / "look2.onnx"); !status) return status;
    }
    Status decoder = design.decoder == model::DecoderKind::kHyper
                         ? write_hyper_decoder(weights, part / "decoder.onnx")
                         : write_concatenated_decoder(weights, part / "decoder.onnx");
    if (!decoder) return decoder;
    if (Status status = model::write_manifest(make_manifest(design, name), part / "manifest.txt"); !status)
      return status;
    if (Status status = model::write_checksums(part); !status) return status;
    if (std::filesystem::exists(folder)) {
      if (renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, folder.c_str(), RENAME_EXCHANGE) != 0) {
        return Error{"bundle " + folder.string() + " can't be replaced: " + std::strerror(errno)};
      }
      std::filesystem::remove_all(part);
    } else {
      std::filesystem::rename(part, folder);
    }
    return {};
  } catch (const std::exception& error) {
    return Error{"bundle " + folder.string() + ": " + error.what()};
  }
}

}  // namespace gatefield::training
