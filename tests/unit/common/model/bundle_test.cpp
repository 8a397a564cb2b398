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
#include "common/model/checksums.h"
#include "tests/unit/common/model/small_networks.h"

namespace gatefield::model {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class BundleTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() / ("gatefield-" + std::to_string(getpid()) + "-" + info->name());
    std::filesystem::create_directories(folder_);
    const Status status = write_manifest(small_manifest(true), folder_ / "manifest.txt");
    ASSERT_TRUE(status.ok()) << status.error();
    write("decoder.onnx", small_hyper_decoder().bytes());
    write("look1.onnx", small_look1().bytes());
    write("look2.onnx", small_look2().bytes());
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

std::vector<float> numbers(const onnx::TensorProto& tensor) {
  std::vector<float> values(tensor.raw_data().size() / sizeof(float));
  std::memcpy(values.data(), tensor.raw_data().data(), tensor.raw_data().size());
  return values;
}

TEST_F(BundleTest, ReadsAGoodOne) {
  OnnxBuilder decoder = small_hyper_decoder();
  ASSERT_TRUE(write_checksums(folder_).ok());
  const Result<Bundle> bundle = Bundle::read(folder_);
  ASSERT_TRUE(bundle.ok()) << bundle.error();
  EXPECT_EQ(bundle->folder(), folder_);
  EXPECT_EQ(bundle->manifest().name, "small");
  EXPECT_TRUE(bundle->warnings().empty());
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
  // Asked for, not read, and yet to the last bit.
  EXPECT_EQ(weights.generator.weight, numbers(decoder.tensor("generator.weight")));
  EXPECT_EQ(weights.generator.bias, numbers(decoder.tensor("generator.bias")));
  EXPECT_EQ(weights.layers[0].weight, numbers(decoder.tensor("layer0.weight")));
  EXPECT_EQ(weights.layers[0].bias, numbers(decoder.tensor("layer0.bias")));
  EXPECT_EQ(weights.layers[1].weight, numbers(decoder.tensor("layer1.weight")));
}

TEST_F(BundleTest, RefusesAnyFileThatHasChangedByOneBit) {
  ASSERT_TRUE(write_checksums(folder_).ok());
  ASSERT_EQ(complaint(), "");
  Random random(7, Stream("gatefield.flipped_bit"));
  for (const std::string name : {"manifest.txt", "decoder.onnx", "look1.onnx", "look2.onnx"}) {
    const std::string good = content(name);
    for (int i = 0; i < 20; ++i) {
      std::string bad = good;
      bad[random.below(static_cast<std::uint32_t>(bad.size()))] ^= static_cast<char>(1 << random.below(8));
      write(name, bad);
      EXPECT_THAT(complaint(), AllOf(HasSubstr("/" + name + ": is not the file that SHA256SUMS tells of"),
                                     HasSubstr("sha256sum manifest.txt *.onnx* > SHA256SUMS")));
    }
    write(name, good);
  }
  EXPECT_EQ(complaint(), "");
}

TEST_F(BundleTest, TakesChecksumsAsOtherToolsWriteThem) {
  ASSERT_TRUE(write_checksums(folder_).ok());
  std::string sums = content("SHA256SUMS");
  EXPECT_EQ(std::count(sums.begin(), sums.end(), '\n'), 4);
  // Of a file that isn't ours, with capital letters, marked as binary, with Windows' ends of lines.
  std::string other = std::string(64, 'A') + " *training.csv\r\n\r\n";
  for (const char c : sums) other += c == '\n' ? std::string("\r\n") : std::string(1, c);
  write("SHA256SUMS", other);
  EXPECT_EQ(complaint(), "");
}

TEST_F(BundleTest, ChecksumsThatSayNothingAreRefused) {
  ASSERT_TRUE(write_checksums(folder_).ok());
  const std::string sums = content("SHA256SUMS");
  write("SHA256SUMS", "");
  EXPECT_THAT(complaint(), HasSubstr("SHA256SUMS: does not list manifest.txt; copy the bundle anew"));
  write("SHA256SUMS", sums.substr(sums.find("  decoder.onnx\n") + 15));
  EXPECT_THAT(complaint(), HasSubstr("SHA256SUMS: does not list decoder.onnx"));
  write("SHA256SUMS", "MD5 (manifest.txt) = 1234\n" + sums);
  EXPECT_THAT(complaint(), HasSubstr("SHA256SUMS: line 1 is 'MD5 (manifest.txt) = 1234', expected 64 hexadecimal"));
  write("SHA256SUMS", sums.substr(1));
  EXPECT_THAT(complaint(), HasSubstr("SHA256SUMS: line 1 is"));
  write("SHA256SUMS", std::string(2000, '\n') + sums);
  EXPECT_THAT(complaint(), HasSubstr("more than 1000 lines"));
}

TEST_F(BundleTest, WarnsWithoutChecksums) {
  const Result<Bundle> bundle = Bundle::read(folder_);
  ASSERT_TRUE(bundle.ok()) << bundle.error();
  EXPECT_THAT(bundle->warnings(),
              testing::ElementsAre(HasSubstr("has no SHA256SUMS: a damaged file may go unnoticed")));
}

TEST_F(BundleTest, KeepsTheEncodersNetworksWithATestCase) {
  const Result<Bundle> bundle = Bundle::read(folder_);
  ASSERT_TRUE(bundle.ok()) << bundle.error();
  ASSERT_EQ(bundle->networks().size(), 2u);
  const Network& second = bundle->networks()[1];
  EXPECT_EQ(second.file, "look2.onnx");
  onnx::ModelProto same;
  ASSERT_TRUE(same.ParseFromString(*second.bytes));
  EXPECT_EQ(same.graph().node_size(), small_look2().graph().node_size());
  EXPECT_EQ(second.inputs.size(), 2u);
  EXPECT_EQ(second.output.name, "code");
  EXPECT_EQ(second.output.shape, (std::vector<int>{1, 17}));
  EXPECT_EQ(second.output.values.size(), 17u);
  // Convolution 8 x 8 x 8 of 7 x 3 x 3, dense 11 x 17.
  EXPECT_EQ(second.multiply_adds, 8 * 8 * 8 * 7 * 9 + 11 * 17);
}

TEST_F(BundleTest, TakesWeightsAsListsToo) {
  const Result<Bundle> raw = Bundle::read(folder_);
  write("decoder.onnx", small_hyper_decoder(false).bytes());
  const Result<Bundle> listed = Bundle::read(folder_);
  ASSERT_TRUE(raw.ok() && listed.ok());
  EXPECT_EQ(raw->decoder().layers[0].weight, listed->decoder().layers[0].weight);
  EXPECT_EQ(raw->decoder().generator.bias, listed->decoder().generator.bias);
}

TEST_F(BundleTest, ReadsAPlainEncoderWithAConcatenatedDecoder) {
  Manifest manifest = small_manifest(false);
  write_manifest_again(manifest);
  OnnxBuilder decoder = small_concatenated_decoder();
  write("decoder.onnx", decoder.bytes());
  write("encoder.onnx", small_plain_encoder().bytes());
  std::filesystem::remove(folder_ / "look1.onnx");
  const Result<Bundle> bundle = Bundle::read(folder_);
  ASSERT_TRUE(bundle.ok()) << bundle.error();
  EXPECT_EQ(bundle->decoder().encoding_octaves, 4);
  ASSERT_EQ(bundle->decoder().layers.size(), 3u);
  EXPECT_EQ(bundle->decoder().layers[0].weight, numbers(decoder.tensor("layer0.weight")));
  EXPECT_TRUE(bundle->decoder().generator.weight.empty());
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
  Manifest manifest = small_manifest(true);
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
  onnx::ModelProto model = small_hyper_decoder().model();
  for (int i = 0; i < 400'000; ++i) model.mutable_graph()->add_node();
  write("decoder.onnx", model.SerializeAsString());
  EXPECT_THAT(complaint(), AllOf(HasSubstr("decoder.onnx"), HasSubstr("too many")));

  std::filesystem::resize_file(folder_ / "decoder.onnx", (64u << 20) + 1);
  EXPECT_THAT(complaint(), AllOf(HasSubstr("decoder.onnx"), HasSubstr("larger than 67108864")));
}

TEST_F(BundleTest, RefusesNestingWithoutEnd) {
  onnx::ModelProto model = small_hyper_decoder().model();
  onnx::GraphProto* graph = model.mutable_graph();
  for (int i = 0; i < 40; ++i) graph = graph->add_node()->add_attribute()->mutable_g();
  write("decoder.onnx", model.SerializeAsString());
  EXPECT_THAT(complaint(), HasSubstr("decoder.onnx"));
}

TEST_F(BundleTest, NamesTheFieldOfTheManifest) {
  const auto with = [&](const std::function<void(Manifest&)>& spoil) {
    Manifest manifest = small_manifest(true);
    spoil(manifest);
    write_manifest_again(manifest);
    return complaint();
  };
  EXPECT_THAT(with([](Manifest& m) { m.encoder_kind = "three_look"; }),
              AllOf(HasSubstr("manifest.txt"), HasSubstr("encoder_kind is 'three_look'"), HasSubstr("'plain'")));
  EXPECT_THAT(with([](Manifest& m) { m.encoder_kind = "\x1b[31m"; }), HasSubstr("encoder_kind is '?[31m'"));
  EXPECT_THAT(with([](Manifest& m) { m.name = "a\nb"; }), HasSubstr("name is 'a?b', expected up to 63 printable"));
  EXPECT_THAT(with([](Manifest& m) { m.name = std::string(64, 'a'); }), HasSubstr("name is 'aaaa"));
  EXPECT_THAT(with([](Manifest& m) { m.latent_size = 3; }), HasSubstr("latent_size is 3, expected 4 to 1024"));
  EXPECT_THAT(with([](Manifest& m) { m.latent_size = 1025; }), HasSubstr("latent_size is 1025"));
  EXPECT_THAT(with([](Manifest& m) { m.encoding_octaves = 17; }), HasSubstr("encoding_octaves is 17"));
  EXPECT_THAT(with([](Manifest& m) { m.position_scale_m = 0.0; }), HasSubstr("position_scale_m"));
  EXPECT_THAT(with([](Manifest& m) { m.image_width_px = 100; }), HasSubstr("image_width_px is 100"));
  EXPECT_THAT(with([](Manifest& m) { m.image_width_px = 1296; }), HasSubstr("up to 1280"));
  EXPECT_THAT(with([](Manifest& m) { m.image_height_px = 17; }), HasSubstr("image_height_px is 17"));
  EXPECT_THAT(with([](Manifest& m) { m.crop_size_px = 7; }), HasSubstr("crop_size_px is 7"));
  EXPECT_THAT(with([](Manifest& m) { m.max_depth_m = 0.2; }), HasSubstr("max_depth_m is 0.2"));
  EXPECT_THAT(with([](Manifest&) {}), "");

  std::string text = content("manifest.txt");
  const std::size_t at = text.find("validity_threshold");
  write("manifest.txt", text.substr(0, at));
  EXPECT_THAT(complaint(), HasSubstr("required field 'validity_threshold' is missing"));
  write("manifest.txt", text + "latent_sise: 3\n");
  EXPECT_THAT(complaint(), HasSubstr("unknown field 'latent_sise'"));
}

TEST_F(BundleTest, RefusesWeightsThatAreNoNumbers) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    OnnxBuilder decoder = small_hyper_decoder();
    std::memcpy(decoder.tensor("layer0.weight").mutable_raw_data()->data() + 4 * 7, &bad, 4);
    write("decoder.onnx", decoder.bytes());
    EXPECT_THAT(complaint(), AllOf(HasSubstr("decoder.onnx"), HasSubstr("'layer0.weight'"), HasSubstr("at element 7"),
                                   HasSubstr("finite")));

    decoder = small_hyper_decoder(false);
    decoder.tensor("generator.bias").set_float_data(5, bad);
    write("decoder.onnx", decoder.bytes());
    EXPECT_THAT(complaint(), AllOf(HasSubstr("'generator.bias'"), HasSubstr("at element 5")));
    write("decoder.onnx", small_hyper_decoder().bytes());

    OnnxBuilder encoder = small_look1();
    std::memcpy(encoder.tensor("conv1.weight").mutable_raw_data()->data(), &bad, 4);
    write("look1.onnx", encoder.bytes());
    EXPECT_THAT(complaint(), AllOf(HasSubstr("look1.onnx"), HasSubstr("'conv1.weight'")));
    write("look1.onnx", small_look1().bytes());
  }
}

