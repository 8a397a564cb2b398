#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "common/geometry/camera.h"
#include "common/model/bundle.h"
#include "common/model/decoder_reading.h"
#include "common/model/onnx_file.h"
#include "server/kernels/backend.h"
#include "server/perception/learned/depth_encoder.h"

/// Networks as torch.onnx.export writes them (tests/data/pytorch/make.py), held against what PyTorch computes with
/// them.
namespace gatefield::perception {
namespace {

namespace fs = std::filesystem;

const fs::path kData = fs::path(GATEFIELD_SOURCE_DIR) / "tests/data/pytorch";
constexpr int kLatent = 12;

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<float> expected(const std::string& name) {
  std::ifstream in(kData / "expected.txt");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (first == name) return {std::istream_iterator<float>(words), {}};
  }
  return {};
}

/// The same numbers as in make.py.
std::vector<float> wave(std::size_t count, double step, double start, double factor = 1.0) {
  std::vector<float> values;
  for (std::size_t i = 0; i < count; ++i)
    values.push_back(static_cast<float>(factor) * static_cast<float>(std::sin(step * static_cast<double>(i) + start)));
  return values;
}

std::vector<float> depth_image() {
  std::vector<float> depth = wave(16 * 32, 0.37, 0.0, 2.5);
  for (std::size_t i = 0; i < depth.size(); ++i) depth[i] = i % 11 == 0 ? 0.0f : depth[i] + 3.0f;
  return depth;
}

/// opset17's bundle with another file in it.
Result<model::Bundle> bundle_with(const std::string& other, const fs::path& file) {
  std::map<std::string, std::string> files;
  for (const std::string name : {"manifest.txt", "encoder.onnx", "decoder.onnx"})
    files[name] = content(kData / "opset17" / name);
  files[other] = content(kData / file);
  return model::Bundle::parse("pytorch", files);
}

/// Encodes the image and expects PyTorch's code.
void expect_code(const model::Bundle& bundle, const std::string& name) {
  const auto encoder = DepthEncoder::create(bundle);
  ASSERT_TRUE(encoder.ok()) << encoder.error();
  const model::Manifest& manifest = bundle.manifest();
  const CameraModel camera = camera_from_fov(manifest.image_width_px, manifest.image_height_px,
                                             manifest.horizontal_fov_rad, manifest.vertical_fov_rad);
  const auto encoding = (*encoder)->encode(depth_image(), camera, std::nullopt);
  ASSERT_TRUE(encoding.has_value());
  const std::vector<float> code = expected(name);
  ASSERT_EQ(code.size(), kLatent + 2u);
  ASSERT_EQ(encoding->latent.size(), static_cast<std::size_t>(kLatent));
  for (std::size_t i = 0; i < kLatent; ++i) EXPECT_NEAR(encoding->latent[i], code[i], 2e-5) << i;
  EXPECT_NEAR(encoding->validity, 1.0 / (1.0 + std::exp(-code[kLatent])), 2e-5);
  EXPECT_NEAR(encoding->predicted_error_m, std::exp(code[kLatent + 1]) - 0.005, 5e-5);
}

/// Folds the decoder and expects PyTorch's field.
void expect_sdf(const model::DecoderWeights& weights, const std::string& name) {
  const std::vector<float> points = wave(60, 1.3, 0.5, 2.0);
  std::vector<float> x, y, z, sdf(20), reference(20);
  for (std::size_t n = 0; n < 20; ++n) {
    x.push_back(points[3 * n]);
    y.push_back(points[3 * n + 1]);
    z.push_back(points[3 * n + 2]);
  }
  kernels::FoldedDecoder folded;
  kernels::fold(kernels::best_backend().prepare(weights), wave(static_cast<std::size_t>(weights.latent_size), 0.7, 1.0),
                Eigen::Isometry3d::Identity(), &folded);
  folded.decode(x, y, z, sdf);
  kernels::decode_reference(folded, x, y, z, reference);
  const std::vector<float> answers = expected(name);
  ASSERT_EQ(answers.size(), 20u);
  for (std::size_t n = 0; n < 20; ++n) {
    EXPECT_NEAR(sdf[n], answers[n], 2e-5) << n;
    EXPECT_NEAR(reference[n], answers[n], 2e-5) << n;
  }
}

TEST(PyTorch, TheExamplesBundleComputesTheSameHere) {
  for (const std::string opset : {"opset11", "opset14", "opset17"}) {
    SCOPED_TRACE(opset);
    const auto bundle = model::Bundle::read(kData / opset);
    ASSERT_TRUE(bundle.ok()) << bundle.error();
    EXPECT_TRUE(bundle->warnings().empty());
    ASSERT_EQ(bundle->decoder().layers.size(), 3u);
    expect_code(*bundle, "code");
    expect_sdf(bundle->decoder(), "sdf");
  }
}

TEST(PyTorch, DecodersMayBeWrittenInManyWays) {
  for (const std::string way : {"repeated", "stacked", "rows", "split"}) {
    SCOPED_TRACE(way);
    const auto bundle = bundle_with("decoder.onnx", "decoder_" + way + ".onnx");
    ASSERT_TRUE(bundle.ok()) << bundle.error();
    EXPECT_EQ(bundle->decoder().layers.size(), 3u);
    expect_sdf(bundle->decoder(), way);
  }
}

TEST(PyTorch, AHyperDecoderIsUnderstoodToo) {
  model::Manifest manifest = model::read_manifest(kData / "opset17/manifest.txt").value();
  manifest.decoder_kind = model::DecoderKind::kHyper;
  manifest.latent_size = 3 + kLatent;
  manifest.encoding_octaves = 0;
  const auto file = model::parse_onnx("decoder.onnx", content(kData / "decoder_hyper.onnx"));
  ASSERT_TRUE(file.ok()) << file.error();
  const auto graph = model::Graph::compile("decoder.onnx", *file);
  ASSERT_TRUE(graph.ok()) << graph.error();
  const auto weights = model::read_decoder("decoder.onnx", *graph, false, manifest);
  ASSERT_TRUE(weights.ok()) << weights.error();
  EXPECT_EQ(weights->generator.outputs, 4 * 16);
  expect_sdf(*weights, "hyper");
}

TEST(PyTorch, UsualLayersOfEncodersComputeTheSameHere) {
  for (const std::string opset : {"11", "17"}) {
    SCOPED_TRACE(opset);
    const auto bundle = bundle_with("encoder.onnx", "assorted" + opset + ".onnx");
    ASSERT_TRUE(bundle.ok()) << bundle.error();
    expect_code(*bundle, "assorted");
  }
}

}  // namespace
}  // namespace gatefield::perception
