#include "common/model/onnx_graph.h"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/unit/common/model/graph_answer.h"

namespace gatefield::model {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(OnnxGraph, BoundsItsWork) {
  EXPECT_THAT(answer({10, 11},
                     [](auto& b) {
                       b.weight("w", {11, 10}).node("MatMul", {"x", "w"}, "y");
                     }),
              HasSubstr("node 'y' (MatMul) takes more multiplications than are allowed"));
  EXPECT_THAT(answer({10, 11},
                     [](auto& b) {
                       b.integers("s", {10, 10, 11}).node("Expand", {"x", "s"}, "y");
                     }),
              HasSubstr("[10, 10, 11], too large"));
  // Much to read, little to write.
  EXPECT_THAT(answer({1},
                     [](auto& b) {
                       b.weight("w", {10'000});
                       for (int i = 0; i < 7; ++i)
                         b.node("ReduceMax", {"w"}, i == 6 ? "y" : std::string(1, static_cast<char>('a' + i)));
                     }),
              HasSubstr("node 'y' (ReduceMax) reads more numbers"));
}

TEST(OnnxGraph, ResultsCanBeReplaced) {
  OnnxBuilder b;
  b.input("x", {2}).output("y", {2}).node("Relu", {"x"}, "r").node("Neg", {"r"}, "y");
  const auto model = parse_onnx("test.onnx", b.bytes());
  ASSERT_TRUE(model.ok()) << model.error();
  const auto graph = Graph::compile("test.onnx", *model);
  ASSERT_TRUE(graph.ok()) << graph.error();
  const auto evaluation =
      graph->evaluate({{"x", {{2}, {1.0, 2.0}, false}}}, {10, 10}, {{graph->slot("r"), {{3}, {4.0, 5.0, 6.0}, false}}});
  ASSERT_TRUE(evaluation.ok()) << evaluation.error();
  EXPECT_THAT(evaluation->values[static_cast<std::size_t>(graph->slot("y"))]->values, ElementsAre(-4.0, -5.0, -6.0));
}

TEST(OnnxGraph, TheManualListsEveryOperator) {
  std::ifstream in(std::string(GATEFIELD_SOURCE_DIR) + "/docs/bring-your-own-network.md");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  std::string flat;
  for (const char c : text) flat += c == '\n' ? ' ' : c;
  EXPECT_THAT(flat, HasSubstr(operator_names()));
}

TEST(OnnxGraph, FoldedKeepsWhatDependsOnTheInputs) {
  OnnxBuilder b;
  b.input("x", {2, 3}).output("y", {6});
  b.node("Shape", {"x"}, "sizes").node("ReduceProd", {"sizes"}, "count").node("Neg", {"x"}, "unused");
  b.node("Relu", {"x"}, "r").node("Reshape", {"r", "count"}, "y");
  const auto model = parse_onnx("test.onnx", b.bytes());
  ASSERT_TRUE(model.ok()) << model.error();
  const auto graph = Graph::compile("test.onnx", *model);
  ASSERT_TRUE(graph.ok()) << graph.error();
  const std::map<std::string, Array> inputs{{"x", {{2, 3}, {-1.0, 2.0, -3.0, 4.0, -5.0, 6.0}, false}}};
  const auto evaluation = graph->evaluate(inputs, {10, 100});
  ASSERT_TRUE(evaluation.ok()) << evaluation.error();

  const Graph folded = graph->folded(*evaluation, graph->slot("y"));
  ASSERT_EQ(folded.nodes().size(), 2u);
  EXPECT_EQ(folded.nodes()[0].type, "Relu");
  EXPECT_EQ(folded.nodes()[0].position, 3);
  EXPECT_EQ(folded.nodes()[1].type, "Reshape");
  ASSERT_NE(folded.constant(folded.slot("count")), nullptr);
  EXPECT_THAT(folded.constant(folded.slot("count"))->values, ElementsAre(6.0));
  EXPECT_EQ(folded.constant(folded.slot("r")), nullptr);
  EXPECT_EQ(folded.constant(-1), nullptr);
  EXPECT_THAT(folded.shape(folded.slot("r")), ElementsAre(2, 3));
  EXPECT_THAT(folded.shape(folded.slot("y")), ElementsAre(6));

  const auto again = folded.evaluate(inputs, {10, 100});
  ASSERT_TRUE(again.ok()) << again.error();
  EXPECT_THAT(again->values[static_cast<std::size_t>(folded.slot("y"))]->values, ElementsAre(0, 2, 0, 4, 0, 6));
}

}  // namespace
}  // namespace gatefield::model
