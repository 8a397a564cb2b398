#pragma once

#include <onnx/onnx_pb.h>

#include "common/model/onnx_graph.h"

namespace gatefield::model {

/// The same network in a form that simple runtimes read (OpenCV's importer knows little of shape arithmetic): what
/// doesn't depend on the inputs is written as a weight, what the output doesn't need is left out, and parameters that
/// newer operator sets take as inputs (bounds of Clip, axes of ReduceSum and Squeeze, parts of Split) are attributes
/// again, as they were before.
/// @param evaluation  of `graph`, compiled from `model`; shapes of the inputs are the ones that the network is made for
/// @param output      name of the only output
onnx::ModelProto simplified(const onnx::ModelProto& model, const Graph& graph, const Evaluation& evaluation,
                            const std::string& output);

}  // namespace gatefield::model
