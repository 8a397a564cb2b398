#include "server/planner/profile.h"

#include <string>

#include "common/base/text.h"

namespace gatefield::planner {

Status validate(const Profile& profile) {
  const auto wrong = [](const std::string& field, const std::string& value, const std::string& expected) {
    return Error::invalid("profile." + field, value, expected);
  };
  if (profile.name.empty() || profile.name.size() > 63)
    return wrong("name", "'" + profile.name + "'", "1 to 63 characters");
  for (const IntegerField& field : kIntegerFields) {
    const int value = profile.*field.member;
    if (value < field.min || value > field.max)
      return wrong(field.name, text(value), text(field.min) + " to " + text(field.max));
  }
  for (const NumberField& field : kNumberFields) {
    const double value = profile.*field.member;
    if (!(value >= field.min && value <= field.max))
      return wrong(field.name, text(value), text(field.min) + " to " + text(field.max));
  }
  if (profile.samples % 16 != 0) return wrong("samples", text(profile.samples), "a multiple of 16");
  if (profile.temperature_min > profile.temperature_max)
    return wrong("temperature_min", text(profile.temperature_min), "at most temperature_max");
  if (profile.altitude_min_m >= profile.altitude_max_m)
    return wrong("altitude_min_m", text(profile.altitude_min_m), "less than altitude_max_m");
  if (profile.field_fresh_s >= profile.field_stale_s)
    return wrong("field_fresh_s", text(profile.field_fresh_s), "less than field_stale_s");
  return {};
}

}  // namespace gatefield::planner