TEST_F(BundleTest, RefusesTensorsThatDoNotHoldWhatTheySay) {
  const auto with = [&](const std::function<void(onnx::TensorProto&)>& spoil) {
    OnnxBuilder encoder = small_look2();
    spoil(encoder.tensor("conv1.weight"));
    write("look2.onnx", encoder.bytes());
    return complaint();
  };
  EXPECT_THAT(with([](auto& t) { t.mutable_raw_data()->pop_back(); }), HasSubstr("2015 bytes of data, expected 2016"));
  EXPECT_THAT(with([](auto& t) { t.clear_raw_data(); }), HasSubstr("has 0 numbers, expected 504"));
  EXPECT_THAT(with([](auto& t) { t.add_float_data(1); }), HasSubstr("data twice"));
  EXPECT_THAT(with([](auto& t) { t.set_dims(0, -8); }), HasSubstr("impossible shape"));
  EXPECT_THAT(with([](auto& t) { t.set_dims(0, std::int64_t{1} << 62); }), HasSubstr("impossible shape"));
  EXPECT_THAT(with([](auto& t) {
                for (int i = 0; i < 4; ++i) t.set_dims(i, 1 << 20);
              }),
              HasSubstr("impossible shape"));
  EXPECT_THAT(with([](auto& t) {
                for (int i = 0; i < 4; ++i) t.set_dims(i, i == 2 ? 0 : 1 << 20);
              }),
              HasSubstr("impossible shape"));
  EXPECT_THAT(with([](auto& t) { t.mutable_segment()->set_begin(0); }), HasSubstr("segments"));
  EXPECT_THAT(with([](auto& t) { t.set_data_type(onnx::TensorProto::DOUBLE); }), HasSubstr("data type 11"));
  EXPECT_THAT(with([](auto& t) { t.set_data_type(onnx::TensorProto::STRING); }), HasSubstr("data type 8"));
  EXPECT_THAT(with([](auto& t) { t.set_data_location(onnx::TensorProto::EXTERNAL); }), HasSubstr("in another file"));
  EXPECT_THAT(with([](auto& t) { t.add_external_data()->set_value("/etc/passwd"); }), HasSubstr("in another file"));
  EXPECT_THAT(with([](auto&) {}), "");
}

