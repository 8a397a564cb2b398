#pragma once

#include <vector>

#include "client/race/tune/space.h"
#include "common/vehicle/actuation.h"

namespace gatefield::race {

/// A field without a range that anybody said: a quarter of the base's value to four times of it, within what the field
/// may be, by its logarithm. @pre the base has the field, and more than 0 there
Dimension around_the_base(const ProfileSheet& base, const std::string& name);

/// What is looked for when nobody says: weights, temperature (or the effective samples), clearances, and the sampling
/// noise of the way that the vehicle is driven. progress_weight is not among them: costs and temperature count by each
/// other, so that one of them is the unit. What the base has switched off (0) is left out.
std::vector<Dimension> default_fields(const ProfileSheet& base, Actuation::Kind kind);

}  // namespace gatefield::race
