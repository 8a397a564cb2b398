#include <gmock/gmock.h>
#include <onnx/defs/parser.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/base/random.h"
#include "common/model/checksums.h"
#include "server/perception/learned/depth_encoder.h"
#include "tests/unit/common/model/small_networks.h"

/// Networks as torch.onnx.export writes them since PyTorch 2.5 (dynamo=True): its names, operator sets, functions and
/// files of weights. Each either loads, gives what the formula written here gives, and runs through oneDNN or OpenCV;
/// or is refused with a sentence that names the cure.
namespace gatefield::perception {
namespace {

using model::OnnxBuilder;
using testing::AllOf;
using testing::HasSubstr;
using Numbers = std::vector<double>;
using Files = std::map<std::string, std::string>;
using List = std::vector<std::int64_t>;

constexpr int kCode = model::kSmallZ + 2;  ///< numbers of the encoder's answer
constexpr int kRows = 8, kWidth = 3;       ///< x is [1, 4, 2, 3]: 8 rows of 3, 4 channels of 6
constexpr std::size_t kCount = 24;

struct Case {
  std::string name;
  int opset;
  std::function<void(OnnxBuilder&)> build;         ///< makes y of x [1, 4, 2, 3]
  std::function<Numbers(const Numbers&)> formula;  ///< the same, row-major
  Files beside;                                    ///< further files
};

Numbers each(const Numbers& x, const std::function<double(double, std::size_t)>& f) {
  Numbers y;
  for (std::size_t i = 0; i < x.size(); ++i) y.push_back(f(x[i], i));
  return y;
}
double sigmoid(double x) { return 1.0 / (1.0 + std::exp(-x)); }
double gelu(double x) { return 0.5 * x * std::erfc(-x / std::sqrt(2.0)); }
double silu(double x) { return x / (1.0 + std::exp(-x)); }

/// Blocks of `size` numbers that follow each other, with mean 0 and variance 1.
Numbers normal(const Numbers& x, std::size_t size, double epsilon) {
  Numbers y = x;
  for (std::size_t begin = 0; begin < x.size(); begin += size) {
    double sum = 0.0, squares = 0.0;
    for (std::size_t i = begin; i < begin + size; ++i) {
      sum += x[i];
      squares += x[i] * x[i];
    }
    const auto n = static_cast<double>(size);
    const double mean = sum / n, variance = squares / n - mean * mean;
    for (std::size_t i = begin; i < begin + size; ++i) y[i] = (x[i] - mean) / std::sqrt(variance + epsilon);
  }
  return y;
}

float nth(std::size_t i) { return 0.25f * static_cast<float>(static_cast<int>(i % 7) - 3) + 0.125f; }  // exact as bf16
std::vector<float> some(std::size_t count) {
  std::vector<float> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(nth(i));
  return values;
}

/// Bits of a half whose fraction fits: sign, exponent with a bias of 15, ten digits.
std::uint16_t half_bits(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  if (value == 0.0f) return 0;
  return static_cast<std::uint16_t>((bits >> 16 & 0x8000u) | ((bits >> 23 & 0xffu) - 112u) << 10 |
                                    (bits >> 13 & 0x3ffu));
}
std::string halves_of(const std::vector<float>& values, bool brain) {
  std::string bytes;
  for (const float value : values) {
    const std::uint16_t bits =
        brain ? static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(value) >> 16) : half_bits(value);
    bytes.append(reinterpret_cast<const char*>(&bits), sizeof bits);
  }
  return bytes;
}

/// Moves a weight's numbers out, as `external_data=True` does.
void put_out(onnx::TensorProto& tensor, const std::string& location, Files* beside, std::size_t gap = 0) {
  std::string& file = (*beside)[location];
  file.resize(file.size() + gap);
  const std::vector<std::pair<std::string, std::string>> entries{{"location", location},
                                                                 {"offset", std::to_string(file.size())},
                                                                 {"length", std::to_string(tensor.raw_data().size())}};
  file += tensor.raw_data();
  tensor.clear_raw_data();
  tensor.set_data_location(onnx::TensorProto::EXTERNAL);
  for (const auto& [key, value] : entries) {
    tensor.add_external_data()->set_key(key);
    tensor.mutable_external_data(tensor.external_data_size() - 1)->set_value(value);
  }
}

/// A function of the exporter's library.
onnx::FunctionProto& function(OnnxBuilder& b, const std::string& text,
                              const std::string& domain = "pkg.onnxscript.torch_lib") {
  onnx::FunctionProto& made = *b.model().add_functions();
  const auto status = onnx::OnnxParser::Parse(made, text.c_str());
  EXPECT_TRUE(status.IsOK()) << status.ErrorMessage();
  made.set_domain(domain);
  auto* set = made.add_opset_import();
  set->set_domain("");
  set->set_version(b.model().opset_import(0).version());
  b.model().add_opset_import()->set_domain(domain);
  b.model().mutable_opset_import(b.model().opset_import_size() - 1)->set_version(1);
  return made;
}
OnnxBuilder& call(OnnxBuilder& b, const std::string& type, const std::vector<std::string>& inputs,
                  const std::string& name, const std::string& domain = "pkg.onnxscript.torch_lib") {
  b.node(type, inputs, name).node(name).set_domain(domain);
  return b;
}
void constant_node(OnnxBuilder& b, const std::string& name, std::int64_t value) {
  b.node("Constant", {}, name).with("value_ints", List{value});
}

std::vector<Case> good_cases() {
  std::vector<Case> cases;
  const auto add = [&](const std::string& name, int opset, std::function<void(OnnxBuilder&)> build,
                       std::function<Numbers(const Numbers&)> formula, Files beside = {}) {
    cases.push_back({name, opset, std::move(build), std::move(formula), std::move(beside)});
  };
  const auto as_silu = [](const Numbers& x) { return each(x, [](double v, std::size_t) { return silu(v); }); };
  const auto as_gelu = [](const Numbers& x) { return each(x, [](double v, std::size_t) { return gelu(v); }); };
  const auto same = [](const Numbers& x) { return x; };
  const auto plus = [](const Numbers& x) {
    return each(x, [](double v, std::size_t i) { return v + static_cast<double>(nth(i)); });
  };
  for (const int opset : {17, 18, 19, 20, 21}) {
    add(
        "SiLU, operator set " + std::to_string(opset), opset,
        [](auto& b) {
          b.node("Sigmoid", {"x"}, "val_0").node("Mul", {"x", "val_0"}, "y").node("y").set_name("node_silu");
          *b.graph().add_value_info() = b.graph().input(0);
          b.graph().mutable_value_info(0)->set_name("val_0");
        },
        as_silu);
  }
  add(
      "SiLU, a function", 18,
      [](auto& b) {
        function(b, "aten_silu (self) => (out) { gate = Sigmoid (self)  out = Mul (self, gate) }");
        call(b, "aten_silu", {"x"}, "y");
      },
      as_silu);
  add(
      "SiLU, functions of functions, twice", 18,
      [](auto& b) {
        function(b, "gate (x) => (y) { y = Sigmoid (x) }");
        auto& outer = function(b, "aten_silu (self) => (out) { tmp = gate (self)  out = Mul (self, tmp) }");
        outer.mutable_node(0)->set_domain("pkg.onnxscript.torch_lib");
        call(b, "aten_silu", {"x"}, "z");
        call(b, "aten_silu", {"z"}, "y");
      },
      [](const Numbers& x) { return each(x, [](double v, std::size_t) { return silu(silu(v)); }); });
  add(
      "Swish", 21, [](auto& b) { b.node("Swish", {"x"}, "y").with_number("alpha", 2.0f); },
      [](const Numbers& x) { return each(x, [](double v, std::size_t) { return v * sigmoid(2.0 * v); }); });
  add(
      "Mish", 18, [](auto& b) { b.node("Mish", {"x"}, "y"); },
      [](const Numbers& x) {
        return each(x, [](double v, std::size_t) { return v * std::tanh(std::log1p(std::exp(v))); });
      });
  add(
      "a function's attribute", 18,
      [](auto& b) {
        function(b, "aten_elu <alpha> (x) => (y) { y = Elu <alpha: float = @alpha> (x) }");
        b.node("Neg", {"x"}, "minus");
        call(b, "aten_elu", {"minus"}, "y").with_number("alpha", 0.5f);
      },
      [](const Numbers& x) { return each(x, [](double v, std::size_t) { return 0.5 * std::expm1(-v); }); });
  add(
      "a function's default", 21,
      [](auto& b) {
        auto& made = function(b, "aten_elu (x) => (y) { y = Elu <alpha: float = @alpha> (x) }");
        onnx::AttributeProto alpha;
        alpha.set_name("alpha");
        alpha.set_type(onnx::AttributeProto::FLOAT);
        alpha.set_f(0.25f);
        made.GetReflection()->MutableUnknownFields(&made)->AddLengthDelimited(11, alpha.SerializeAsString());
        b.node("Neg", {"x"}, "minus");
        call(b, "aten_elu", {"minus"}, "y");
      },
      [](const Numbers& x) { return each(x, [](double v, std::size_t) { return 0.25 * std::expm1(-v); }); });
  add(
      "a function's input left out", 18,
      [](auto& b) {
        function(b, "aten_clamp (self, low, high) => (y) { y = Clip (self, low, high) }");
        b.constant("high", {}, {0.5f});
        call(b, "aten_clamp", {"x", "", "high"}, "y");
      },
      [](const Numbers& x) { return each(x, [](double v, std::size_t) { return std::min(v, 0.5); }); });

  const auto layer = [&](const std::string& name, std::int64_t axis, std::size_t size, float epsilon, bool shift) {
    add(
        name, 17 + static_cast<int>(cases.size() % 5),
        [=](auto& b) {
          std::vector<int> shape{kWidth};
          if (axis == 1) shape = {4, 2, 3};
          b.constant("norm.weight", shape, some(size)).constant("norm.bias", shape, some(size));
          b.node("LayerNormalization", {"x", "norm.weight", "norm.bias"}, "y");
          if (axis != -1) b.with("axis", axis);
          b.with_number("epsilon", epsilon);
          if (!shift) b.node("y").mutable_input()->RemoveLast();
        },
        [=](const Numbers& x) {
          return each(normal(x, size, static_cast<double>(epsilon)), [=](double v, std::size_t i) {
            const auto w = static_cast<double>(nth(i % size));
            return v * w + (shift ? w : 0.0);
          });
        });
  };
  layer("LayerNormalization of rows", -1, kWidth, 1e-5f, true);
  layer("LayerNormalization without a shift", 3, kWidth, 1e-2f, false);
  layer("LayerNormalization of images", 1, kCount, 1e-3f, true);
  add(
      "GroupNormalization 18: factors per group", 18,
      [](auto& b) {
        b.constant("w", {2}, some(2))
            .constant("b", {2}, {0.5f, -0.75f})
            .node("GroupNormalization", {"x", "w", "b"}, "y");
        b.with("num_groups", 2).with_number("epsilon", 1e-2f);
      },
      [](const Numbers& x) {
        return each(normal(x, 12, 1e-2), [](double v, std::size_t i) {
          return v * static_cast<double>(nth(i / 12)) + (i < 12 ? 0.5 : -0.75);
        });
      });
  add(
      "GroupNormalization 21: factors per channel", 21,
      [](auto& b) {
        b.constant("w", {4}, some(4)).constant("b", {4}, some(4)).node("GroupNormalization", {"x", "w", "b"}, "y");
        b.with("num_groups", 2);
      },
      [](const Numbers& x) {
        return each(normal(x, 12, 1e-5),
                    [](double v, std::size_t i) { return (v + 1.0) * static_cast<double>(nth(i / 6)); });
      });
  add(
      "GroupNorm before operator set 21", 18,
      [](auto& b) {
        b.integers("groups", {0, 2, -1}).constant("ones", {2}, {1, 1}).constant("nothing", {2}, {0, 0});
        b.node("Reshape", {"x", "groups"}, "g").node("InstanceNormalization", {"g", "ones", "nothing"}, "n");
        b.node("Shape", {"x"}, "sizes").node("Reshape", {"n", "sizes"}, "back");
        b.constant("w", {1, 4, 1, 1}, some(4)).node("Mul", {"back", "w"}, "m").node("Add", {"m", "w"}, "y");
      },
      [](const Numbers& x) {
        return each(normal(x, 12, 1e-5),
                    [](double v, std::size_t i) { return (v + 1.0) * static_cast<double>(nth(i / 6)); });
      });
  add(
      "Gelu", 20, [](auto& b) { b.node("Gelu", {"x"}, "y"); }, as_gelu);
  add(
      "Gelu none", 21, [](auto& b) { b.node("Gelu", {"x"}, "y").with_word("approximate", "none"); }, as_gelu);
  add(
      "Gelu tanh", 20, [](auto& b) { b.node("Gelu", {"x"}, "y").with_word("approximate", "tanh"); },
      [](const Numbers& x) {
        return each(x, [](double v, std::size_t) {
          return 0.5 * v * (1.0 + std::tanh(std::sqrt(2.0 / M_PI) * (v + 0.044715 * v * v * v)));
        });
      });
  add(
      "Gelu before operator set 20", 18,
      [](auto& b) {
        b.constant("c", {}, {1.41421356f}).constant("one", {}, {1.0f}).constant("half", {}, {0.5f});
        b.node("Div", {"x", "c"}, "d").node("Erf", {"d"}, "e").node("Add", {"e", "one"}, "a");
        b.node("Mul", {"half", "a"}, "m").node("Mul", {"x", "m"}, "y");
      },
      as_gelu);

  for (const bool brain : {false, true}) {
    for (const bool raw : {false, true}) {
      add(
          std::string(brain ? "bf16" : "fp16") + (raw ? " weights" : " weights as a list"), 18,
          [=](auto& b) {
            const std::string bits = halves_of(some(kCount), brain);
            b.constant("w", {1, 4, 2, 3}, {}).node("Cast", {"w"}, "wide").with("to", 1).node("Add", {"x", "wide"}, "y");
            auto& w = b.tensor("w");
            w.set_data_type(brain ? onnx::TensorProto::BFLOAT16 : onnx::TensorProto::FLOAT16);
            if (raw) return w.set_raw_data(bits);
            w.clear_raw_data();
            for (std::size_t i = 0; i < bits.size(); i += 2)
              w.add_int32_data(static_cast<unsigned char>(bits[i]) | static_cast<unsigned char>(bits[i + 1]) << 8);
          },
          plus);
    }
  }
  add(
      "a network in half precision", 18,
      [](auto& b) {
        b.node("Cast", {"x"}, "narrow").with("to", 10).constant("w", {1, 4, 2, 3}, {});
        b.tensor("w").set_data_type(onnx::TensorProto::FLOAT16);
        b.tensor("w").set_raw_data(halves_of(some(kCount), false));
        b.node("Add", {"narrow", "w"}, "sum").node("Cast", {"sum"}, "y").with("to", 1);
      },
      plus);

  Files out;
  {
    OnnxBuilder kept(18);
    kept.constant("w", {1, 4, 2, 3}, some(kCount)).constant("v", {1, 4, 2, 3}, some(kCount));
    put_out(kept.tensor("v"), "encoder.onnx.data", &out);
    put_out(kept.tensor("w"), "encoder.onnx.data", &out, 4096);  // aligned as the exporter does
    const auto w = kept.tensor("w"), v = kept.tensor("v");
    add(
        "weights in another file", 18,
        [w](auto& b) {
          *b.graph().add_initializer() = w;
          b.node("Add", {"x", "w"}, "y");
        },
        plus, out);
    add(
        "weights in another file, two pieces", 20,
        [w, v](auto& b) {
          *b.graph().add_initializer() = w;
          *b.graph().add_initializer() = v;
          b.node("Add", {"x", "w"}, "z").node("Sub", {"z", "v"}, "y");
        },
        same, out);
    add("an output that nobody reads", 20,
        [w](auto& b) {
          auto missing = w;
          missing.mutable_external_data(0)->set_value("../not/there");
          *b.graph().add_initializer() = missing;
          b.input("grid", {1, 2, 2, 2})
              .node("GridSample", {"x", "grid"}, "sampled")
              .node("Add", {"sampled", "w"}, "aux");
          b.output("aux", {1, 4, 2, 2}).node("Identity", {"x"}, "y");
        },
        same, {});
  }
  {
    OnnxBuilder kept(18);
    kept.constant("w", {1, 4, 2, 3}, {});
    kept.tensor("w").set_data_type(onnx::TensorProto::FLOAT16);
    kept.tensor("w").set_raw_data(halves_of(some(kCount), false));
    Files halves;
    put_out(kept.tensor("w"), "encoder.onnx.data", &halves, 64);
    const auto w = kept.tensor("w");
    add(
        "fp16 weights in another file", 18,
        [w](auto& b) {
          *b.graph().add_initializer() = w;
          b.node("Add", {"x", "w"}, "y");
        },
        plus, halves);
  }
  add(
      "an open batch axis", 18,
      [](auto& b) {
        b.graph()
            .mutable_input(0)
            ->mutable_type()
            ->mutable_tensor_type()
            ->mutable_shape()
            ->mutable_dim(0)
            ->set_dim_param("s0");
        b.node("Shape", {"x"}, "batch").with("start", 0).with("end", 1);
        constant_node(b, "rest", -1);
        b.node("Concat", {"batch", "rest"}, "sizes")
            .with("axis", 0)
            .node("Reshape", {"x", "sizes"}, "y")
            .with("allowzero", 1);
      },
      same);
  add(
      "an output that nobody reads, of the same nodes", 18,
      [](auto& b) {
        b.node("Relu", {"x"}, "y").node("Neg", {"y"}, "other").output("other", {1, 4, 2, 3});
      },
      same);
  for (const std::string type : {"ReduceMean", "ReduceMax", "ReduceMin"}) {
    add(
        type + " with axes as an input", 18,
        [type](auto& b) {
          b.integers("axes", {-1}).node(type, {"x", "axes"}, "r").with("keepdims", 1).integers("three", {1, 1, 1, 3});
          b.node("Concat", {"r", "r", "r"}, "y").with("axis", 3);
        },
        [type](const Numbers& x) {
          Numbers y;
          for (std::size_t i = 0; i < x.size(); ++i) {
            const double *row = &x[i / 3 * 3], a = row[0], b = row[1], c = row[2];
            y.push_back(type == "ReduceMean"  ? (a + b + c) / 3.0
                        : type == "ReduceMax" ? std::max({a, b, c})
                                              : std::min({a, b, c}));
          }
          return y;
        });
  }
  add(
      "Split into parts of two sizes", 18,
      [](auto& b) {
        b.node("Split", {"x"}, "left").with("axis", 3).with("num_outputs", 2).node("left").add_output("right");
        b.node("Concat", {"right", "left"}, "y").with("axis", 3);
      },
      [](const Numbers& x) { return each(x, [&](double, std::size_t i) { return x[i / 3 * 3 + (i + 2) % 3]; }); });
  add(
      "CastLike", 19,
      [](auto& b) {
        b.integers("two", {2}, true).node("CastLike", {"two", "x"}, "number").node("Mul", {"x", "number"}, "y");
      },
      [](const Numbers& x) { return each(x, [](double v, std::size_t) { return 2.0 * v; }); });
  add(
      "Resize by sizes", 19,
      [](auto& b) {
        b.integers("sizes", {1, 4, 4, 6}).node("Resize", {"x", "", "", "sizes"}, "y").with_word("mode", "nearest");
        b.with_word("coordinate_transformation_mode", "asymmetric").with_word("nearest_mode", "floor");
        b.with_word("keep_aspect_ratio_policy", "stretch").with("antialias", 0);
      },
      [](const Numbers& x) {
        Numbers y;
        for (std::size_t i = 0; i < 96; ++i) y.push_back(x[i / 24 * 6 + i % 24 / 12 * 3 + i % 6 / 2]);
        return y;
      });
  return cases;
}

OnnxBuilder encoder_of(int opset, const std::function<void(OnnxBuilder&)>& build) {
  OnnxBuilder b(opset);
  b.model().set_ir_version(10);
  b.model().set_producer_name("pytorch");
  b.input("image", {1, 2, 16, 32}).output("code", {1, kCode});
  b.integers("zeros", {0, 0}).integers("ends", {2, 6}).integers("last", {2, 3}).integers("x_shape", {1, 4, 2, 3});
  b.node("Slice", {"image", "zeros", "ends", "last"}, "corner").node("Reshape", {"corner", "x_shape"}, "x");
  build(b);
  b.integers("row", {1, -1}).integers("first", {0}).integers("count", {kCode}).integers("axis_1", {1});
  b.node("Reshape", {"y", "row"}, "flat").node("Slice", {"flat", "first", "count", "axis_1"}, "code");
  return b;
}
Files bundle_of(const OnnxBuilder& encoder, Files beside = {}) {
  beside["manifest.txt"] = model::small_manifest_text(false);
  beside["decoder.onnx"] = model::small_concatenated_decoder().bytes();
  beside["encoder.onnx"] = encoder.bytes();
  return beside;
}

TEST(Exporter, WhatItWritesLoadsAndComputesWhatItSays) {
  const auto cases = good_cases();
  EXPECT_GE(cases.size(), 36u);
  for (const Case& each : cases) {
    SCOPED_TRACE(each.name);
    const auto bundle = model::Bundle::parse("small", bundle_of(encoder_of(each.opset, each.build), each.beside));
    EXPECT_TRUE(bundle.ok()) << bundle.error();
    if (!bundle.ok()) continue;
    const model::Network& network = bundle->networks()[0];
    Numbers x;
    for (std::size_t i = 0; i < kCount; ++i)
      x.push_back(static_cast<double>(network.inputs[0].values[i / 12 * 512 + i % 12 / 6 * 32 + i % 6]));
    const Numbers y = each.formula(x);
    for (std::size_t i = 0; i < kCode; ++i)
      EXPECT_NEAR(static_cast<double>(network.output.values[i]), y[i], 2e-6 * (1.0 + std::abs(y[i]))) << i;
    const auto runs = DepthEncoder::create(*bundle);
    EXPECT_TRUE(runs.ok()) << runs.error();
  }
}

TEST(Exporter, DamagedBytesAreReadOrRefused) {
  Random random(1);
  for (const Case& each : good_cases()) {
    const Files good = bundle_of(encoder_of(each.opset, each.build), each.beside);
    for (int trial = 0; trial < 40; ++trial) {
      Files damaged = good;
      std::string& bytes = damaged[each.beside.empty() || trial % 4 > 0 ? "encoder.onnx" : "encoder.onnx.data"];
      for (int i = 0; i <= trial % 3; ++i)
        bytes[random.below(static_cast<std::uint32_t>(bytes.size()))] = static_cast<char>(random.bits());
      const auto bundle = model::Bundle::parse("small", damaged);
      if (bundle.ok()) continue;
      EXPECT_LT(bundle.error().size(), 1000u);
      EXPECT_FALSE(bundle.error().starts_with("small: ")) << "an exception came through: " << bundle.error();
    }
  }
}

TEST(Exporter, DecodersKeepTheirWeights) {
  const OnnxBuilder plain = model::small_concatenated_decoder();
  Files files = bundle_of(model::small_plain_encoder());
  const auto expected = model::Bundle::parse("small", files);
  ASSERT_TRUE(expected.ok()) << expected.error();
  const auto open = [](OnnxBuilder& b, int input, const std::string& name) {
    auto* shape = b.graph().mutable_input(input)->mutable_type()->mutable_tensor_type()->mutable_shape();
    shape->mutable_dim(0)->set_dim_param(name);
  };
  const std::vector<std::pair<std::string, std::function<void(OnnxBuilder&, Files*)>>> ways{
      {"weights in another file",
       [](OnnxBuilder& b, Files* f) {
         for (auto& tensor : *b.graph().mutable_initializer()) put_out(tensor, "decoder.onnx.data", f, 16);
       }},
      {"a batch axis of its own", [&](OnnxBuilder& b, Files*) { open(b, 0, "batch"); }},
      {"operator set 21", [](OnnxBuilder& b, Files*) { b.model().mutable_opset_import(0)->set_version(21); }},
      {"ReLU as a function",
       [](OnnxBuilder& b, Files*) {
         function(b, "aten_relu (self) => (out) { out = Relu (self) }");
         for (auto& node : *b.graph().mutable_node()) {
           if (node.op_type() != "Relu") continue;
           node.set_op_type("aten_relu");
           node.set_domain("pkg.onnxscript.torch_lib");
         }
       }},
  };
  for (const auto& [name, change] : ways) {
    SCOPED_TRACE(name);
    OnnxBuilder decoder = model::small_concatenated_decoder();
    Files changed = files;
    change(decoder, &changed);
    changed["decoder.onnx"] = decoder.bytes();
    const auto bundle = model::Bundle::parse("small", changed);
    EXPECT_TRUE(bundle.ok()) << bundle.error();
    if (!bundle.ok()) continue;
    ASSERT_EQ(bundle->decoder().layers.size(), expected->decoder().layers.size());
    for (std::size_t i = 0; i < bundle->decoder().layers.size(); ++i)
      EXPECT_EQ(bundle->decoder().layers[i].weight, expected->decoder().layers[i].weight);
  }
}

/// Why a bundle with this encoder is refused.
std::string refusal(int opset, const std::function<void(OnnxBuilder&)>& build, const Files& beside = {}) {
  const auto bundle = model::Bundle::parse("small", bundle_of(encoder_of(opset, build), beside));
  return bundle.ok() ? "" : bundle.error();
}
std::function<void(OnnxBuilder&)> weight_at(const std::string& location, const std::string& offset = "0",
                                            const std::string& length = "96") {
  return [=](OnnxBuilder& b) {
    Files nowhere;
    b.constant("w", {1, 4, 2, 3}, some(kCount)).node("Add", {"x", "w"}, "y");
    put_out(b.tensor("w"), location, &nowhere);
    b.tensor("w").mutable_external_data(1)->set_value(offset);
    b.tensor("w").mutable_external_data(2)->set_value(length);
  };
}

TEST(Exporter, WhatCannotBeNamesTheCure) {
  const auto plain = [](OnnxBuilder& b) { b.node("Relu", {"x"}, "y"); };
  EXPECT_THAT(refusal(22, plain), HasSubstr("operator set 22, expected 11 to 21 (opset_version of torch.onnx.export)"));
  for (const std::string location :
       {"../encoder.onnx.data", "/etc/passwd", "weights/w.bin", "..", ".hidden", "a\\b", ""})
    EXPECT_THAT(refusal(18, weight_at(location)),
                AllOf(HasSubstr("in another file"), HasSubstr("external_data=False")));
  EXPECT_THAT(refusal(18, weight_at("gone.data")), AllOf(HasSubstr("'gone.data', which is missing: copy it")));
  const Files there{{"w.data", std::string(95, '\0')}};
  for (const auto& [offset, length] : std::vector<std::pair<std::string, std::string>>{{"0", "96"},
                                                                                       {"96", "0"},
                                                                                       {"1", "18446744073709551614"},
                                                                                       {"-1", "4"},
                                                                                       {"1e3", "4"},
                                                                                       {"0", "99999999999999999999"}})
    EXPECT_THAT(refusal(18, weight_at("w.data", offset, length), there), HasSubstr("expected a piece of its 95 bytes"));
  EXPECT_THAT(refusal(18, weight_at("w.data", "0", "95"), there), HasSubstr("95 bytes of data, expected 96"));

  EXPECT_THAT(refusal(18,
                      [](auto& b) {
                        b.constant("w", {1}, {1.0f}).node("Add", {"x", "w"}, "y");
                        b.tensor("w").set_data_type(onnx::TensorProto::DOUBLE);
                      }),
              AllOf(HasSubstr("11 (DOUBLE)"), HasSubstr("call .float()")));
  EXPECT_THAT(refusal(18,
                      [](auto& b) {
                        b.node("Relu", {"x"}, "y");
                        b.graph().mutable_input(0)->mutable_type()->mutable_tensor_type()->set_elem_type(
                            onnx::TensorProto::FLOAT16);
                      }),
              AllOf(HasSubstr("'image'"), HasSubstr("call .float() on the inputs")));
  EXPECT_THAT(
      refusal(18,
              [](auto& b) {
                b.integers("sizes", {1, 4, 4, 6}).node("Resize", {"x", "", "", "sizes"}, "y").with("antialias", 1);
              }),
      HasSubstr("antialias=False"));

  EXPECT_THAT(refusal(18,
                      [](auto& b) {
                        function(b, "again (x) => (y) { z = again (x)  y = Relu (z) }")
                            .mutable_node(0)
                            ->set_domain("pkg.onnxscript.torch_lib");
                        call(b, "again", {"x"}, "y");
                      }),
              HasSubstr("call each other without end"));
  EXPECT_THAT(refusal(18,
                      [](auto& b) {  // 2^15 calls of nothing
                        for (int i = 0; i < 15; ++i) {
                          const std::string inner = "f" + std::to_string(i + 1);
                          auto& made = function(b, "f" + std::to_string(i) + " (x) => (y) { a = " + inner +
                                                       " (x)  y = " + inner + " (x) }");
                          for (auto& node : *made.mutable_node()) node.set_domain("pkg.onnxscript.torch_lib");
                        }
                        function(b, "f15 (x) => (y) { }");
                        call(b, "f0", {"x"}, "y");
                      }),
              HasSubstr("make more than 2000 nodes or"));
  EXPECT_THAT(refusal(18,
                      [](auto& b) {
                        function(b, "old (x) => (y) { y = Relu (x) }").mutable_opset_import(0)->set_version(13);
                        call(b, "old", {"x"}, "y");
                      }),
              AllOf(HasSubstr("operator set 13, the network with 18"), HasSubstr("without optimize=False")));
  EXPECT_THAT(refusal(18,
                      [](auto& b) {
                        function(b, "two (x) => (y) { y = Relu (x) }");
                        call(b, "two", {"x", "x"}, "y");
                      }),
              HasSubstr("has 2 inputs, expected at most 1"));
  EXPECT_THAT(
      refusal(18, [](auto& b) { call(b, "aten_unknown", {"x"}, "y"); }),
      AllOf(HasSubstr("'aten_unknown' of domain 'pkg.onnxscript.torch_lib'"), HasSubstr("bring-your-own-network")));
}

/// As `model.test.onnx`: a file of tensors.
std::string vectors(const std::vector<std::pair<std::string, std::vector<int>>>& shapes, const std::string& answer,
                    const std::vector<float>& numbers) {
  OnnxBuilder b(18);
  for (const auto& [name, shape] : shapes) {
    std::size_t count = 1;
    for (const int size : shape) count *= static_cast<std::size_t>(size);
    b.constant(name, shape, some(count));
  }
  return b.constant(answer, {static_cast<int>(numbers.size())}, numbers).bytes();
}

TEST(Exporter, TestVectorsAreHeld) {
  const OnnxBuilder encoder = encoder_of(18, [](auto& b) { b.node("Relu", {"x"}, "y"); });
  std::vector<float> code;
  for (std::size_t i = 0; i < kCode; ++i) code.push_back(std::max(0.0f, nth(i / 12 * 512 + i % 12 / 6 * 32 + i % 6)));
  const auto held = [&](const std::string& name, const std::string& bytes) {
    const auto bundle = model::Bundle::parse("small", bundle_of(encoder, {{name, bytes}}));
    return bundle.ok() ? std::string() : bundle.error();
  };
  const std::vector<std::pair<std::string, std::vector<int>>> image{{"image", {1, 2, 16, 32}}};
  EXPECT_EQ(held("encoder.test.onnx", vectors(image, "code", code)), "");
  code[3] += 0.01f;
  EXPECT_THAT(held("encoder.test.onnx", vectors(image, "code", code)),
              AllOf(HasSubstr("encoder.test.onnx: says that element 3 of 'code'"), HasSubstr("export both again")));
  code.pop_back();
  EXPECT_THAT(held("encoder.test.onnx", vectors(image, "code", code)), HasSubstr("as large as what the network gives"));
  EXPECT_THAT(held("encoder.test.onnx", vectors({{"image", {1, 2, 16, 33}}}, "code", code)),
              HasSubstr("has 'image' of shape [1, 2, 16, 33], expected [1, 2, 16, 32]"));
  EXPECT_THAT(held("encoder.test.onnx", "no such thing"),
              HasSubstr("encoder.test.onnx: is cut off or not an ONNX file"));
  const std::vector<std::pair<std::string, std::vector<int>>> query{{"latent", {1, model::kSmallZ}},
                                                                    {"points", {2, 3}}};
  EXPECT_THAT(held("decoder.test.onnx", vectors(query, "sdf", {1e3f, 1e3f})),
              HasSubstr("decoder.test.onnx: says that element 0 of 'sdf' is 1000"));
}

TEST(Exporter, FilesOfWeightsBelongToTheBundle) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("gatefield-exporter-" + std::to_string(getpid()));
  fs::create_directories(folder / "bundle");
  Files beside;
  OnnxBuilder encoder = encoder_of(18, [&](auto& b) {
    b.constant("w", {1, 4, 2, 3}, some(kCount)).node("Add", {"x", "w"}, "y");
    put_out(b.tensor("w"), "encoder.onnx.data", &beside);
  });
  const auto write = [](const fs::path& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  };
  const auto complaint = [&] {
    const auto bundle = model::Bundle::read(folder / "bundle");
    return bundle.ok() ? std::string() : bundle.error();
  };
  for (const auto& [name, bytes] : bundle_of(encoder, beside)) write(folder / "bundle" / name, bytes);
  ASSERT_TRUE(model::write_checksums(folder / "bundle").ok());
  EXPECT_EQ(complaint(), "");
  std::string changed = beside["encoder.onnx.data"];
  changed[5] = static_cast<char>(changed[5] ^ 1);
  write(folder / "bundle/encoder.onnx.data", changed);
  EXPECT_THAT(complaint(), HasSubstr("encoder.onnx.data: is not the file that SHA256SUMS tells of"));
  write(folder / "outside", beside["encoder.onnx.data"]);
  fs::remove(folder / "bundle/encoder.onnx.data");
  fs::create_symlink("../outside", folder / "bundle/encoder.onnx.data");
  EXPECT_THAT(complaint(), HasSubstr("encoder.onnx.data: is a link, expected a file of the bundle's own"));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace gatefield::perception
