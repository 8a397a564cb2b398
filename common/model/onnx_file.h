#pragma once

#include <onnx/onnx_pb.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"

/// ONNX files from outside: read and distrusted. What comes back has been checked so far that going through it is safe:
/// a graph of known operators and a known operator set, of bounded size, without control flow or data in other files,
/// every weight complete and finite. Errors name the file and, where there is one, the tensor or node, and say what was
/// found and expected. Nothing here throws for a bad file. Thread-safe: yes.   Real-time safe: no.
namespace gatefield::model {

inline constexpr std::uintmax_t kMaxFileBytes = 64u << 20;  ///< of any file of a model

/// What is wrong with a file of a model: kUnreadable, "<file>: <what>".
Error file_error(const std::filesystem::path& file, const std::string& what);

/// @param bytes  the content of `file`, whose name goes into messages
Result<onnx::ModelProto> parse_onnx(const std::filesystem::path& file, const std::string& bytes);

/// The version of ONNX's operators that the file was written with; 0 = it doesn't say.
int operator_set(const onnx::ModelProto& model);

/// In the shape of a port: any number will do; the file must leave it open.
inline constexpr std::int64_t kAnySize = -1;
inline constexpr std::int64_t kOpenSize = -2;

/// An input or output that a network has to have.
struct Port {
  std::string name;
  std::vector<std::int64_t> shape;
};

/// Checks that the graph has exactly these inputs of type float, and only this output. The output's shape is not looked
/// at: what a file says of it is often vague, and evaluating the graph tells.
Status check_ports(const std::filesystem::path& file, const onnx::GraphProto& graph, const std::vector<Port>& inputs,
                   const std::string& output);

/// A name from a file, for messages: in quotes, printable, not endless.
std::string in_quotes(const std::string& name);
/// "[1, 2, 3]"
std::string shape_text(const std::vector<std::int64_t>& shape);

}  // namespace gatefield::model
