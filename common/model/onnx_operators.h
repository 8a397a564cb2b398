#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/model/onnx_graph.h"

/// The operators behind Graph::evaluate: the table that finds one by its type, and what one gets to work with. What
/// they compute lies in operators/, a header per family. Included by onnx_graph.cpp and the operators only.
namespace gatefield::model {

/// Why a node can't be computed: a part of a sentence. Stays inside Graph::evaluate.
struct Refusal : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One node at work.
struct Call {
  const Node& node;
  int opset;
  std::vector<const Array*> in;
  std::vector<std::unique_ptr<Array>> out;  ///< as many as the node has outputs; filled by the operation
  Limits left;

  /// Input i. Refuses when it was left out.
  const Array& input(std::size_t i) const;
  bool has(std::size_t i) const { return i < in.size() && in[i] != nullptr; }
  /// Makes output `i` of zeros, if the budget allows it.
  Array& result(const std::vector<std::int64_t>& shape, bool integer, std::size_t i = 0);
  /// Takes multiplications from the budget.
  void spend(double multiply_adds);

  std::int64_t integer(const char* name, std::int64_t otherwise) const { return node.integer(name, otherwise); }
  double number(const char* name, double otherwise) const { return node.number(name, otherwise); }
  std::string word(const char* name, const char* otherwise) const { return node.word(name, otherwise); }
  std::vector<std::int64_t> integers(const char* name, std::vector<std::int64_t> otherwise) const {
    return node.integers(name, std::move(otherwise));
  }
};

using Operation = void (*)(Call&);
using Unary = double (*)(double);
using Binary = double (*)(double, double);

/// A line of the table of operators.
struct Operator {
  std::string_view type;  ///< as ONNX calls it
  Operation operation;    ///< null: nothing to compute (Constant)
  std::size_t min_inputs;
  std::size_t max_inputs;
  std::size_t max_outputs;
  std::string_view attributes;  ///< the allowed ones, each between spaces
  Unary unary = nullptr;  ///< the formula, for operations that all elements go through alone (operators/elementwise.h)
  Binary binary = nullptr;
};

/// Null when there is no such operator.
const Operator* find_operator(std::string_view type);

}  // namespace gatefield::model
