#pragma once

#include "common/config/course.pb.h"
#include "common/geometry/gate.h"

/// A gate's shape as it stands in text files, for course and frame alike. Thread-safe: yes.   Real-time safe: no.
namespace gatefield::config {

GateShape::Opening to_opening(GateSpec::Opening opening) noexcept;

/// Unchecked; gatefield::validate(GateShape) says what is wrong with it.
GateShape to_shape(const GateSpec& spec) noexcept;
void put_shape(const GateShape& shape, GateSpec* spec);

}  // namespace gatefield::config
