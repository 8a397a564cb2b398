#include "client/race/tune/default_fields.h"

#include <algorithm>
#include <string>

namespace gatefield::race {
namespace {

constexpr double kFactor = 4.0;

constexpr const char* kAlways[] = {"visibility_weight", "field_weight",     "field_clearance_m", "crossing_weight",
                                   "crossing_margin_m", "body_rate_weight", "speed_weight"};
constexpr const char* kRotors[] = {"rotors_thrust_sigma_s", "rotors_tilt_sigma_rad_s3", "rotors_yaw_sigma_rad_s3"};
constexpr const char* kRates[] = {"rates_thrust_sigma", "rates_tilt_sigma_rad_s", "rates_yaw_sigma_rad_s"};
constexpr const char* kRateChanges[] = {"rates_thrust_change_sigma_s", "rates_tilt_change_sigma_rad_s2",
                                        "rates_yaw_change_sigma_rad_s2"};

}  // namespace

Dimension around_the_base(const ProfileSheet& base, const std::string& name) {
  const ProfileSheet::Field& field = *base.find(name);
  const double value = *base.number(name);
  return {name, std::max(field.min, value / kFactor), std::min(field.max, value * kFactor), true};
}

std::vector<Dimension> default_fields(const ProfileSheet& base, Actuation::Kind kind) {
  std::vector<Dimension> fields;
  const auto add = [&](const std::string& name) {
    if (base.number(name).value_or(0.0) > 0.0) fields.push_back(around_the_base(base, name));
  };
  add(base.number("target_effective_fraction").value_or(0.0) > 0.0 ? "target_effective_fraction" : "temperature");
  for (const char* name : kAlways) add(name);
  if (kind == Actuation::Kind::kRotorThrusts) {
    for (const char* name : kRotors) add(name);
    return fields;
  }
  const ProfileSheet::Field* changes = base.find("rates_by_changes");
  const bool by_changes = changes != nullptr && changes->value == "true";
  if (by_changes)
    for (const char* name : kRateChanges) add(name);
  else
    for (const char* name : kRates) add(name);
  // A correlation is no matter of factors.
  const double correlation = base.number("rates_correlation").value_or(0.0);
  if (!by_changes && base.find("rates_correlation") != nullptr)
    fields.push_back({"rates_correlation", std::min(0.5, correlation), std::max(0.97, correlation), false});
  return fields;
}

}  // namespace gatefield::race
