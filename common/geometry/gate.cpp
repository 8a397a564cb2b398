#include "common/geometry/gate.h"

#include <string>

#include "common/base/text.h"

namespace gatefield {

Status validate(const GateShape& shape) {
  const auto wrong = [](const char* field, double value, const char* expected) {
    return Error::invalid(std::string("gate.") + field, text(value), expected);
  };
  if (!(shape.inner_half_m >= 0.1 && shape.inner_half_m <= 5))
    return wrong("inner_half_m", shape.inner_half_m, "0.1 to 5 m");
  if (!(shape.outer_half_m > shape.inner_half_m && shape.outer_half_m <= 5))
    return wrong("outer_half_m", shape.outer_half_m, "more than inner_half_m and at most 5 m");
  if (!(shape.thickness_m >= 0.005 && shape.thickness_m <= 1))
    return wrong("thickness_m", shape.thickness_m, "0.005 to 1 m");
  return {};
}

}  // namespace gatefield
