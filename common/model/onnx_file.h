#pragma once

#include <onnx/onnx_pb.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/model/onnx_tensor.h"

/// ONNX files from outside: read and distrusted. What comes back has been checked so far that going through it is safe:
/// a graph of known operators and a known operator set, of bounded size, without functions, control flow or data in
/// other files (what the file had of these was brought in); Graph::compile looks at the weights. Errors name the file
/// and, where there is one, the tensor or node, and say what was found and expected. Nothing here throws for a bad
/// file. Thread-safe: yes.   Real-time safe: no.
namespace gatefield::model {

inline constexpr std::uintmax_t kMaxFileBytes = 64u << 20;  ///< of any file of a model

/// What is wrong with a file of a model: kUnreadable, "<file>: <what>".
Error file_error(const std::filesystem::path& file, const std::string& what);

inline constexpr int kMaxNodes = 2000;  ///< of a graph, functions inlined

/// Whether parsing `bytes` as a message of this type takes bounded memory.
/// @param fields  counts those of all pieces of a file
bool safe_to_parse(const std::string& bytes, const google::protobuf::Descriptor* type, int* fields);

/// Whether operators of this domain are ONNX's own.
inline bool is_standard(const std::string& domain) { return domain.empty() || domain == "ai.onnx"; }

/// @param bytes   the content of `file`, whose name goes into messages
/// @param output  of several outputs this one stays, and what it needs; the others aren't looked at
/// @param beside  gives files that hold weights
Result<onnx::ModelProto> parse_onnx(const std::filesystem::path& file, const std::string& bytes,
                                    const std::string& output = "", const Beside& beside = {});

/// The tensors of a file without nodes, by name.
Result<std::map<std::string, Array>> parse_tensors(const std::filesystem::path& file, const std::string& bytes);

/// The version of ONNX's operators that the file was written with; 0 = it doesn't say.
int operator_set(const onnx::ModelProto& model);

/// In the shape of a port: the file must leave the number open.
inline constexpr std::int64_t kOpenSize = -1;

/// An input or output that a network has to have.
struct Port {
  std::string name;
  std::vector<std::int64_t> shape;
};

/// Checks that the graph has exactly these inputs of type float, and this output. Sizes of inputs may be open. The
/// output's shape is not looked at: what a file says of it is often vague, and evaluating the graph tells.
Status check_ports(const std::filesystem::path& file, const onnx::GraphProto& graph, const std::vector<Port>& inputs,
                   const std::string& output);

/// A name from a file, for messages: in quotes, printable, not endless.
std::string in_quotes(const std::string& name);
/// "[1, 2, 3]"
std::string shape_text(const std::vector<std::int64_t>& shape);

}  // namespace gatefield::model
