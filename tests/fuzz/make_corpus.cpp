// Writes what fuzzing begins with: make_corpus BUNDLES PACKETS SAMPLES, each a folder. Bundles are made, packets were
// recorded (tests/data/rtps), samples are those of tests/data/wire.

#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

#include "tests/fuzz/bundle_input.h"
#include "tests/fuzz/wire_input.h"
#include "tests/support/hex.h"
#include "tests/support/rtps_corpus.h"
#include "tests/unit/common/model/small_networks.h"

namespace {

using namespace gatefield;
using namespace gatefield::model;

/// An encoder with what the other seeds lack.
OnnxBuilder varied_encoder() {
  OnnxBuilder b = small_encoder("image", {1, 2, 16, 32}, "code", kSmallZ + 2);
  b.node("MaxPool", {"bent"}, "pooled").with("kernel_shape", {3, 3}).with("strides", {2, 2}).with("pads", {1, 1, 1, 1});
  b.constant("scales", {4}, {1, 1, 2, 2})
      .node("Resize", {"pooled", "", "scales"}, "enlarged")
      .with_word("mode", "linear");
  b.node("Concat", {"enlarged", "bent"}, "both").with("axis", 1).integers("rows", {1, 16, -1});
  b.node("Reshape", {"both", "rows"}, "flat_rows").node("Softmax", {"flat_rows"}, "weights").with("axis", 2);
  b.node("Transpose", {"flat_rows"}, "columns")
      .with("perm", {0, 2, 1})
      .node("MatMul", {"weights", "columns"}, "attended");
  b.node("Split", {"attended"}, "left").with("axis", 2).node("left").add_output("right");
  b.node("ReduceMean", {"left"}, "mean_left").with("axes", std::vector<std::int64_t>{1}).with("keepdims", 0);
  b.node("Shape", {"right"}, "shape")
      .node("ConstantOfShape", {"shape"}, "zeros")
      .node("Equal", {"right", "zeros"}, "same");
  b.node("Where", {"same", "zeros", "right"}, "chosen")
      .integers("axes", {1})
      .integers("from", {-1})
      .integers("to", {-9});
  b.integers("step", {-2}).node("Slice", {"chosen", "from", "to", "axes", "step"}, "cut");
  b.integers("pads", {0, 0, 1, 0, 1, 0}).node("Pad", {"cut", "pads"}, "padded").integers("repeats", {1, 2, 1});
  b.node("Tile", {"padded", "repeats"}, "tiled")
      .integers("index", {0, -1})
      .node("Gather", {"tiled", "index"}, "taken")
      .with("axis", 1);
  b.node("ReduceMax", {"taken"}, "most").with("axes", std::vector<std::int64_t>{1}).with("keepdims", 0);
  b.constant("low", {}, {-1.0f}).node("Clip", {"most", "low"}, "clipped").node("Add", {"clipped", "mean_left"}, "sum");
  b.constant("half", {}, {0.5f})
      .node("Cast", {"sum"}, "whole")
      .with("to", 7)
      .node("Cast", {"whole"}, "again")
      .with("to", 1);
  return b.gemm("again", "dense", "code");
}

void write(const std::filesystem::path& file, const std::map<std::string, std::string>& files) {
  std::ofstream out(file, std::ios::binary);
  out << fuzz::join(files);
  if (!out.flush()) std::cerr << file << " can't be written\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "Usage: make_corpus BUNDLES PACKETS SAMPLES\n";
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  write(folder / "two_look", {{"manifest.txt", small_manifest_text(true)},
                              {"decoder.onnx", small_hyper_decoder(true, 4, 5).bytes()},
                              {"look1.onnx", small_look1().bytes()},
                              {"look2.onnx", small_look2().bytes()}});
  const std::string plain = small_manifest_text(false);
  write(folder / "plain", {{"manifest.txt", plain},
                           {"decoder.onnx", small_concatenated_decoder({6, 4}).bytes()},
                           {"encoder.onnx", small_plain_encoder().bytes()}});
  write(folder / "varied", {{"manifest.txt", plain},
                            {"decoder.onnx", small_concatenated_decoder({4}).bytes()},
                            {"encoder.onnx", varied_encoder().bytes()}});

  std::filesystem::create_directories(argv[2]);
  int number = 0;
  for (const auto& packet : test::recorded_packets(GATEFIELD_SOURCE_DIR "/tests/data/rtps/recorded.hex"))
    std::ofstream(std::filesystem::path(argv[2]) / ("recorded-" + std::to_string(number++)), std::ios::binary)
        .write(reinterpret_cast<const char*>(packet.data()), static_cast<std::streamsize>(packet.size()));

  std::filesystem::create_directories(argv[3]);
  for (const auto& [name, kind] : fuzz::kWireSeeds) {
    std::ifstream in(std::string(GATEFIELD_SOURCE_DIR "/tests/data/wire/") + name + ".hex");
    const auto bytes = test::bytes_of_hex(std::string(std::istreambuf_iterator<char>(in), {}));
    if (!in || !bytes) {
      std::cerr << "tests/data/wire/" << name << ".hex is missing or no hexadecimal text\n";
      return 2;
    }
    std::ofstream(std::filesystem::path(argv[3]) / name, std::ios::binary)
        .put(static_cast<char>(kind))
        .write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
  }
  return 0;
}
