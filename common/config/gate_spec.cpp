#include "common/config/gate_spec.h"

namespace gatefield::config {

GateShape::Opening to_opening(GateSpec::Opening opening) noexcept {
  return opening == GateSpec::ROUND ? GateShape::Opening::kRound : GateShape::Opening::kSquare;
}

GateShape to_shape(const GateSpec& spec) noexcept {
  GateShape shape;
  shape.opening = to_opening(spec.opening());
  shape.inner_half_m = spec.inner_half_m();
  shape.outer_half_m = spec.outer_half_m();
  shape.thickness_m = spec.thickness_m();
  return shape;
}

void put_shape(const GateShape& shape, GateSpec* spec) {
  spec->set_opening(shape.opening == GateShape::Opening::kRound ? GateSpec::ROUND : GateSpec::SQUARE);
  spec->set_inner_half_m(shape.inner_half_m);
  spec->set_outer_half_m(shape.outer_half_m);
  spec->set_thickness_m(shape.thickness_m);
}

}  // namespace gatefield::config