TEST_F(BundleTest, RefusesForeignOperators) {
  for (const std::string type : {"Loop", "If", "Scan", "GridSample", "", "relu"}) {
    OnnxBuilder encoder = small_look1();
    encoder.node(type, {"bent"}, "strange");
    write("look1.onnx", encoder.bytes());
    EXPECT_THAT(complaint(), AllOf(HasSubstr("look1.onnx"), HasSubstr("'strange'"),
                                   HasSubstr("operator '" + type + "'"), HasSubstr("bring-your-own-network.md")));
  }
  OnnxBuilder encoder = small_look1();
  encoder.node("Relu", {"bent"}, "strange").node("strange").set_domain("com.example");
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("domain 'com.example'"));

  encoder = small_look1();
  encoder.node("bent").add_attribute()->mutable_g();
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), AllOf(HasSubstr("'bent'"), HasSubstr("graph or sparse tensor")));

  encoder = small_look1();
  encoder.model().add_functions();
  write("look1.onnx", encoder.bytes());
  EXPECT_EQ(complaint(), "") << "a function that nobody calls";

  encoder = small_look1();
  encoder.graph().add_sparse_initializer();
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("sparse"));

  encoder = small_look1();
  encoder.graph().clear_node();
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("no graph"));
}

TEST_F(BundleTest, RefusesOtherOperatorSets) {
  for (const int version : {10, 22}) {
    OnnxBuilder encoder = small_look2();
    encoder.model().mutable_opset_import(0)->set_version(version);
    write("look2.onnx", encoder.bytes());
    EXPECT_THAT(complaint(), AllOf(HasSubstr("look2.onnx"), HasSubstr("operator set " + std::to_string(version)),
                                   HasSubstr("expected 11 to 21"), HasSubstr("opset_version")));
  }
  for (const int version : {11, 17, 18, 21}) {
    OnnxBuilder encoder = small_look2();
    encoder.model().mutable_opset_import(0)->set_version(version);
    write("look2.onnx", encoder.bytes());
    EXPECT_EQ(complaint(), "");
  }
  OnnxBuilder encoder = small_look2();
  encoder.model().clear_opset_import();
  write("look2.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("names no version"));
}

TEST_F(BundleTest, RefusesTooManyNodesAndWeights) {
  OnnxBuilder encoder = small_look2();
  for (int i = 0; i < 2000; ++i) encoder.node("Relu", {"bent"}, "more" + std::to_string(i));
  write("look2.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), AllOf(HasSubstr("look2.onnx"), HasSubstr("2006 nodes"), HasSubstr("at most 2000")));
  encoder = small_look2();
  for (int i = 0; i < 2000; ++i) encoder.integers("more" + std::to_string(i), {i});
  write("look2.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("2006 weights"));
}

TEST_F(BundleTest, NamesWhatIsWrongWithANode) {
  const auto with = [&](const std::function<void(OnnxBuilder&)>& spoil) {
    OnnxBuilder encoder = small_look2();
    spoil(encoder);
    write("look2.onnx", encoder.bytes());
    return complaint();
  };
  EXPECT_THAT(with([](auto& e) { e.node("bent").set_input(0, "nobody"); }),
              AllOf(HasSubstr("look2.onnx: node 'bent' (Relu)"), HasSubstr("'nobody', which nothing before it makes")));
  EXPECT_THAT(with([](auto& e) { e.node("bent").set_input(0, "flat"); }), HasSubstr("nothing before it makes"));
  EXPECT_THAT(with([](auto& e) { e.node("bent").add_input("conv1"); }), HasSubstr("has 2 inputs and 1 outputs"));
  EXPECT_THAT(with([](auto& e) { e.node("bent").clear_output(); }), HasSubstr("has 1 inputs and 0 outputs"));
  EXPECT_THAT(with([](auto& e) { e.node("bent").set_output(0, "conv1"); }), HasSubstr("makes 'conv1' a second time"));
  EXPECT_THAT(with([](auto& e) { e.node("bent").set_output(0, ""); }),
              HasSubstr("'bent', which nothing before it makes"));
  EXPECT_THAT(with([](auto& e) { e.node("conv1").add_attribute()->set_name("colour"); }),
              AllOf(HasSubstr("attribute 'colour'"), HasSubstr("kernel_shape")));
  EXPECT_THAT(with([](auto& e) { *e.node("conv1").add_attribute() = e.node("conv1").attribute(0); }),
              HasSubstr("'kernel_shape' twice"));
  EXPECT_THAT(with([](auto& e) { e.node("conv1").mutable_attribute(1)->set_ints(0, 0); }), HasSubstr("out of range"));
  EXPECT_THAT(with([](auto& e) { e.node("conv1").mutable_attribute(2)->set_ints(0, std::int64_t{1} << 60); }),
              HasSubstr("out of range"));
  EXPECT_THAT(with([](auto& e) { e.node("conv1").mutable_attribute(0)->set_ints(0, 5); }),
              AllOf(HasSubstr("'conv1' (Conv)"), HasSubstr("kernel_shape [5, 3]"), HasSubstr("[8, 7, 3, 3]")));
  EXPECT_THAT(with([](auto& e) { e.node("code").set_input(1, "dense.weight"); }),
              AllOf(HasSubstr("'code' (Gemm)"), HasSubstr("[1, 11] and [17, 8], which don't fit")));
  EXPECT_THAT(with([](auto&) {}), "");
}

TEST_F(BundleTest, RefusesNetworksThatTakeTooLong) {
  OnnxBuilder encoder = small_look2();
  encoder.weight("wide.weight", {512, 8, 3, 3}).weight("wider.weight", {2048, 512, 3, 3});
  encoder.node("Conv", {"bent", "wide.weight"}, "wide").with("pads", {1, 1, 1, 1});
  encoder.node("Conv", {"wide", "wider.weight"}, "wider").with("pads", {1, 1, 1, 1});
  write("look2.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), AllOf(HasSubstr("look2.onnx: node 'wider' (Conv)"), HasSubstr("more multiplications")));
}

TEST_F(BundleTest, RefusesNetworksThatFillTheMemory) {
  OnnxBuilder encoder = small_look2();
  encoder.integers("shape", {1 << 20, 1, 8, 8}).node("Expand", {"bent", "shape"}, "huge");
  write("look2.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), AllOf(HasSubstr("'huge' (Expand)"), HasSubstr("[1048576, 8, 8, 8], too large")));

  // An empty array whose other sizes overflow.
  encoder = small_look2();
  encoder.integers("shape", {1 << 30, 1 << 30, 1 << 30, 0}).node("ConstantOfShape", {"shape"}, "huge");
  write("look2.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("too large"));
}

TEST_F(BundleTest, WarnsOfSlowEncoders) {
  OnnxBuilder encoder = small_look2();
  encoder.weight("wide.weight", {1024, 8, 3, 3}).weight("wider.weight", {64, 1024, 3, 3});
  encoder.node("Conv", {"bent", "wide.weight"}, "wide").with("pads", {1, 1, 1, 1});
  encoder.node("Conv", {"wide", "wider.weight"}, "wider").with("pads", {1, 1, 1, 1});
  write("look2.onnx", encoder.bytes());
  const Result<Bundle> bundle = Bundle::read(folder_);
  ASSERT_TRUE(bundle.ok()) << bundle.error();
  EXPECT_THAT(bundle->warnings(),
              testing::Contains(AllOf(HasSubstr("look2.onnx takes 42 million"), HasSubstr("30 million"))));
}

TEST_F(BundleTest, RefusesAnswersThatAreNoNumbers) {
  OnnxBuilder encoder = small_look2();
  encoder.node("code").set_output(0, "before");
  encoder.constant("zero", {1}, {0.0f}).node("Div", {"before", "zero"}, "code");
  write("look2.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), AllOf(HasSubstr("look2.onnx"), HasSubstr("inf as element 0 of 'code'")));
}

TEST_F(BundleTest, HostileNamesDoNotReachTheMessages) {
  OnnxBuilder encoder = small_look1();
  encoder.node("Evil\x1b[31m\n" + std::string(5000, 'x'), {"bent"}, "e\x1b");
  write("look1.onnx", encoder.bytes());
  const std::string message = complaint();
  EXPECT_THAT(message, HasSubstr("node 'e?'"));
  EXPECT_THAT(message, HasSubstr("operator 'Evil?[31m?xxx"));
  EXPECT_LT(message.size(), 500u);
}

TEST_F(BundleTest, ChecksTheEncodersInputsAndOutputs) {
  OnnxBuilder encoder = small_look1();
  auto* shape = encoder.graph().mutable_input(0)->mutable_type()->mutable_tensor_type()->mutable_shape();
  shape->mutable_dim(2)->set_dim_value(45);
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), AllOf(HasSubstr("look1.onnx"), HasSubstr("input 'input' has shape [1, 13, 45, 16]"),
                                 HasSubstr("[1, 13, 8, 16]")));
  shape->mutable_dim(2)->set_dim_param("rows");
  write("look1.onnx", encoder.bytes());
  EXPECT_EQ(complaint(), "") << "a size that is left open fits";
  encoder = small_look1();
  encoder.graph().mutable_input(0)->mutable_type()->mutable_tensor_type()->set_elem_type(onnx::TensorProto::FLOAT16);
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("10 (FLOAT16), expected [1, 13, 8, 16] of ONNX data type 1 (FLOAT)"));
  encoder = small_look1();
  encoder.graph().mutable_input(1)->set_name("points");
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("no input 'anchors'"));
  encoder = small_look1();
  encoder.input("time", {1});
  write("look1.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("has the input 'time', expected only 'input', 'anchors'"));
  write("look1.onnx", small_look1().bytes());

  encoder = small_look2();
  encoder.graph().mutable_output(0)->set_name("answer");
  write("look2.onnx", encoder.bytes());
  EXPECT_THAT(complaint(),
              AllOf(HasSubstr("look2.onnx"), HasSubstr("'answer'"), HasSubstr("one called 'code' (output_names")));
  encoder = small_look2();
  encoder.output("flat", {1, 8});
  write("look2.onnx", encoder.bytes());
  EXPECT_EQ(complaint(), "") << "an output that nobody reads";
  encoder = small_look2();
  encoder.node("code").set_output(0, "answer");
  write("look2.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("gives 'code' of shape nothing, expected [1, 17]"));
  encoder = small_look2();
  encoder.node("code").set_input(0, "flat");
  encoder.node("code").set_input(1, "dense.weight");
  encoder.node("code").set_input(2, "dense.bias");
  encoder.dense("short", 8, 16);
  encoder.node("code").set_input(1, "short.weight");
  encoder.node("code").set_input(2, "short.bias");
  write("look2.onnx", encoder.bytes());
  EXPECT_THAT(complaint(), HasSubstr("gives 'code' of shape [1, 16], expected [1, 17]"));
}

}  // namespace
}  // namespace gatefield::model
