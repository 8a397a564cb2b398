#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace onnx {
class ModelProto;
}

/// What an ONNX graph computes, by ONNX's definition: slow, in double precision, with a bound on work and memory that
/// holds before each node. It says what shapes and how many multiplications a network has, what a decoder's weights are
/// (common/model/decoder_reading.h), and what a fast runtime should answer; folded, it is also what such a runtime is
/// built from, so that ONNX is interpreted in one place. Values are numbered: a slot is an edge of the graph.
/// Errors name file, node and operator. Nothing here throws for a bad graph.
/// Thread-safe: yes (const).   Real-time safe: no.
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

struct Operator;  // onnx_operators.h

/// An attribute's value, whichever kind it is.
struct Attribute {
  double number = 0.0;
  std::int64_t integer = 0;
  std::string word;
  std::vector<std::int64_t> integers;
  std::shared_ptr<const Array> array;
};

struct Node {
  std::string name;  ///< as the file has it; of a nameless one its first output's
  std::string type;
  int position = 0;  ///< in the file's list of nodes
  const Operator* known = nullptr;
  std::map<std::string, Attribute> attributes;  ///< those that the file gives
  std::vector<int> inputs;                      ///< slots; -1 = left out
  std::vector<int> outputs;                     ///< slots; -1 = left out

  // An attribute, or `otherwise` when the file leaves it out.
  std::int64_t integer(const char* attribute, std::int64_t otherwise) const;
  double number(const char* attribute, double otherwise) const;
  std::string word(const char* attribute, const char* otherwise) const;
  std::vector<std::int64_t> integers(const char* attribute, std::vector<std::int64_t> otherwise) const;
};

class Graph {
 public:
  /// @param model  as parse_onnx let it through
  static Result<Graph> compile(const std::filesystem::path& file, const onnx::ModelProto& model);

  /// The same graph for inputs of the shapes that were evaluated: what doesn't depend on the inputs' values is a
  /// constant, nodes that `output` doesn't need are left out, and the shape of every slot is known. Slots stay.
  /// @param evaluation  of this graph, all inputs fed, nothing replaced
  /// @param output      slot of the only output
  Graph folded(const Evaluation& evaluation, int output) const;

  /// @param inputs    by name
  /// @param replaced  results that are taken from here instead of from the node that makes them, by slot
  Result<Evaluation> evaluate(const std::map<std::string, Array>& inputs, const Limits& limits,
                              const std::map<int, Array>& replaced = {}) const;

  /// In an order in which they can be computed; constants have none.
  std::span<const Node> nodes() const noexcept { return nodes_; }
  /// The version of ONNX's operators that the file was written with.
  int operator_set() const noexcept { return opset_; }
  /// -1 when the graph has nothing of that name.
  int slot(const std::string& name) const;
  /// What a slot always holds: a weight, or what was folded; null when that depends on the inputs, and for -1.
  const Array* constant(int slot) const;
  /// Sizes of what a slot holds. @pre the graph is folded, and the slot an input, a constant or a node's output
  const std::vector<std::int64_t>& shape(int slot) const { return shapes_.at(static_cast<std::size_t>(slot)); }

 private:
  std::filesystem::path file_;
  int opset_ = 0;
  std::vector<Node> nodes_;
  std::map<std::string, int> slots_;
  std::vector<int> inputs_;  ///< slots
  std::map<int, std::shared_ptr<const Array>> constants_;
  std::vector<std::vector<std::int64_t>> shapes_;  ///< by slot; empty until folded
};

/// The operators that a network may be made of: those that Graph evaluates, with their allowed attributes.
bool known_operator(std::string_view type);
/// All of them, for messages.
std::string operator_names();

}  // namespace gatefield::model
