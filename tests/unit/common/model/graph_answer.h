#pragma once

#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "common/model/onnx_file.h"
#include "common/model/onnx_graph.h"
#include "tests/unit/common/model/onnx_builder.h"

namespace gatefield::model {

using Build = std::function<void(OnnxBuilder&)>;

/// "[shape] values", or the error, of what `build` calls "y" for the input x = 0, 1, 2 ... of `shape`.
inline std::string answer(const std::vector<int>& shape, const Build& build, int opset = 13) {
  OnnxBuilder b(opset);
  b.input("x", shape).output("y", {});
  build(b);
  const auto model = parse_onnx("test.onnx", b.bytes());
  if (!model) return model.error();
  const auto graph = Graph::compile("test.onnx", *model);
  if (!graph) return graph.error();
  Array x{{shape.begin(), shape.end()}, {}, false};
  std::size_t count = 1;
  for (const int size : shape) count *= static_cast<std::size_t>(size);
  for (std::size_t i = 0; i < count; ++i) x.values.push_back(static_cast<double>(i));
  const auto evaluation = graph->evaluate({{"x", x}}, {1000, 1000});
  if (!evaluation) return evaluation.error();
  const Array* const y = evaluation->values[static_cast<std::size_t>(graph->slot("y"))];
  std::ostringstream text;
  text << shape_text(y->shape);
  for (const double value : y->values) text << ' ' << value;
  return text.str();
}

}  // namespace gatefield::model
