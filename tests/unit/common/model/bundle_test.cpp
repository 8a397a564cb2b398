#include "common/model/bundle.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <string>

#include "common/base/random.h"
#include "tests/unit/common/model/onnx_builder.h"

namespace gatefield::model {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Manifest two_look_manifest() {
  Manifest manifest;
  manifest.name = "test";
  manifest.encoder_kind = "two_look";
  manifest.decoder_kind = DecoderKind::kHyper;
  manifest.latent_size = 3 + 12;
  manifest.horizontal_fov_rad = 1.5;
  manifest.vertical_fov_rad = 1.0;
  manifest.cone_angle_rad = 0.35;
  manifest.position_scale_m = 2.0;
  return manifest;
}

OnnxBuilder hyper_decoder(bool raw = true) {
  OnnxBuilder builder;
  builder.input("latent", {1, 15}).input("points", {0, 3}).output("sdf", {0, 1});
  builder.dense("generator", 12, 4 * 16, raw).dense("layer0", 16, 20, raw).dense("layer1", 20, 1, raw);
  for (const char* type : {"Slice", "Gemm", "Reshape", "MatMul", "Add", "Relu", "Gemm", "Relu", "Gemm"})
    builder.node(type);
  return builder;
}

OnnxBuilder look1() {
  OnnxBuilder builder;
  builder.input("input", {1, 13, 48, 80}).input("anchors", {1, 4, 24, 40}).output("center", {1, 3});
  builder.weight("conv1.weight", {8, 13, 3, 3}).node("Conv").node("Relu").node("Softmax").node("MatMul");
  return builder;
}

OnnxBuilder look2() {
  OnnxBuilder builder;
  builder.input("crop", {1, 7, 48, 48}).input("context", {1, 3}).output("code", {1, 17});
  builder.weight("conv1.weight", {8, 7, 5, 5}).node("Conv").node("Relu").node("Flatten").node("Concat").node("Gemm");
  return builder;
}

class BundleTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() / ("gatefield-" + std::to_string(getpid()) + "-" + info->name());
    std::filesystem::create_directories(folder_);
    const Status status = write_manifest(two_look_manifest(), folder_ / "manifest.txt");
    ASSERT_TRUE(status.ok()) << status.error();
    write("decoder.onnx", hyper_decoder().bytes());
    write("look1.onnx", look1().bytes());
    write("look2.onnx", look2().bytes());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  std::string content(const std::string& name) const {
    std::ifstream in(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write_manifest_again(const Manifest& manifest) const {
    ASSERT_TRUE(write_manifest(manifest, folder_ / "manifest.txt").ok());
  }

  /// What reading the folder complains about; empty when it doesn't.
  std::string complaint() const {
    const Result<Bundle> bundle = Bundle::read(folder_);
    return bundle.ok() ? "" : bundle.error();
  }

  std::filesystem::path folder_;
};

TEST_F(BundleTest, ReadsAGoodOne) {
  OnnxBuilder decoder = hyper_decoder();
  const Result<Bundle> bundle = Bundle::read(folder_);
  ASSERT_TRUE(bundle.ok()) << bundle.error();
  EXPECT_EQ(bundle->folder(), folder_);
  EXPECT_EQ(bundle->manifest().name, "test");
  const DecoderWeights& weights = bundle->decoder();
  EXPECT_EQ(weights.kind, DecoderKind::kHyper);
  EXPECT_EQ(weights.latent_size, 15);
  EXPECT_EQ(weights.position_scale_m, 2.0);
  EXPECT_EQ(weights.generator.inputs, 12);
  EXPECT_EQ(weights.generator.outputs, 64);
  ASSERT_EQ(weights.layers.size(), 2u);
  EXPECT_EQ(weights.layers[0].inputs, 16);
  EXPECT_EQ(weights.layers[0].outputs, 20);
  EXPECT_EQ(weights.layers[1].inputs, 20);
  EXPECT_EQ(weights.layers[1].outputs, 1);
  float third = 0;
  std::memcpy(&third, decoder.tensor("layer0.weight").raw_data().data() + 3 * sizeof(float), sizeof third);
  EXPECT_EQ(weights.layers[0].weight[3], third);
  EXPECT_EQ(weights.layers[0].bias.size(), 20u);
}

TEST_F(BundleTest, TakesWeightsAsListsToo) {
  const Result<Bundle> raw = Bundle::read(folder_);
  write("decoder.onnx", hyper_decoder(false).bytes());
  const Result<Bundle> listed = Bundle::read(folder_);
  ASSERT_TRUE(raw.ok() && listed.ok());
  EXPECT_EQ(raw->decoder().layers[0].weight, listed->decoder().layers[0].weight);
  EXPECT_EQ(raw->decoder().generator.bias, listed->decoder().generator.bias);
}

TEST_F(BundleTest, ReadsAPlainEncoderWithAConcatenatedDecoder) {
  Manifest manifest = two_look_manifest();
  manifest.encoder_kind = "plain";
  manifest.decoder_kind = DecoderKind::kConcatenated;
  manifest.latent_size = 12;
  manifest.encoding_octaves = 4;
  write_manifest_again(manifest);
  OnnxBuilder decoder, encoder;
  decoder.input("latent", {1, 12}).input("points", {0, 3}).output("sdf", {0, 1}).node("Gemm");
  decoder.dense("layer0", 12 + 3 + 24, 32).dense("layer1", 32, 16).dense("layer2", 16, 1);
  encoder.input("image", {1, 2, 90, 160}).output("code", {1, 14}).node("Conv");
  write("decoder.onnx", decoder.bytes());
  write("encoder.onnx", encoder.bytes());
  std::filesystem::remove(folder_ / "look1.onnx");
  const Result<Bundle> bundle = Bundle::read(folder_);
  ASSERT_TRUE(bundle.ok()) << bundle.error();
  EXPECT_EQ(bundle->decoder().encoding_octaves, 4);
  EXPECT_EQ(bundle->decoder().layers.size(), 3u);
  EXPECT_TRUE(bundle->decoder().generator.weight.empty());

  manifest.encoding_octaves = 5;
  write_manifest_again(manifest);
  EXPECT_THAT(complaint(),
              AllOf(HasSubstr("decoder.onnx"), HasSubstr("'layer0.weight' has shape [32, 39], expected [any, 45]")));
}

TEST_F(BundleTest, HashChangesWithEveryFileAndNothingElse) {
  const std::uint64_t before = Bundle::read(folder_)->hash();
  EXPECT_EQ(Bundle::read(folder_)->hash(), before);
  write("README", "not part of the bundle");
  EXPECT_EQ(Bundle::read(folder_)->hash(), before);
  for (const std::string name : {"decoder.onnx", "look1.onnx", "look2.onnx"}) {
    const std::string good = content(name);
    onnx::ModelProto model;
    ASSERT_TRUE(model.ParseFromString(good));
    model.set_producer_name("somebody else");
    write(name, model.SerializeAsString());
    const Result<Bundle> bundle = Bundle::read(folder_);
    ASSERT_TRUE(bundle.ok()) << bundle.error();
    EXPECT_NE(bundle->hash(), before) << name;
    write(name, good);
  }
  Manifest manifest = two_look_manifest();
  manifest.name = "another";
  write_manifest_again(manifest);
  EXPECT_NE(Bundle::read(folder_)->hash(), before);
}

TEST_F(BundleTest, SaysWhichFileIsMissing) {
  for (const std::string name : {"manifest.txt", "decoder.onnx", "look1.onnx", "look2.onnx"}) {
    const std::string good = content(name);
    std::filesystem::remove(folder_ / name);
    EXPECT_THAT(complaint(), AllOf(HasSubstr(name), HasSubstr("is missing"))) << name;
    std::filesystem::create_directory(folder_ / name);
    EXPECT_THAT(complaint(), HasSubstr(name)) << "a folder of that name";
    std::filesystem::remove(folder_ / name);
    write(name, good);
  }
  EXPECT_EQ(complaint(), "");
  const Result<Bundle> nowhere = Bundle::read(folder_ / "nowhere");
  ASSERT_FALSE(nowhere.ok());
  EXPECT_THAT(nowhere.error(), HasSubstr("nowhere is not a folder"));
}

TEST_F(BundleTest, RefusesEveryTruncation) {
  for (const std::string name : {"decoder.onnx", "look1.onnx", "look2.onnx"}) {
    const std::string good = content(name);
    for (std::size_t size = 0; size < good.size(); size += 1 + good.size() / 97) {
      write(name, good.substr(0, size));
      EXPECT_THAT(complaint(), HasSubstr(name)) << size << " of " << good.size() << " bytes";
    }
    write(name, good);
  }
  EXPECT_EQ(complaint(), "");
}

TEST_F(BundleTest, RefusesWhatIsNoOnnxFile) {
  const std::string zeros(1000, '\0');
  for (const std::string& bytes : {std::string("#!/bin/sh\nexit 1\n"), std::string("\x89PNG\r\n\x1a\n"), zeros,
                                   std::string("\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff")}) {
    write("look1.onnx", bytes);
    EXPECT_THAT(complaint(), AllOf(HasSubstr("look1.onnx"), HasSubstr("ONNX")));
  }
}

TEST_F(BundleTest, SurvivesDamagedBytes) {
  // Whatever the damage does, reading comes back with an answer; damage to a weight's bits may well go unseen.
  Random random(3);
  for (const std::string name : {"decoder.onnx", "look2.onnx", "manifest.txt"}) {
    const std::string good = content(name);
    int refused = 0;
    for (int i = 0; i < 300; ++i) {
      std::string damaged = good;
      for (int j = 0; j < 8; ++j)
        damaged[random.below(static_cast<std::uint32_t>(good.size()))] = static_cast<char>(random.bits());
      write(name, damaged);
      const Result<Bundle> bundle = Bundle::read(folder_);
      if (!bundle.ok()) {
        ++refused;
        EXPECT_FALSE(bundle.error().empty());
      }
    }
    EXPECT_GT(refused, 0) << name;
    write(name, good);
  }
}

TEST_F(BundleTest, RefusesFilesThatWouldFillTheMemory) {
  // Two bytes each in the file, far more once parsed.
  onnx::ModelProto model = hyper_decoder().model();
  for (int i = 0; i < 400'000; ++i) model.mutable_graph()->add_node();
  write("decoder.onnx", model.SerializeAsString());
  EXPECT_THAT(complaint(), AllOf(HasSubstr("decoder.onnx"), HasSubstr("too many")));

  std::filesystem::resize_file(folder_ / "decoder.onnx", (64u << 20) + 1);
  EXPECT_THAT(complaint(), AllOf(HasSubstr("decoder.onnx"), HasSubstr("at most 67108864")));
}

TEST_F(BundleTest, RefusesNestingWithoutEnd) {
  onnx::ModelProto model = hyper_decoder().model();
  onnx::GraphProto* graph = model.mutable_graph();
  for (int i = 0; i < 40; ++i) graph = graph->add_node()->add_attribute()->mutable_g();
  write("decoder.onnx", model.SerializeAsString());
  EXPECT_THAT(complaint(), HasSubstr("decoder.onnx"));
}

TEST_F(BundleTest, NamesTheTensorOfTheWrongShape) {
  OnnxBuilder decoder = hyper_decoder();
  decoder.tensor("layer1.weight").set_dims(1, 19);
  decoder.tensor("layer1.weight").mutable_raw_data()->resize(19 * 4);
  write("decoder.onnx", decoder.bytes());
  EXPECT_THAT(complaint(),
              AllOf(HasSubstr("decoder.onnx"), HasSubstr("'layer1.weight' has shape [1, 19], expected [any, 20]")));

  decoder = hyper_decoder();
  decoder.tensor("layer0.bias").set_dims(0, 10);
  decoder.tensor("layer0.bias").mutable_raw_data()->resize(10 * 4);
  write("decoder.onnx", decoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("'layer0.bias' has shape [10], expected [20]"));

  Manifest manifest = two_look_manifest();
  manifest.latent_size = 3 + 13;
  write("decoder.onnx", hyper_decoder().bytes());
  write_manifest_again(manifest);
  EXPECT_THAT(complaint(), AllOf(HasSubstr("input 'latent'"), HasSubstr("[1, 15]"), HasSubstr("[any, 16]")));
}

TEST_F(BundleTest, NamesTheTensorThatIsMissingOrTooMany) {
  OnnxBuilder decoder = hyper_decoder();
  decoder.tensor("generator.bias").set_name("generator.offset");
  write("decoder.onnx", decoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("'generator.bias' is missing, expected shape [64]"));

  decoder = hyper_decoder();
  decoder.tensor("layer0.weight").set_name("first.weight");
  write("decoder.onnx", decoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("'layer0.weight' is missing"));

  decoder = hyper_decoder();
  decoder.weight("layer0.bias", {20});
  write("decoder.onnx", decoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("'layer0.bias' is there twice"));

  OnnxBuilder deep;
  deep.input("latent", {1, 15}).input("points", {0, 3}).output("sdf", {0, 1}).node("Gemm").dense("generator", 12, 64);
  for (int i = 0; i < 8; ++i) deep.dense("layer" + std::to_string(i), 16, 16);
  deep.dense("layer8", 16, 1);
  write("decoder.onnx", deep.bytes());
  EXPECT_THAT(complaint(), HasSubstr("at most 8 layers"));
}

TEST_F(BundleTest, RefusesWidthsThatTheKernelsDoNotTake) {
  const auto decoder = [](int generated, int hidden, int outputs) {
    OnnxBuilder builder;
    builder.input("latent", {1, 15}).input("points", {0, 3}).output("sdf", {0, 1}).node("Gemm");
    builder.dense("generator", 12, generated).dense("layer0", generated / 4, hidden).dense("layer1", hidden, outputs);
    return builder.bytes();
  };
  write("decoder.onnx", decoder(64, 256, 1));
  EXPECT_EQ(complaint(), "");
  write("decoder.onnx", decoder(64, 257, 1));
  EXPECT_THAT(complaint(), HasSubstr("'layer0.weight' has 257 rows, expected 1 to 256"));
  write("decoder.onnx", decoder(62, 16, 1));
  EXPECT_THAT(complaint(), HasSubstr("'generator.weight' has 62 rows, expected a multiple of 4 up to 1024"));
  write("decoder.onnx", decoder(64, 16, 2));
  EXPECT_THAT(complaint(), HasSubstr("'layer1.weight' has 2 rows, expected 1 to 1"));
}

TEST_F(BundleTest, RefusesWeightsThatAreNoNumbers) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    OnnxBuilder decoder = hyper_decoder();
    std::memcpy(decoder.tensor("layer0.weight").mutable_raw_data()->data() + 4 * 7, &bad, 4);
    write("decoder.onnx", decoder.bytes());
    EXPECT_THAT(complaint(), AllOf(HasSubstr("decoder.onnx"), HasSubstr("'layer0.weight'"), HasSubstr("at element 7"),
                                   HasSubstr("finite")));

    decoder = hyper_decoder(false);
    decoder.tensor("generator.bias").set_float_data(5, bad);
    write("decoder.onnx", decoder.bytes());
    EXPECT_THAT(complaint(), AllOf(HasSubstr("'generator.bias'"), HasSubstr("at element 5")));
    write("decoder.onnx", hyper_decoder().bytes());

    OnnxBuilder encoder = look1();
    std::memcpy(encoder.tensor("conv1.weight").mutable_raw_data()->data(), &bad, 4);
    write("look1.onnx", encoder.bytes());
    EXPECT_THAT(complaint(), AllOf(HasSubstr("look1.onnx"), HasSubstr("'conv1.weight'")));
    write("look1.onnx", look1().bytes());
  }
}

TEST_F(BundleTest, RefusesTensorsThatDoNotHoldWhatTheySay) {
  const auto with = [&](const std::function<void(onnx::TensorProto&)>& spoil) {
    OnnxBuilder encoder = look2();
    spoil(encoder.tensor("conv1.weight"));
    write("look2.onnx", encoder.bytes());
    return complaint();
  };
  EXPECT_THAT(with([](auto& t) { t.mutable_raw_data()->pop_back(); }), HasSubstr("5599 bytes of data, expected 5600"));
  EXPECT_THAT(with([](auto& t) { t.clear_raw_data(); }), HasSubstr("has 0 numbers, expected 1400"));
  EXPECT_THAT(with([](auto& t) { t.add_float_data(1); }), HasSubstr("data twice"));
  EXPECT_THAT(with([](auto& t) { t.set_dims(0, -8); }), HasSubstr("impossible shape"));
  EXPECT_THAT(with([](auto& t) { t.set_dims(0, std::int64_t{1} << 62); }), HasSubstr("impossible shape"));
  EXPECT_THAT(with([](auto& t) {
                for (int i = 0; i < 4; ++i) t.set_dims(i, 1 << 20);
              }),
              HasSubstr("impossible shape"));
  EXPECT_THAT(with([](auto& t) { t.set_data_type(onnx::TensorProto::DOUBLE); }), HasSubstr("data type 11"));
  EXPECT_THAT(with([](auto& t) { t.set_data_type(onnx::TensorProto::STRING); }), HasSubstr("data type 8"));
  EXPECT_THAT(with([](auto& t) { t.set_data_location(onnx::TensorProto::EXTERNAL); }), HasSubstr("in another file"));
  EXPECT_THAT(with([](auto& t) { t.add_external_data()->set_value("/etc/passwd"); }), HasSubstr("in another file"));
  EXPECT_THAT(with([](auto&) {}), "");
}

TEST_F(BundleTest, RefusesForeignOperators) {
  for (const std::string type : {"Loop", "If", "Scan", "GridSample", "", "relu"}) {
    OnnxBuilder encoder = look1();
    encoder.node(type);
    write("look1.onnx", encoder.bytes());
    EXPECT_THAT(complaint(),
                AllOf(HasSubstr("look1.onnx"), HasSubstr("'node5'"), HasSubstr("operator '" + type + "'")));
  }
  OnnxBuilder encoder = look1();
  encoder.node("Relu").graph().mutable_node(4)->set_domain("com.example");
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("domain 'com.example'"));

