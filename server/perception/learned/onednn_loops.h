#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/base/result.h"
#include "common/model/onnx_graph.h"

/// What lies between the layers of an encoder's network, as plain loops: pooling over an image, joining, cutting and
/// turning of small tensors, attention. Single precision, row-major, one thread; each by ONNX's definition
/// (common/model/operators has the formulas), for the shapes that the network was folded for.
namespace gatefield::perception {

/// The numbers of a slot, row-major. Written anew at every run, at the same place.
using Numbers = std::shared_ptr<std::vector<float>>;

/// Fills a node's result: as many numbers as graph.shape(node.outputs[0]) has.
/// Thread-safe: no.   Real-time safe: yes (no allocation).
using Loop = std::function<void(float* result)>;

/// The loop of a node: Add, Concat, GlobalAveragePool, GlobalMaxPool, MatMul (batched), Mul, Relu, Resize (to the
/// nearest, by whole scales), Slice (one axis), Softmax (last axis), Transpose.
/// @param graph    folded; not kept
/// @param numbers  gives those of an input's slot; asked for what the loop reads at every run, in the inputs' order
/// Errors: the part of a sentence after "oneDNN isn't asked for": the operator or the case of it that has no loop.
Result<Loop> loop_of(const model::Graph& graph, const model::Node& node,
                     const std::function<Numbers(int slot)>& numbers);

}  // namespace gatefield::perception
