#pragma once

#include <onnx/onnx_pb.h>

#include <filesystem>

#include "common/base/result.h"

/// Functions of ONNX graphs.
namespace gatefield::model {

/// Every call in the graph becomes the nodes of what it calls: functions that the file brings along (local functions:
/// an exporter's library, a person's modules), and operators that ONNX itself defines by others (LayerNormalization,
/// GroupNormalization, Gelu, Swish, Mish), so that everything after knows primitive operators only.
/// Errors: calls without end, more nodes or bytes than a network may have, a function for another operator set.
/// Thread-safe: yes.   Real-time safe: no.
Status inline_functions(const std::filesystem::path& file, onnx::ModelProto* model);

}  // namespace gatefield::model
