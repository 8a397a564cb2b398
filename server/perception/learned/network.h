#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/model/bundle.h"

namespace gatefield::perception {

/// A network of a bundle that is ready to run by some means. Inputs are the bundle's, in its order.
/// Thread-safe: no.   Real-time safe: bounded, may allocate.
class LoadedNetwork {
 public:
  virtual ~LoadedNetwork() = default;
  /// Memory of an input, row-major, to be written before run().
  virtual std::span<float> input(const std::string& name) = 0;
  /// @return the output's numbers; empty when they aren't `size` finite ones
  virtual std::optional<std::vector<float>> run(std::size_t size) = 0;
};

/// Through oneDNN, from the network's folded graph: convolutions and dense layers are its primitives with their weights
/// laid out once, what lies between them (small tensors) is plain loops (onednn_loops.h). The error says which operator
/// is not among those that are mapped; such a network runs through OpenCV. One thread, the caller's, whatever OpenMP is
/// set to.
Result<std::unique_ptr<LoadedNetwork>> onednn_network(const model::Network& network);
/// Whether this build has oneDNN.
bool onednn_built_in() noexcept;

/// Through OpenCV dnn, which knows many more operators.
Result<std::unique_ptr<LoadedNetwork>> opencv_network(const model::Network& network);

/// Why what it makes of the bundle's test case is not what ONNX's definition says; empty when it is.
std::string disagreement(LoadedNetwork& candidate, const model::Network& network);

}  // namespace gatefield::perception
