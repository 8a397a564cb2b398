#pragma once

#include <onnx/onnx_pb.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "common/model/onnx_graph.h"

/// The tensors of ONNX files. Thread-safe: yes.   Real-time safe: no.
namespace gatefield::model {

/// The content of a file beside the ONNX file, by its plain name; empty: there is none. Stays where it is until the
/// ONNX file has been read.
using Beside = std::function<Result<const std::string*>(const std::string& name)>;

/// Brings data that torch.onnx.export put into other files (external_data) into `proto`.
/// @param room  bytes that the tensors of this file may still take; gets less
/// Errors: a name that leads out of the folder, a piece that the file doesn't have, more than `room`.
Status bring_in(const std::filesystem::path& file, const std::string& name, const Beside& beside, std::size_t* room,
                onnx::TensorProto* proto);

/// The numbers of a tensor, be they half, single or integer ones, whole and finite.
/// @param name  for messages
Result<Array> array_of(const std::filesystem::path& file, const std::string& name, const onnx::TensorProto& proto);

/// "ONNX data type 11 (DOUBLE)"
std::string type_text(int type);

}  // namespace gatefield::model
