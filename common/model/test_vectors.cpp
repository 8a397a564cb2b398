#include "common/model/test_vectors.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace gatefield::model {
namespace {

/// How far a network may be from its test vectors, as part of the largest number: single precision, or half weights.
constexpr double kSameAnswer = 2e-3;

}  // namespace

Status hold_test_vectors(const std::filesystem::path& file, const std::string& bytes, const Graph& graph,
                         const std::vector<Port>& ports, const std::string& output, const Limits& limits) {
  const Result<std::map<std::string, Array>> vectors = parse_tensors(file, bytes);
  if (!vectors.ok()) return vectors.failure();
  std::map<std::string, Array> inputs;
  for (const Port& port : ports) {
    const auto given = vectors->find(port.name);
    const bool fits = given != vectors->end() && given->second.shape.size() == port.shape.size() &&
                      std::equal(port.shape.begin(), port.shape.end(), given->second.shape.begin(),
                                 [](std::int64_t a, std::int64_t b) { return a == b || (a == kOpenSize && b > 0); });
    if (!fits) {
      return file_error(file, "has " + in_quotes(port.name) + " of shape " +
                                  (given == vectors->end() ? "nothing" : shape_text(given->second.shape)) +
                                  ", expected " + shape_text(port.shape));
    }
    inputs[port.name] = {given->second.shape, given->second.values, false};
  }
  const Result<Evaluation> evaluation = graph.evaluate(inputs, limits);
  if (!evaluation.ok()) return evaluation.failure();
  const int slot = graph.slot(output);
  const Array* const answer = slot < 0 ? nullptr : evaluation->values[static_cast<std::size_t>(slot)];
  const auto expected = vectors->find(output);
  if (expected == vectors->end() || answer == nullptr || expected->second.values.size() != answer->values.size()) {
    return file_error(file, "has no tensor " + in_quotes(output) + " as large as what the network gives, " +
                                (answer == nullptr ? "nothing" : shape_text(answer->shape)));
  }
  double largest = 1.0;
  for (const double value : expected->second.values) largest = std::max(largest, std::abs(value));
  for (std::size_t i = 0; i < answer->values.size(); ++i) {
    if (std::abs(answer->values[i] - expected->second.values[i]) <= kSameAnswer * largest) continue;
    return file_error(file, "says that element " + std::to_string(i) + " of " + in_quotes(output) + " is " +
                                std::to_string(expected->second.values[i]) + ", the network gives " +
                                std::to_string(answer->values[i]) +
                                ": the two are not of one export; export both again, after .eval()");
  }
  return {};
}

}  // namespace gatefield::model