  encoder = look1();
  encoder.graph().mutable_node(0)->add_attribute()->mutable_g();
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("attribute"));

  encoder = look1();
  encoder.model().add_functions();
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("functions"));

  encoder = look1();
  encoder.graph().clear_node();
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("no graph"));
}

TEST_F(BundleTest, HostileNamesDoNotReachTheMessages) {
  OnnxBuilder encoder = look1();
  encoder.node("Evil\x1b[31m\n" + std::string(5000, 'x'));
  write("look1.onnx", encoder.bytes());
  const std::string message = complaint();
  EXPECT_THAT(message, HasSubstr("operator 'Evil?[31m?xxx"));
  EXPECT_LT(message.size(), 500u);
}

TEST_F(BundleTest, ChecksTheEncodersInputsAgainstTheManifest) {
  OnnxBuilder encoder = look1();
  encoder.graph()
      .mutable_input(0)
      ->mutable_type()
      ->mutable_tensor_type()
      ->mutable_shape()
      ->mutable_dim(2)
      ->set_dim_value(45);
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), AllOf(HasSubstr("look1.onnx"), HasSubstr("input 'input' has shape [1, 13, 45, 80]"),
                                 HasSubstr("[1, 13, 48, 80]")));
  write("look1.onnx", look1().bytes());

  encoder = look2();
  encoder.graph().mutable_output(0)->set_name("answer");
  write("look2.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), AllOf(HasSubstr("look2.onnx"), HasSubstr("no output 'code'"), HasSubstr("[1, 17]")));
}

}  // namespace
}  // namespace gatefield::model
