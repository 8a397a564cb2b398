#include "server/perception/learned/onednn_loops.h"

#include <gmock/gmock.h>

#include "common/base/random.h"
#include "common/model/onnx_file.h"
#include "tests/unit/common/model/onnx_builder.h"

namespace gatefield::perception {
namespace {

using model::OnnxBuilder;
using testing::HasSubstr;
using List = std::vector<std::int64_t>;

/// Empty when the loop of node "y" gives what the graph evaluates to for random x and z, else what is wrong.
std::string complaint(const std::vector<int>& x, const std::vector<int>& z,
                      const std::function<void(OnnxBuilder&)>& build, int opset = 13) {
  OnnxBuilder b(opset);
  b.input("x", x).input("z", z).output("y", {});
  build(b);
  const auto parsed = model::parse_onnx("test.onnx", b.bytes());
  if (!parsed) return parsed.error();
  const auto graph = model::Graph::compile("test.onnx", *parsed);
  if (!graph) return graph.error();
  std::map<std::string, model::Array> inputs;
  Random random(1);
  for (const auto& [name, shape] : {std::pair("x", x), std::pair("z", z)}) {
    model::Array& array = inputs[name];
    array.shape.assign(shape.begin(), shape.end());
    std::size_t count = 1;
    for (const int size : shape) count *= static_cast<std::size_t>(size);
    for (std::size_t i = 0; i < count; ++i) array.values.push_back(random.uniform() - 0.5);
  }
  const auto evaluation = graph->evaluate(inputs, {100'000, 100'000});
  if (!evaluation) return evaluation.error();
  const model::Graph folded = graph->folded(*evaluation, graph->slot("y"));
  if (folded.nodes().size() != 1) return "has " + std::to_string(folded.nodes().size()) + " nodes";

  const auto numbers = [&](int slot) {
    const auto& values = evaluation->values[static_cast<std::size_t>(slot)]->values;
    return std::make_shared<std::vector<float>>(values.begin(), values.end());
  };
  const auto loop = loop_of(folded, folded.nodes()[0], numbers);
  if (!loop) return loop.error();
  const auto& expected = evaluation->values[static_cast<std::size_t>(folded.slot("y"))]->values;
  std::vector<float> result(expected.size(), 1e9f);
  (*loop)(result.data());
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (!(std::abs(static_cast<double>(result[i]) - expected[i]) < 1e-5))
      return "gives " + std::to_string(result[i]) + " as element " + std::to_string(i) + ", expected " +
             std::to_string(expected[i]);
  }
  return "";
}

TEST(OneDnnLoops, ComputeWhatOnnxDefines) {
  const std::vector<int> image{1, 3, 4, 6};
  const auto node = [](const std::string& type, const std::vector<std::string>& inputs) {
    return [=](OnnxBuilder& b) { b.node(type, inputs, "y"); };
  };
  EXPECT_EQ(complaint(image, image, node("Add", {"x", "z"})), "");
  EXPECT_EQ(complaint(image, {1, 3, 1, 1}, node("Mul", {"x", "z"})), "");
  EXPECT_EQ(complaint({1, 3, 1, 1}, {4, 6}, node("Mul", {"x", "z"})), "");
  EXPECT_EQ(complaint(image, {1}, node("Add", {"x", "z"})), "");
  EXPECT_EQ(complaint(image, {1}, node("Relu", {"x"})), "");
  EXPECT_EQ(complaint(image, {1}, node("GlobalMaxPool", {"x"})), "");
  EXPECT_EQ(complaint(image, {1}, node("GlobalAveragePool", {"x"})), "");
  EXPECT_EQ(complaint({2, 3, 4}, {2, 4, 5}, node("MatMul", {"x", "z"})), "");
  EXPECT_EQ(complaint({2, 3, 4}, {1}, node("Softmax", {"x"})), "");
  EXPECT_EQ(complaint({3, 4}, {1}, node("Softmax", {"x"}), 11), "") << "over everything from axis 1 on";
  EXPECT_EQ(complaint(image, image, [](auto& b) { b.node("Concat", {"x", "z", "x"}, "y").with("axis", -2); }), "");
  EXPECT_EQ(complaint({2, 3, 4}, {1},
                      [](auto& b) {
                        b.node("Transpose", {"x"}, "y").with("perm", List{0, 2, 1});
                      }),
            "");
  EXPECT_EQ(complaint(image, {1}, [](auto& b) { b.node("Transpose", {"x"}, "y").with("perm", List{0, 2, 3, 1}); }), "");
  EXPECT_EQ(complaint(image, {1},
                      [](auto& b) {
                        b.integers("from", {-5}).integers("to", {100}).integers("axes", {3});
                        b.node("Slice", {"x", "from", "to", "axes"}, "y");
                      }),
            "");
  EXPECT_EQ(complaint(image, {1},
                      [](auto& b) {
                        b.constant("scales", {4}, {1, 1, 2, 3}).node("Resize", {"x", "", "scales"}, "y");
                        b.with_word("mode", "nearest").with_word("coordinate_transformation_mode", "asymmetric");
                        b.with_word("nearest_mode", "floor");
                      }),
            "");
}

TEST(OneDnnLoops, SayWhatTheyDoNotCompute) {
  EXPECT_EQ(complaint({2, 2}, {1}, [](auto& b) { b.node("Sigmoid", {"x"}, "y"); }), "Sigmoid");
  EXPECT_THAT(complaint(
                  {2, 3, 4}, {1}, [](auto& b) { b.node("Softmax", {"x"}, "y"); }, 11),
              HasSubstr("last axis"));
  EXPECT_THAT(complaint({3, 4}, {4, 5}, [](auto& b) { b.node("MatMul", {"x", "z"}, "y"); }), HasSubstr("batched"));
  EXPECT_THAT(complaint({1, 1, 2, 2}, {1},
                        [](auto& b) {
                          b.constant("scales", {4}, {1, 1, 2, 2}).node("Resize", {"x", "", "scales"}, "y");
                          b.with_word("mode", "linear");
                        }),
              HasSubstr("Resize other than of images to the nearest"));
}

}  // namespace
}  // namespace gatefield::perception
