#pragma once

#include <span>

namespace gatefield::gates {

/// The Gate-SDF of one gate: signed distance in metres at points in the world frame, wherever it comes from (the
/// network's decoder in the product, the hourglass of a known pose in tests and baselines). Whoever makes a field
/// decides how it is held: what crosses threads is std::shared_ptr<const Field>, and a field that is shared does not
/// change any more.
/// Thread-safe: evaluate() may run on several threads at once.   Real-time safe: evaluate(); making and destroying a
/// field is not.
class Field {
 public:
  virtual ~Field() = default;
  /// sdf[i] = s(x[i], y[i], z[i]); all four spans have the same size.
  virtual void evaluate(std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
                        std::span<float> sdf_m) const noexcept = 0;
};

}  // namespace gatefield::gates
