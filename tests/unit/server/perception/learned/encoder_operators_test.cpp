#include <gmock/gmock.h>

#include <functional>
#include <utility>
#include <vector>

#include "server/perception/learned/depth_encoder.h"
#include "server/perception/learned/network.h"
#include "tests/unit/common/model/small_networks.h"

namespace gatefield::perception {
namespace {

using model::OnnxBuilder;
using testing::AllOf;
using testing::HasSubstr;

/// A plain encoder with something between its first convolution, "bent" [1, 8, 8, 16], and what follows, which reads
/// `from`. Empty when server and OpenCV agree on what it computes, else why not.
std::string complaint(const std::string& from, const std::function<void(OnnxBuilder&)>& add, int opset = 13) {
  OnnxBuilder encoder(opset);
  encoder.input("image", {1, 2, 16, 32}).output("code", {1, model::kSmallZ + 2});
  encoder.weight("conv1.weight", {8, 2, 3, 3}).weight("conv1.bias", {8});
  encoder.node("Conv", {"image", "conv1.weight", "conv1.bias"}, "conv1");
  encoder.with("kernel_shape", {3, 3}).with("strides", {2, 2}).with("pads", {1, 1, 1, 1});
  encoder.node("Sigmoid", {"conv1"}, "bent");
  add(encoder);
  encoder.integers("row", {1, -1}).node("Reshape", {from, "row"}, "flat");
  encoder.integers("some", {3 * model::kSmallZ}).integers("none", {0}).integers("second", {1});
  encoder.node("Slice", {"flat", "none", "some", "second"}, "cut");
  encoder.dense("dense", 3 * model::kSmallZ, model::kSmallZ + 2).gemm("cut", "dense", "code");
  const auto bundle = model::Bundle::parse("small", {{"manifest.txt", model::small_manifest_text(false)},
                                                     {"decoder.onnx", model::small_concatenated_decoder().bytes()},
                                                     {"encoder.onnx", encoder.bytes()}});
  if (!bundle) return bundle.error();
  const auto created = DepthEncoder::create(*bundle);
  return created ? "" : created.error();
}

using Case = std::pair<std::string, std::function<void(OnnxBuilder&)>>;

/// What torch.onnx.export makes of usual layers, and OpenCV runs.
std::vector<Case> usual_cases() {
  using List = std::vector<std::int64_t>;
  std::vector<Case> cases;
  for (const std::string type : {"Abs",        "Ceil",        "Cos",       "Elu",      "Erf",       "Exp",  "Floor",
                                 "Flatten",    "HardSigmoid", "HardSwish", "Identity", "LeakyRelu", "Log",  "Neg",
                                 "Reciprocal", "Relu",        "Sigmoid",   "Sin",      "Softplus",  "Sqrt", "Tanh"}) {
    cases.emplace_back(type, [type](OnnxBuilder& b) { b.node(type, {"bent"}, "x"); });
  }
  for (const std::string type : {"Add", "Sub", "Mul", "Div", "Max", "Min", "Equal"}) {
    cases.emplace_back(type, [type](OnnxBuilder& b) { b.node("Cos", {"bent"}, "y").node(type, {"bent", "y"}, "x"); });
  }
  for (const std::string type : {"Add", "Sub", "Mul", "Div", "Pow"}) {
    cases.emplace_back(type + " a number", [type](OnnxBuilder& b) {
      b.constant("c", {}, {0.7f}).node(type, {"bent", "c"}, "x");
    });
  }
  for (const std::string type : {"Add", "Sub", "Mul", "Div"}) {
    cases.emplace_back(type + " channels", [type](OnnxBuilder& b) {
      b.weight("c", {1, 8, 1, 1}).node(type, {"bent", "c"}, "x");
    });
  }
  for (const std::string type : {"GlobalMaxPool", "GlobalAveragePool"}) {
    cases.emplace_back(type, [type](OnnxBuilder& b) { b.node(type, {"bent"}, "g").node("Mul", {"bent", "g"}, "x"); });
  }
  for (const std::string type : {"MaxPool", "AveragePool"}) {
    cases.emplace_back(type, [type](OnnxBuilder& b) {
      b.node(type, {"bent"}, "x").with("kernel_shape", {2, 2}).with("strides", {2, 2});
    });
    cases.emplace_back(type + " padded", [type](OnnxBuilder& b) {
      b.node(type, {"bent"}, "x").with("kernel_shape", {3, 3}).with("strides", {2, 1}).with("pads", {1, 1, 1, 1});
    });
  }
  for (const std::string type : {"ReduceMean", "ReduceMax", "ReduceMin", "ReduceL2", "ReduceProd"}) {
    for (const std::int64_t keep : {0, 1}) {
      cases.emplace_back(type + (keep ? " kept" : ""), [type, keep](OnnxBuilder& b) {
        b.node(type, {"bent"}, "x").with("axes", List{2}).with("keepdims", keep);
      });
    }
    cases.emplace_back(type + " images", [type](OnnxBuilder& b) {
      b.node(type, {"bent"}, "g").with("axes", List{2, 3}).with("keepdims", 1).node("Mul", {"bent", "g"}, "x");
    });
  }
  for (const std::string where : {"asymmetric", "half_pixel", "pytorch_half_pixel", "align_corners"}) {
    cases.emplace_back("Resize linear " + where, [where](OnnxBuilder& b) {
      b.constant("roi", {0}, {}).constant("s", {4}, {1, 1, 2, 2}).node("Resize", {"bent", "roi", "s"}, "x");
      b.with_word("mode", "linear").with_word("coordinate_transformation_mode", where);
    });
    cases.emplace_back("Resize linear to a size " + where, [where](OnnxBuilder& b) {
      b.integers("s", {1, 8, 5, 9}).node("Resize", {"bent", "", "", "s"}, "x");
      b.with_word("mode", "linear").with_word("coordinate_transformation_mode", where);
    });
  }
  cases.emplace_back("Resize nearest", [](OnnxBuilder& b) {
    b.constant("roi", {0}, {}).constant("s", {4}, {1, 1, 2, 3}).node("Resize", {"bent", "roi", "s"}, "x");
    b.with_word("mode", "nearest").with_word("coordinate_transformation_mode", "asymmetric");
    b.with_word("nearest_mode", "floor");
  });
  cases.emplace_back("BatchNormalization", [](OnnxBuilder& b) {
    b.weight("s", {8}).weight("t", {8}).weight("m", {8}).constant("v", {8}, {1, 2, 3, 1, 2, 3, 1, 2});
    b.node("BatchNormalization", {"bent", "s", "t", "m", "v"}, "x");
  });
  cases.emplace_back("InstanceNormalization", [](OnnxBuilder& b) {
    b.weight("s", {8}).weight("t", {8}).node("InstanceNormalization", {"bent", "s", "t"}, "x");
    b.with_number("epsilon", 1e-3f);
  });
  cases.emplace_back("Cast", [](OnnxBuilder& b) { b.node("Cast", {"bent"}, "x").with("to", 1); });
  cases.emplace_back("Concat", [](OnnxBuilder& b) { b.node("Concat", {"bent", "conv1"}, "x").with("axis", 1); });
  cases.emplace_back("ConstantOfShape", [](OnnxBuilder& b) {
    b.integers("s", {1, 8, 8, 16}).node("ConstantOfShape", {"s"}, "zeros").node("Add", {"bent", "zeros"}, "x");
  });
  for (const int group : {2, 8}) {
    cases.emplace_back("Conv of " + std::to_string(group) + " groups", [group](OnnxBuilder& b) {
      b.weight("w", {8, 8 / group, 3, 3}).node("Conv", {"bent", "w"}, "x").with("group", group);
      b.with("pads", {1, 1, 1, 1}).with("kernel_shape", {3, 3});
    });
  }
  cases.emplace_back("Conv with gaps", [](OnnxBuilder& b) {
    b.weight("w", {8, 8, 5, 3}).node("Conv", {"bent", "w"}, "x").with("kernel_shape", {5, 3});
    b.with("dilations", {1, 2}).with("pads", {2, 1, 0, 3}).with("strides", {1, 3});
  });
  cases.emplace_back("Expand", [](OnnxBuilder& b) {
    b.node("GlobalAveragePool", {"bent"}, "g").integers("s", {1, 8, 8, 16}).node("Expand", {"g", "s"}, "x");
  });
  cases.emplace_back("Gather", [](OnnxBuilder& b) {
    b.integers("i", {2}, true).node("Gather", {"bent", "i"}, "x").with("axis", 1);
  });
  cases.emplace_back("MatMul", [](OnnxBuilder& b) {
    b.node("Transpose", {"bent"}, "t").with("perm", {0, 1, 3, 2}).node("MatMul", {"t", "bent"}, "x");
  });
  cases.emplace_back("MatMul by a weight", [](OnnxBuilder& b) {
    b.weight("w", {16, 5}).node("MatMul", {"bent", "w"}, "x");
  });
  cases.emplace_back("PRelu", [](OnnxBuilder& b) { b.weight("c", {8, 1, 1}).node("PRelu", {"conv1", "c"}, "x"); });
  cases.emplace_back("Pad", [](OnnxBuilder& b) {
    b.integers("p", {0, 0, 1, 2, 0, 0, 3, 4}).node("Pad", {"bent", "p"}, "x");
  });
  cases.emplace_back("Shape", [](OnnxBuilder& b) {
    b.node("Shape", {"bent"}, "s").integers("i", {1}, true).node("Gather", {"s", "i"}, "g").integers("rest", {-1});
    b.integers("one", {1}).integers("c_shape", {1}).node("Reshape", {"g", "c_shape"}, "c");
    b.node("Concat", {"one", "c", "rest"}, "shape").with("axis", 0).node("Reshape", {"bent", "shape"}, "x");
  });
  cases.emplace_back("Slice", [](OnnxBuilder& b) {
    b.integers("from", {1, -12}).integers("to", {8, 14}).integers("axes", {2, 3}).integers("steps", {2, 3});
    b.node("Slice", {"bent", "from", "to", "axes", "steps"}, "x");
  });
  cases.emplace_back("Softmax", [](OnnxBuilder& b) { b.node("Softmax", {"bent"}, "x").with("axis", 3); });
  cases.emplace_back("Split", [](OnnxBuilder& b) {
    b.node("Split", {"bent"}, "first").with("axis", 1).node("first").add_output("x");
  });
  cases.emplace_back("Transpose", [](OnnxBuilder& b) {
    b.node("Transpose", {"bent"}, "x").with("perm", {0, 2, 3, 1});
  });
  cases.emplace_back("Unsqueeze", [](OnnxBuilder& b) {
    b.integers("axes", {0}).node("Unsqueeze", {"bent", "axes"}, "x");
  });
  return cases;
}

TEST(EncoderOperators, ServerAndOpenCvComputeTheSame) {
  for (const auto& [name, add] : usual_cases()) {
    for (const int opset : {11, 17}) EXPECT_EQ(complaint("x", add, opset), "") << name << ", operator set " << opset;
  }
}

TEST(EncoderOperators, OtherShapesOfTheSameNumbersRunThroughOneDnn) {
  if (!onednn_built_in()) GTEST_SKIP() << "built without oneDNN";
  OnnxBuilder encoder = model::small_encoder("image", {1, 2, 16, 32}, "code", model::kSmallZ + 2);  // ends in Flatten
  encoder.integers("one", {1}).integers("row", {0, -1});
  encoder.node("Unsqueeze", {"flat", "one"}, "up").node("Squeeze", {"up", "one"}, "down");
  encoder.node("Reshape", {"down", "row"}, "same").node("Identity", {"same"}, "all").gemm("all", "dense", "code");
  const auto bundle = model::Bundle::parse("small", {{"manifest.txt", model::small_manifest_text(false)},
                                                     {"decoder.onnx", model::small_concatenated_decoder().bytes()},
                                                     {"encoder.onnx", encoder.bytes()}});
  ASSERT_TRUE(bundle.ok()) << bundle.error();
  const auto network = onednn_network(bundle->networks()[0]);
  ASSERT_TRUE(network.ok()) << network.error();
  EXPECT_EQ(disagreement(**network, bundle->networks()[0]), "");
}

TEST(EncoderOperators, WhatOpenCvCannotLoadIsNamed) {
  const auto where = [](OnnxBuilder& b) {
    b.constant("c", {}, {0.5f}).node("Equal", {"bent", "c"}, "same").node("Where", {"same", "bent", "conv1"}, "x");
  };
  EXPECT_THAT(complaint("x", where), AllOf(HasSubstr("small/encoder.onnx: OpenCV can't load node 'x' (Where): "),
                                           HasSubstr("Can't create layer")));
  const auto power = [](OnnxBuilder& b) { b.node("Pow", {"bent", "conv1"}, "x"); };
  EXPECT_THAT(complaint("x", power), HasSubstr("node 'x' (Pow): Unsupported Pow op with variable power"));
}

TEST(EncoderOperators, WhatOpenCvReadsInItsOwnWayIsRefused) {
  // OpenCV 4.6 leaves the padding out of the mean whatever the file says.
  const auto pool = [](OnnxBuilder& b) {
    b.node("AveragePool", {"bent"}, "x").with("kernel_shape", {3, 3}).with("strides", {2, 2});
    b.with("pads", {1, 1, 1, 1}).with("count_include_pad", 1);
  };
  EXPECT_THAT(complaint("x", pool),
              AllOf(HasSubstr("small/encoder.onnx: OpenCV computes something else"), HasSubstr("of 'code', expected")));
}

}  // namespace
}  // namespace gatefield::perception
