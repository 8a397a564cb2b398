#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/model/onnx_file.h"
#include "common/model/onnx_graph.h"

namespace gatefield::model {

/// Holds a graph against inputs and an output that came with it, made by what it was trained with.
/// @param file   named in sentences; `bytes`: its content, an ONNX file of tensors with the ports' names and `output`'s
/// @param ports  the graph's inputs
/// Errors: with the file, and what of it is missing, of another shape or not what the graph gives.
/// Thread-safe: yes.   Real-time safe: no.
Status hold_test_vectors(const std::filesystem::path& file, const std::string& bytes, const Graph& graph,
                         const std::vector<Port>& ports, const std::string& output, const Limits& limits);

}  // namespace gatefield::model
