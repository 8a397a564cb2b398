#pragma once

#include <onnx/onnx_pb.h>

#include <string>

#include "common/model/onnx_graph.h"

namespace gatefield::model {

/// A folded network (Graph::folded) in a form that simple runtimes read (OpenCV's importer knows little of shape
/// arithmetic): its constants are weights, and parameters that newer operator sets take as inputs (bounds of Clip, axes
/// of ReduceSum and Squeeze, parts of Split) are attributes again, as they were before.
/// @param model   what the graph was compiled from: says how its nodes, inputs and output are written
/// @param graph   folded
/// @param output  name of the only output
onnx::ModelProto simplified(const onnx::ModelProto& model, const Graph& graph, const std::string& output);

}  // namespace gatefield::model
