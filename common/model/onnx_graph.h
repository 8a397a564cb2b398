#pragma once

#include <onnx/onnx_pb.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

/// What an ONNX graph computes, by ONNX's definition: slow, in double precision, with a bound on work and memory that
/// holds before each node. It says what shapes and how many multiplications a network has, what a decoder's weights are
/// (common/model/decoder_reading.h), and what a fast runtime should answer. Errors name file, node and operator.
/// Nothing here throws for a bad graph. Thread-safe: yes (const).   Real-time safe: no.
namespace gatefield::model {

/// What goes along an edge of a graph.
struct Array {
  std::vector<std::int64_t> shape;
  std::vector<double> values;  ///< row-major
  bool integer = false;        ///< int32, int64 or bool in the file
};

/// Work that an evaluation may take; what exceeds it is an error.
struct Limits {
  std::int64_t multiply_adds = 0;
  std::int64_t numbers = 0;  ///< elements of all results together
};

struct Evaluation {
  std::vector<const Array*> values;  ///< by slot; null where nothing was computed. Not valid beyond the graph's life.
  std::vector<std::unique_ptr<Array>> made;
  std::int64_t multiply_adds = 0;
};

struct Call;  // onnx_operators.h
using Operation = void (*)(Call&);

/// An attribute's value, whichever kind it is.
struct Attribute {
  double number = 0.0;
  std::int64_t integer = 0;
  std::string word;
  std::vector<std::int64_t> integers;
};

struct Node {
  std::string name;  ///< printable, as messages show it
  std::string type;
  Operation operation = nullptr;
  std::map<std::string, Attribute> attributes;
  std::vector<int> inputs;   ///< slots; -1 = left out
  std::vector<int> outputs;  ///< slots; -1 = left out
};

class Graph {
 public:
  /// @param model  as parse_onnx let it through
  static Result<Graph> compile(const std::filesystem::path& file, const onnx::ModelProto& model);

  /// @param inputs    by name
  /// @param replaced  results that are taken from here instead of from the node that makes them, by slot
  Result<Evaluation> evaluate(const std::map<std::string, Array>& inputs, const Limits& limits,
                              const std::map<int, Array>& replaced = {}) const;

  std::span<const Node> nodes() const noexcept { return nodes_; }
  /// -1 when the graph has nothing of that name.
  int slot(const std::string& name) const;

 private:
  std::filesystem::path file_;
  int opset_ = 0;
  std::vector<Node> nodes_;
  std::map<std::string, int> slots_;
  std::map<int, std::shared_ptr<const Array>> constants_;
};

/// The operators that a network may be made of: those that Graph evaluates, with their allowed attributes.
bool known_operator(std::string_view type);
/// All of them, for messages.
std::string operator_names();

}  // namespace gatefield::model
