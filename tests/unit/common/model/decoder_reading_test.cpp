#include "common/model/decoder_reading.h"

#include <gmock/gmock.h>

#include "common/model/onnx_file.h"
#include "tests/unit/common/model/small_networks.h"

namespace gatefield::model {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Result<DecoderWeights> read(const OnnxBuilder& builder, const Manifest& manifest) {
  const auto model = parse_onnx("decoder.onnx", builder.bytes());
  if (!model) return Error{model.error()};
  const auto graph = Graph::compile("decoder.onnx", *model);
  if (!graph) return Error{graph.error()};
  return read_decoder("decoder.onnx", *graph, false, manifest);
}

std::string complaint(const OnnxBuilder& builder, const Manifest& manifest) {
  const auto weights = read(builder, manifest);
  return weights ? "" : weights.error();
}

TEST(DecoderReading, NamesDoNotMatter) {
  const Manifest manifest = small_manifest(false);
  OnnxBuilder renamed = small_concatenated_decoder();
  for (auto& tensor : *renamed.graph().mutable_initializer()) tensor.set_name("t_" + tensor.name());
  for (auto& node : *renamed.graph().mutable_node()) {
    for (auto& name : *node.mutable_input())
      if (name != "latent" && name != "points")
        name.insert(0, name.find("layer") == 0 || name.find("freq") == 0 || name == "nothing" ? "t_" : "n_");
    for (auto& name : *node.mutable_output())
      if (name != "sdf") name.insert(0, "n_");
    node.clear_name();
  }
  const auto plain = read(small_concatenated_decoder(), manifest);
  const auto other = read(renamed, manifest);
  ASSERT_TRUE(plain.ok()) << plain.error();
  ASSERT_TRUE(other.ok()) << other.error();
  ASSERT_EQ(plain->layers.size(), other->layers.size());
  for (std::size_t i = 0; i < plain->layers.size(); ++i) EXPECT_EQ(plain->layers[i].weight, other->layers[i].weight);
}

TEST(DecoderReading, OneLayerIsEnough) {
  const auto weights = read(small_concatenated_decoder({}), small_manifest(false));
  ASSERT_TRUE(weights.ok()) << weights.error();
  ASSERT_EQ(weights->layers.size(), 1u);
  EXPECT_EQ(weights->layers[0].inputs, kSmallZ + 27);
}

TEST(DecoderReading, ScalesAndNormalisationAreTakenIn) {
  // A batch normalisation, a factor and a transposed product between two Relus are one layer all the same.
  OnnxBuilder b = small_concatenated_decoder({20, 16});
  b.constant("gain", {16}, std::vector<float>(16, 1.5f)).weight("shift", {16}).weight("mean", {16});
  b.constant("variance", {16}, std::vector<float>(16, 0.5f)).constant("half", {}, {0.5f});
  auto relu = b.node("hidden1"), gemm = b.node("sdf");
  b.graph().mutable_node()->RemoveLast();
  b.graph().mutable_node()->RemoveLast();
  b.node("BatchNormalization", {"x1", "gain", "shift", "mean", "variance"}, "normal");
  b.node("Mul", {"normal", "half"}, "halved");
  relu.set_input(0, "halved");
  *b.graph().add_node() = relu;
  *b.graph().add_node() = gemm;
  const auto weights = read(b, small_manifest(false));
  ASSERT_TRUE(weights.ok()) << weights.error();
  EXPECT_EQ(weights->layers.size(), 3u);
}

TEST(DecoderReading, NamesAnEncodingThatTheManifestDoesNotHave) {
  const Manifest manifest = small_manifest(false);
  EXPECT_THAT(complaint(small_concatenated_decoder({20}, 4, 3.0), manifest),
              AllOf(HasSubstr("decoder.onnx: node 'sin0' (Sin) turns by 1.047198 rad a metre"),
                    HasSubstr("position_scale_m"), HasSubstr("1.570796 doubled up to 3 times")));
  EXPECT_THAT(complaint(small_concatenated_decoder({20}, 5), manifest), HasSubstr("node 'sin4' (Sin) turns by 25.13"));
  EXPECT_EQ(complaint(small_concatenated_decoder({20}, 3), manifest), "") << "an octave less is none that weighs";

  OnnxBuilder mixed = small_concatenated_decoder({20});
  mixed.weight("turn", {3, 3});
  mixed.node("angle2").set_op_type("MatMul");
  mixed.node("angle2").set_input(1, "turn");
  EXPECT_THAT(complaint(mixed, manifest), HasSubstr("something else than a multiple of one coordinate"));
}

TEST(DecoderReading, RefusesOtherBends) {
  for (const std::string type : {"Tanh", "LeakyRelu", "Sigmoid", "Softplus"}) {
    OnnxBuilder b = small_concatenated_decoder();
    b.node("hidden1").set_op_type(type);
    EXPECT_THAT(complaint(b, small_manifest(false)),
                AllOf(HasSubstr("node 'hidden1' (" + type + ")"), HasSubstr("expected Relu")));
  }
}

TEST(DecoderReading, RefusesSkips) {
  OnnxBuilder b = small_concatenated_decoder({20, 20});
  const auto relu = b.node("hidden1"), gemm = b.node("sdf");
  b.graph().mutable_node()->RemoveLast();
  b.graph().mutable_node()->RemoveLast();
  b.node("Add", {"x1", "hidden0"}, "sum").node("Relu", {"sum"}, "hidden1");
  *b.graph().add_node() = gemm;
  EXPECT_EQ(complaint(b, small_manifest(false)), "") << "a skip over one layer is that layer plus one";

  OnnxBuilder far = small_concatenated_decoder({20, 20, 20});
  const auto last = far.node("sdf");
  far.graph().mutable_node()->RemoveLast();
  far.node("Add", {"hidden2", "hidden0"}, "sum");
  *far.graph().add_node() = last;
  far.node("sdf").set_input(0, "sum");
  EXPECT_THAT(complaint(far, small_manifest(false)),
              AllOf(HasSubstr("computes something else than a CONCATENATED decoder of 4 layers"), HasSubstr("skips")));
}

TEST(DecoderReading, RefusesWidthsThatTheKernelsDoNotTake) {
  EXPECT_EQ(complaint(small_concatenated_decoder({256}), small_manifest(false)), "");
  EXPECT_THAT(complaint(small_concatenated_decoder({257}), small_manifest(false)),
              HasSubstr("node 'hidden0' (Relu) is 257 wide, expected 1 to 256"));
  EXPECT_THAT(complaint(small_hyper_decoder(true, 257), small_manifest(true)), HasSubstr("257 wide"));
  EXPECT_EQ(complaint(small_concatenated_decoder({4, 4, 4, 4, 4, 4, 4}), small_manifest(false)), "");
  EXPECT_THAT(complaint(small_concatenated_decoder({4, 4, 4, 4, 4, 4, 4, 4}), small_manifest(false)),
              HasSubstr("has 9 layers, expected at most 8"));
  OnnxBuilder two = small_concatenated_decoder({20});
  two.dense("pair", 20, 2);
  two.node("sdf").set_input(1, "pair.weight");
  two.node("sdf").set_input(2, "pair.bias");
  EXPECT_THAT(complaint(two, small_manifest(false)),
              HasSubstr("gives 'sdf' of shape [7, 2] for 7 points, expected [7, 1]"));
}

TEST(DecoderReading, RefusesTheOtherKind) {
  Manifest manifest = small_manifest(true);
  manifest.latent_size = kSmallZ;
  EXPECT_THAT(complaint(small_concatenated_decoder(), manifest),
              AllOf(HasSubstr("'sin0' (Sin)"), HasSubstr("HYPER: it takes none")));
  manifest = small_manifest(false);
  manifest.latent_size = 3 + kSmallZ;
  EXPECT_THAT(complaint(small_hyper_decoder(), manifest), HasSubstr("something else than a CONCATENATED decoder"));
  // The right kind at the wrong scale comes out right: W1 / S is what counts, and S is made up for.
  manifest = small_manifest(true);
  manifest.position_scale_m = 4.0;
  EXPECT_EQ(complaint(small_hyper_decoder(), manifest), "");
}

TEST(DecoderReading, RefusesAHyperDecoderWhoseLatentIsBent) {
  OnnxBuilder b = small_hyper_decoder();
  b.node("Relu", {"z"}, "bent_z");
  b.graph().mutable_node()->SwapElements(2, b.graph().node_size() - 1);
  for (int i = b.graph().node_size() - 1; i > 3; --i) b.graph().mutable_node()->SwapElements(i, i - 1);
  b.node("made").set_input(0, "bent_z");
  EXPECT_THAT(complaint(b, small_manifest(true)), AllOf(HasSubstr("'bent_z' (Relu)"), HasSubstr("one row for each")));
}

TEST(DecoderReading, RefusesShapesThatHangOnTheNumberOfPoints) {
  OnnxBuilder b = small_concatenated_decoder({20});
  b.integers("fixed", {7, 3}).node("Reshape", {"points", "fixed"}, "again");
  b.graph().mutable_node()->SwapElements(0, b.graph().node_size() - 1);
  for (int i = b.graph().node_size() - 1; i > 1; --i) b.graph().mutable_node()->SwapElements(i, i - 1);
  b.node("rows").set_input(0, "again");
  EXPECT_THAT(complaint(b, small_manifest(false)), AllOf(HasSubstr("decoder.onnx"), HasSubstr("'again' (Reshape)")));
}

}  // namespace
}  // namespace gatefield::model
