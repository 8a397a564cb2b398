#include "common/model/onnx_graph.h"

#include <gmock/gmock.h>

#include <fstream>
#include <functional>
#include <sstream>

#include "common/model/onnx_file.h"
#include "tests/unit/common/model/onnx_builder.h"

namespace gatefield::model {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using Build = std::function<void(OnnxBuilder&)>;

/// "[shape] values", or the error, of what `build` calls "y" for the input x = 0, 1, 2 ... of `shape`.
std::string answer(const std::vector<int>& shape, const Build& build, int opset = 13) {
  OnnxBuilder b(opset);
  b.input("x", shape).output("y", {});
  build(b);
  const auto model = parse_onnx("test.onnx", b.bytes());
  if (!model) return model.error();
  const auto graph = Graph::compile("test.onnx", *model);
  if (!graph) return graph.error();
  Array x{{shape.begin(), shape.end()}, {}, false};
  std::size_t count = 1;
  for (const int size : shape) count *= static_cast<std::size_t>(size);
  for (std::size_t i = 0; i < count; ++i) x.values.push_back(static_cast<double>(i));
  const auto evaluation = graph->evaluate({{"x", x}}, {1000, 1000});
  if (!evaluation) return evaluation.error();
  const Array* const y = evaluation->values[static_cast<std::size_t>(graph->slot("y"))];
  std::ostringstream text;
  text << shape_text(y->shape);
  for (const double value : y->values) text << ' ' << value;
  return text.str();
}

// What OpenCV can't be asked about (tests/unit/server/perception/encoder_operators_test.cpp has the rest).

TEST(OnnxGraph, PicksAndRepeats) {
  EXPECT_EQ(answer({2, 3},
                   [](auto& b) {
                     b.integers("i", {2, 0, -1}).node("Gather", {"x", "i"}, "y").with("axis", 1);
                   }),
            "[2, 3] 2 0 2 5 3 5");
  EXPECT_EQ(answer({2, 3}, [](auto& b) { b.integers("i", {1}, true).node("Gather", {"x", "i"}, "y"); }), "[3] 3 4 5");
  EXPECT_EQ(answer({2, 2},
                   [](auto& b) {
                     b.integers("r", {2, 3}).node("Tile", {"x", "r"}, "y");
                   }),
            "[4, 6] 0 1 0 1 0 1 2 3 2 3 2 3 0 1 0 1 0 1 2 3 2 3 2 3");
  EXPECT_EQ(answer({2, 1},
                   [](auto& b) {
                     b.integers("s", {1, 3}).node("Expand", {"x", "s"}, "y");
                   }),
            "[2, 3] 0 0 0 1 1 1");
  EXPECT_EQ(answer({3},
                   [](auto& b) {
                     b.integers("s", {2, 1}).node("Expand", {"x", "s"}, "y");
                   }),
            "[2, 3] 0 1 2 0 1 2");
  EXPECT_EQ(answer({3},
                   [](auto& b) {
                     b.constant("one", {}, {1.0f}).node("Equal", {"x", "one"}, "e").constant("c", {1}, {7.0f});
                     b.node("Where", {"e", "c", "x"}, "y");
                   }),
            "[3] 0 7 2");
}

TEST(OnnxGraph, Slices) {
  const auto slice = [](std::int64_t from, std::int64_t to, std::int64_t step) {
    return answer({5}, [=](auto& b) {
      b.integers("f", {from}).integers("t", {to}).integers("a", {0}).integers("s", {step});
      b.node("Slice", {"x", "f", "t", "a", "s"}, "y");
    });
  };
  constexpr std::int64_t kEnd = INT64_MAX, kBegin = INT64_MIN;
  EXPECT_EQ(slice(1, 4, 1), "[3] 1 2 3");
  EXPECT_EQ(slice(-2, kEnd, 1), "[2] 3 4");
  EXPECT_EQ(slice(0, kEnd, 2), "[3] 0 2 4");
  EXPECT_EQ(slice(kEnd, kBegin, -1), "[5] 4 3 2 1 0");
  EXPECT_EQ(slice(3, 0, -2), "[2] 3 1");
  EXPECT_EQ(slice(3, 3, 1), "[0]");
  EXPECT_EQ(slice(9, 12, 1), "[0]");
  EXPECT_THAT(slice(0, 3, 0), HasSubstr("node 'y' (Slice) has a step of 0"));
}

TEST(OnnxGraph, Reshapes) {
  const auto reshape = [](const std::vector<std::int64_t>& to) {
    return answer({2, 3}, [=](auto& b) { b.integers("s", to).node("Reshape", {"x", "s"}, "y"); });
  };
  EXPECT_EQ(reshape({3, -1}), "[3, 2] 0 1 2 3 4 5");
  EXPECT_EQ(reshape({0, 1, -1}), "[2, 1, 3] 0 1 2 3 4 5");
  EXPECT_THAT(reshape({4, -1}), HasSubstr("can't make shape [4, 1] of [2, 3]"));
  EXPECT_THAT(reshape({-1, -1}), HasSubstr("leaves two sizes open"));
  EXPECT_THAT(reshape({0, 0, 0}), HasSubstr("takes over a size"));
  EXPECT_THAT(reshape({-7}), HasSubstr("has the size -7"));
  EXPECT_EQ(answer({1, 2, 1}, [](auto& b) { b.node("Squeeze", {"x"}, "y"); }), "[2] 0 1");
  EXPECT_EQ(answer({1, 2, 1}, [](auto& b) { b.integers("a", {-1}).node("Squeeze", {"x", "a"}, "y"); }), "[1, 2] 0 1");
  EXPECT_EQ(
      answer(
          {1, 2, 1}, [](auto& b) { b.node("Squeeze", {"x"}, "y").with("axes", std::vector<std::int64_t>{0}); }, 11),
      "[2, 1] 0 1");
  EXPECT_THAT(answer({1, 2},
                     [](auto& b) {
                       b.integers("a", {1}).node("Squeeze", {"x", "a"}, "y");
                     }),
              HasSubstr("removes dimension 1 of [1, 2]"));
  EXPECT_EQ(answer({2}, [](auto& b) { b.integers("a", {0, -1}).node("Unsqueeze", {"x", "a"}, "y"); }), "[1, 2, 1] 0 1");
}

TEST(OnnxGraph, Splits) {
  EXPECT_EQ(answer({5},
                   [](auto& b) {
                     b.integers("s", {2, 3}).node("Split", {"x", "s"}, "first").node("first").add_output("y");
                   }),
            "[3] 2 3 4");
  EXPECT_THAT(answer({5}, [](auto& b) { b.node("Split", {"x"}, "y").node("y").add_output("z"); }),
              HasSubstr("into 2 equal parts"));
  EXPECT_THAT(answer({5},
                     [](auto& b) {
                       b.integers("s", {2, 2}).node("Split", {"x", "s"}, "y").node("y").add_output("z");
                     }),
              HasSubstr("[2, 2] for 2 outputs"));
}

TEST(OnnxGraph, KnowsIntegers) {
  EXPECT_EQ(answer({7, 2},
                   [](auto& b) {
                     b.node("Shape", {"x"}, "s").integers("two", {2}, true).node("Div", {"s", "two"}, "y");
                   }),
            "[2] 3 1");
  EXPECT_EQ(answer({3},
                   [](auto& b) {
                     b.constant("h", {}, {0.6f}).node("Mul", {"x", "h"}, "m").node("Cast", {"m"}, "y").with("to", 7);
                   }),
            "[3] 0 0 1");
  EXPECT_THAT(answer({2},
                     [](auto& b) {
                       b.node("Shape", {"x"}, "s").integers("none", {0}, true).node("Div", {"s", "none"}, "y");
                     }),
              HasSubstr("divides an integer by zero"));
  EXPECT_THAT(answer({2}, [](auto& b) { b.node("Gather", {"x", "x"}, "y"); }), HasSubstr("no integers"));
}

TEST(OnnxGraph, Reduces) {
  EXPECT_EQ(answer({2, 3}, [](auto& b) { b.integers("a", {1}).node("ReduceSum", {"x", "a"}, "y"); }), "[2, 1] 3 12");
  EXPECT_EQ(answer({2, 3}, [](auto& b) { b.node("ReduceSum", {"x"}, "y").with("keepdims", 0); }), "[] 15");
  EXPECT_EQ(answer({2, 3}, [](auto& b) { b.node("ReduceSum", {"x"}, "y").with("noop_with_empty_axes", 1); }),
            "[2, 3] 0 1 2 3 4 5");
}

TEST(OnnxGraph, SoftmaxMeantSomethingElseOnce) {
  const Build softmax = [](auto& b) {
    b.constant("none", {}, {0.0f}).node("Mul", {"x", "none"}, "zero").node("Softmax", {"zero"}, "y").with("axis", 0);
  };
  EXPECT_EQ(answer({2, 2}, softmax, 12), "[2, 2] 0.25 0.25 0.25 0.25");
  EXPECT_EQ(answer({2, 2}, softmax, 13), "[2, 2] 0.5 0.5 0.5 0.5");
}

TEST(OnnxGraph, ResizesToTheNearest) {
  const auto resize = [](const std::string& rounding, const std::string& where) {
    return answer({2}, [=](auto& b) {
      b.constant("s", {1}, {2.5f}).node("Resize", {"x", "", "s"}, "y").with_word("nearest_mode", rounding);
      b.with_word("coordinate_transformation_mode", where);
    });
  };
  EXPECT_EQ(resize("floor", "asymmetric"), "[5] 0 0 0 1 1");  // 0, .4, .8, 1.2, 1.6
  EXPECT_EQ(resize("ceil", "asymmetric"), "[5] 0 1 1 1 1");
  EXPECT_EQ(resize("round_prefer_floor", "half_pixel"), "[5] 0 0 0 1 1");  // -.3, .1, .5, .9, 1.3
  EXPECT_EQ(resize("round_prefer_ceil", "half_pixel"), "[5] 0 0 1 1 1");
  EXPECT_EQ(resize("floor", "align_corners"), "[5] 0 0 0 0 1");
  EXPECT_THAT(resize("floor", "tf_crop_and_resize"), HasSubstr("tf_crop_and_resize"));
  EXPECT_THAT(answer({2},
                     [](auto& b) {
                       b.constant("s", {1}, {-1.0f}).node("Resize", {"x", "", "s"}, "y");
                     }),
              HasSubstr("enlarges by -1"));
}

TEST(OnnxGraph, PoolsAndClips) {
  EXPECT_EQ(answer({1, 1, 2, 2},
                   [](auto& b) {
                     b.node("AveragePool", {"x"}, "y").with("kernel_shape", {2, 2}).with("pads", {0, 0, 1, 1});
                     b.with("strides", {2, 2}).with("count_include_pad", 1);
                   }),
            "[1, 1, 1, 1] 1.5");
  EXPECT_EQ(answer({1, 1, 1, 2},
                   [](auto& b) {
                     b.node("AveragePool", {"x"}, "y").with("kernel_shape", {1, 2}).with("pads", {0, 1, 0, 1});
                     b.with("strides", {1, 3}).with("count_include_pad", 1);
                   }),
            "[1, 1, 1, 1] 0");
  EXPECT_EQ(answer({4}, [](auto& b) { b.constant("h", {}, {2.0f}).node("Clip", {"x", "", "h"}, "y"); }), "[4] 0 1 2 2");
  EXPECT_EQ(answer({4}, [](auto& b) { b.constant("l", {}, {2.0f}).node("Max", {"x", "l"}, "y"); }), "[4] 2 2 2 3");
  EXPECT_EQ(answer({4}, [](auto& b) { b.constant("l", {}, {2.0f}).node("Min", {"x", "l"}, "y"); }), "[4] 0 1 2 2");
  EXPECT_THAT(answer({1, 1, 2, 2},
                     [](auto& b) {
                       b.node("MaxPool", {"x"}, "y").with("kernel_shape", {3, 3});
                     }),
              HasSubstr("kernel larger than its input"));
  EXPECT_THAT(answer({1, 1, 2, 2},
                     [](auto& b) {
                       b.node("MaxPool", {"x"}, "y").with("kernel_shape", {1, 1}).with("pads", {1, 1, 1, 1});
                     }),
              HasSubstr("lies in the padding as a whole"));
  EXPECT_THAT(answer({1, 1, 2, 2},
                     [](auto& b) {
                       b.node("MaxPool", {"x"}, "y").with("kernel_shape", {2, 2}).with("ceil_mode", 1);
                     }),
              HasSubstr("ceil_mode 1, expected 0"));
  EXPECT_THAT(answer({1, 1, 2, 2},
                     [](auto& b) {
                       b.node("MaxPool", {"x"}, "y").with("kernel_shape", {2, 2}).with_word("auto_pad", "SAME_UPPER");
                     }),
              HasSubstr("auto_pad 'SAME_UPPER', expected pads in numbers"));
}

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
                       for (int i = 0; i < 7; ++i) b.node("ReduceMax", {"w"}, i == 6 ? "y" : "m" + std::to_string(i));
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

}  // namespace
}  // namespace gatefield::model
