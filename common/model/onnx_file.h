#pragma once

#include <onnx/onnx_pb.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"

/// ONNX files from outside: read and distrusted. What comes back has been checked so far that going through it is safe:
/// a graph of known operators, without control flow or data in other files, every weight complete and finite. Errors
/// name the file and, where there is one, the tensor, and say what was found and expected. Nothing here throws for a
/// bad file. Thread-safe: yes.   Real-time safe: no.
namespace gatefield::model {

inline constexpr std::uintmax_t kMaxFileBytes = 64u << 20;

/// The whole file, at most kMaxFileBytes.
Result<std::string> read_file(const std::filesystem::path& file);

/// @param bytes  the content of `file`, whose name goes into messages
Result<onnx::ModelProto> parse_onnx(const std::filesystem::path& file, const std::string& bytes);

/// Initializer `name` as numbers, row-major. A shape entry of kAnySize fits every size.
inline constexpr std::int64_t kAnySize = -1;
Result<std::vector<float>> tensor(const std::filesystem::path& file, const onnx::GraphProto& graph,
                                  const std::string& name, const std::vector<std::int64_t>& shape);

/// The initializer called `name`, or null.
const onnx::TensorProto* find_tensor(const onnx::GraphProto& graph, const std::string& name);

/// Checks that the graph has an input (an output) of that name, type float and shape.
Status check_input(const std::filesystem::path& file, const onnx::GraphProto& graph, const std::string& name,
                   const std::vector<std::int64_t>& shape);
Status check_output(const std::filesystem::path& file, const onnx::GraphProto& graph, const std::string& name,
                    const std::vector<std::int64_t>& shape);

}  // namespace gatefield::model
