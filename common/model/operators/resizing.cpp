#include "common/model/operators/resizing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/model/onnx_file.h"
#include "common/model/operators/arrays.h"

namespace gatefield::model::operators {

void resize(Call& call) {
  const Array& in = call.input(0);
  const std::string mode = call.word("mode", "nearest");
  const std::string where_from = call.word("coordinate_transformation_mode", "half_pixel");
  const std::string rounding = call.word("nearest_mode", "round_prefer_floor");
  expect(mode == "nearest" || mode == "linear", "has mode '" + mode + "', expected 'nearest' or 'linear'");
  expect(where_from == "half_pixel" || where_from == "pytorch_half_pixel" || where_from == "align_corners" ||
             where_from == "asymmetric",
         "has coordinate_transformation_mode '" + where_from + "'");
  expect(
      rounding == "round_prefer_floor" || rounding == "round_prefer_ceil" || rounding == "floor" || rounding == "ceil",
      "has nearest_mode '" + rounding + "'");
  expect(call.integer("exclude_outside", 0) == 0, "has exclude_outside 1, expected 0");
  expect(call.integer("antialias", 0) == 0, "has antialias 1, expected 0 (antialias=False of F.interpolate)");
  expect(call.word("keep_aspect_ratio_policy", "stretch") == "stretch", "has a keep_aspect_ratio_policy");
  const std::size_t rank = in.shape.size();
  const bool sized = call.has(3) && !call.input(3).values.empty();
  expect(sized || (call.has(2) && call.input(2).values.size() == rank),
         "has neither scales nor sizes for " + shape_text(in.shape));
  expect(!sized || call.input(3).values.size() == rank, "has sizes that don't fit " + shape_text(in.shape));

  Array now{in.shape, in.values, false};
  for (std::size_t d = 0; d < rank; ++d) {
    const std::int64_t before = in.shape[d];
    expect(before > 0, "has an empty input");
    double scale = sized ? static_cast<double>(to_integer(call.input(3).values[d])) / static_cast<double>(before)
                         : call.input(2).values[d];
    expect(scale > 0.0 && scale <= 4096.0,
           "enlarges by " + std::to_string(scale) + ", expected more than 0 up to 4096");
    const std::int64_t after =
        sized ? to_integer(call.input(3).values[d]) : to_integer(std::floor(static_cast<double>(before) * scale));
    expect(after >= 1, "makes dimension " + std::to_string(d) + " empty");
    if (after == before && scale == 1.0) continue;
    Shape shape = now.shape;
    shape[d] = after;
    Array& out = call.result(shape, false);
    const std::int64_t outer = product(shape, 0, d), inner = product(shape, d + 1, rank);
    for (std::int64_t i = 0; i < after; ++i) {
      const auto o = static_cast<double>(i);
      double x = 0.0;
      if (where_from == "asymmetric") {
        x = o / scale;
      } else if (where_from == "align_corners") {
        x = after == 1 ? 0.0 : o * static_cast<double>(before - 1) / static_cast<double>(after - 1);
      } else if (where_from == "half_pixel" || after > 1) {
        x = (o + 0.5) / scale - 0.5;
      }
      double w = 0.0;
      std::int64_t low = 0;
      if (mode == "linear") {
        low = to_integer(std::floor(x));
        w = x - std::floor(x);
      } else {
        low = to_integer(rounding == "floor"               ? std::floor(x)
                         : rounding == "ceil"              ? std::ceil(x)
                         : rounding == "round_prefer_ceil" ? std::floor(x + 0.5)
                                                           : std::ceil(x - 0.5));
      }
      const std::int64_t a = std::clamp(low, std::int64_t{0}, before - 1),
                         b = std::clamp(low + 1, std::int64_t{0}, before - 1);
      for (std::int64_t p = 0; p < outer; ++p) {
        for (std::int64_t q = 0; q < inner; ++q) {
          out.values[at((p * after + i) * inner + q)] = (1.0 - w) * now.values[at((p * before + a) * inner + q)] +
                                                        w * now.values[at((p * before + b) * inner + q)];
        }
      }
    }
    now = out;
  }
  call.result(now.shape, false).values = std::move(now.values);
}

}  // namespace gatefield::model::operators
