#pragma once

#include <numbers>
#include <string>
#include <vector>

#include "common/model/bundle.h"
#include "common/model/two_look.h"
#include "tests/unit/common/model/onnx_builder.h"

/// Whole bundles with networks of a few neurons.
namespace gatefield::model {

inline constexpr int kSmallZ = 12;

inline Manifest small_manifest(bool two_look) {
  Manifest manifest;
  manifest.name = "small";
  manifest.encoder_kind = two_look ? "two_look" : "plain";
  manifest.decoder_kind = two_look ? DecoderKind::kHyper : DecoderKind::kConcatenated;
  manifest.latent_size = two_look ? 3 + kSmallZ : kSmallZ;
  manifest.encoding_octaves = two_look ? 0 : 4;
  manifest.image_width_px = 32;
  manifest.image_height_px = 16;
  manifest.crop_size_px = 16;
  manifest.horizontal_fov_rad = 1.5;
  manifest.vertical_fov_rad = 1.0;
  manifest.cone_angle_rad = 0.35;
  manifest.position_scale_m = 2.0;
  return manifest;
}

inline std::string small_manifest_text(bool two_look) { return manifest_text(small_manifest(two_look)); }

/// z makes a layer of `hidden`, then one layer of `second`, then s.
inline OnnxBuilder small_hyper_decoder(bool raw = true, int hidden = 16, int second = 20, double scale_m = 2.0) {
  OnnxBuilder b;
  b.input("latent", {1, 3 + kSmallZ}).input("points", {0, 3}).output("sdf", {0, 1});
  b.dense("generator", kSmallZ, 4 * hidden, raw).dense("layer0", hidden, second, raw).dense("layer1", second, 1, raw);
  b.integers("0", {0}).integers("1", {1}).integers("3", {3}).integers("end", {1 << 20});
  b.integers("3h", {3 * hidden}).integers("matrix_shape", {hidden, 3});
  b.constant("inverse_scale", {1}, {static_cast<float>(1.0 / scale_m)});
  b.node("Slice", {"latent", "0", "3", "1"}, "center").node("Slice", {"latent", "3", "end", "1"}, "z");
  b.gemm("z", "generator", "made");
  b.node("Slice", {"made", "0", "3h", "1"}, "matrix_flat").node("Slice", {"made", "3h", "end", "1"}, "bias");
  b.node("Reshape", {"matrix_flat", "matrix_shape"}, "matrix");
  b.node("Transpose", {"matrix"}, "matrix_T").with("perm", std::vector<std::int64_t>{1, 0});
  b.node("Sub", {"points", "center"}, "offset").node("Mul", {"offset", "inverse_scale"}, "scaled");
  b.node("MatMul", {"scaled", "matrix_T"}, "turned").node("Add", {"turned", "bias"}, "moved");
  b.node("Relu", {"moved"}, "hidden0");
  b.gemm("hidden0", "layer0", "second").node("Relu", {"second"}, "hidden1").gemm("hidden1", "layer1", "sdf");
  return b;
}

/// Layers of these widths on [z, p, sin, cos].
inline OnnxBuilder small_concatenated_decoder(const std::vector<int>& widths = {20, 16}, int octaves = 4,
                                              double scale_m = 2.0) {
  OnnxBuilder b;
  b.input("latent", {1, kSmallZ}).input("points", {0, 3}).output("sdf", {0, 1});
  b.constant("nothing", {3, kSmallZ}, std::vector<float>(3 * kSmallZ, 0.0f));
  b.node("MatMul", {"points", "nothing"}, "rows").node("Add", {"rows", "latent"}, "z");
  std::vector<std::string> parts{"z", "points"};
  for (int octave = 0; octave < octaves; ++octave) {
    const std::string n = std::to_string(octave);
    b.constant("frequency" + n, {1}, {static_cast<float>((1 << octave) * std::numbers::pi / scale_m)});
    b.node("Mul", {"points", "frequency" + n}, "angle" + n);
    b.node("Sin", {"angle" + n}, "sin" + n).node("Cos", {"angle" + n}, "cos" + n);
    parts.insert(parts.end(), {"sin" + n, "cos" + n});
  }
  b.node("Concat", parts, "x").with("axis", 1);
  int inputs = kSmallZ + 3 + 6 * octaves;
  std::string x = "x";
  for (std::size_t i = 0; i <= widths.size(); ++i) {
    const std::string n = std::to_string(i);
    const bool last = i == widths.size();
    b.dense("layer" + n, inputs, last ? 1 : widths[i]);
    b.gemm(x, "layer" + n, last ? "sdf" : "x" + n);
    if (last) break;
    b.node("Relu", {"x" + n}, "hidden" + n);
    inputs = widths[i];
    x = "hidden" + n;
  }
  return b;
}

/// A convolution, its mean over the image, and a dense layer to `outputs` numbers.
inline OnnxBuilder small_encoder(const std::string& name, const std::vector<int>& shape, const std::string& output,
                                 int outputs) {
  OnnxBuilder b;
  b.input(name, shape).output(output, {1, outputs});
  b.weight("conv1.weight", {8, shape[1], 3, 3}).weight("conv1.bias", {8}).dense("dense", 8, outputs);
  b.node("Conv", {name, "conv1.weight", "conv1.bias"}, "conv1");
  b.with("kernel_shape", {3, 3}).with("strides", {2, 2}).with("pads", {1, 1, 1, 1});
  b.node("Relu", {"conv1"}, "bent").node("GlobalAveragePool", {"bent"}, "mean").node("Flatten", {"mean"}, "flat");
  return b;
}

inline OnnxBuilder small_plain_encoder() {
  return small_encoder("image", {1, 2, 16, 32}, "code", kSmallZ + 2).gemm("flat", "dense", "code");
}
inline OnnxBuilder small_look1() {
  const LookShape shape = look_shape(32, 16);
  OnnxBuilder b = small_encoder("input", {1, kLookChannels, shape.height, shape.width}, "center", 3);
  b.input("anchors", {1, kAnchorChannels, shape.anchor_height(), shape.anchor_width()});
  b.gemm("flat", "dense", "moved").weight("points.weight", {3, kAnchorChannels}).weight("points.bias", {3});
  b.node("GlobalMaxPool", {"anchors"}, "nearest").node("Flatten", {"nearest"}, "nearest_flat");
  return b.gemm("nearest_flat", "points", "point").node("Add", {"point", "moved"}, "center");
}
inline OnnxBuilder small_look2() {
  OnnxBuilder b = small_encoder("crop", {1, kCropChannels, 16, 16}, "code", 3 + kSmallZ + 2);
  b.input("context", {1, kCropContext}).node("Concat", {"flat", "context"}, "all").with("axis", 1);
  b.dense("output", 8 + kCropContext, 3 + kSmallZ + 2);
  return b.gemm("all", "output", "code");
}

}  // namespace gatefield::model
