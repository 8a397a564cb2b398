#include "common/model/operators/reduction.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/model/onnx_file.h"
#include "common/model/operators/arrays.h"

namespace gatefield::model::operators {
namespace {

enum class Reduction { kSum, kMean, kMax, kMin, kProduct, kL2 };

template <Reduction kKind>
void reduce(Call& call) {
  const Array& in = call.input(0);
  const auto axes = axes_of(call);
  const bool all = axes.empty() && call.integer("noop_with_empty_axes", 0) == 0;
  std::vector<bool> gone(in.shape.size(), all);
  for (const std::int64_t axis : axes) gone[axis_of(axis, in.shape.size())] = true;
  const bool keep = call.integer("keepdims", 1) != 0;
  Shape shape, strides(in.shape.size(), 0);
  for (std::size_t d = 0; d < in.shape.size(); ++d) {
    if (!gone[d] || keep) shape.push_back(gone[d] ? 1 : in.shape[d]);
  }
  std::int64_t stride = 1, count = 1;
  for (std::size_t d = in.shape.size(); d-- > 0;) {
    if (gone[d]) {
      count = product({count, in.shape[d]});
    } else {
      strides[d] = stride;
      stride *= in.shape[d];
    }
  }
  expect(count > 0, "has an empty input");
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Array& out = call.result(shape, in.integer && kKind != Reduction::kMean && kKind != Reduction::kL2);
  std::fill(out.values.begin(), out.values.end(),
            kKind == Reduction::kMax       ? -kInfinity
            : kKind == Reduction::kMin     ? kInfinity
            : kKind == Reduction::kProduct ? 1.0
                                           : 0.0);
  walk<1>(in.shape, {strides}, {0}, [&](std::int64_t n, const auto& to) {
    const double x = in.values[at(n)];
    double& sofar = out.values[at(to[0])];
    switch (kKind) {
      case Reduction::kSum:
      case Reduction::kMean:
        sofar += x;
        break;
      case Reduction::kMax:
        sofar = std::max(sofar, x);
        break;
      case Reduction::kMin:
        sofar = std::min(sofar, x);
        break;
      case Reduction::kProduct:
        sofar *= x;
        break;
      case Reduction::kL2:
        sofar += x * x;
        break;
    }
  });
  for (double& x : out.values) {
    if (kKind == Reduction::kMean) x /= static_cast<double>(count);
    if (kKind == Reduction::kL2) x = std::sqrt(x);
  }
}

}  // namespace

void reduce_l2(Call& call) { reduce<Reduction::kL2>(call); }
void reduce_max(Call& call) { reduce<Reduction::kMax>(call); }
void reduce_mean(Call& call) { reduce<Reduction::kMean>(call); }
void reduce_min(Call& call) { reduce<Reduction::kMin>(call); }
void reduce_prod(Call& call) { reduce<Reduction::kProduct>(call); }
void reduce_sum(Call& call) { reduce<Reduction::kSum>(call); }

}  // namespace gatefield::model::operators
