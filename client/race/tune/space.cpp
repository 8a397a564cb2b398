#include "client/race/tune/space.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/text.h"

namespace gatefield::race {
namespace {

double position(const Dimension& d, double value) {
  if (d.logarithmic) return std::log(value / d.min) / std::log(d.max / d.min);
  return (value - d.min) / (d.max - d.min);
}

Status check(const Dimension& d, const ProfileSheet& base) {
  const std::string who = "field '" + d.name + "': ";
  const ProfileSheet::Field* field = base.find(d.name);
  if (field == nullptr || !field->has_range || !base.number(d.name)) {
    std::string names;
    for (const ProfileSheet::Field& known : base.fields())
      if (known.has_range) names += (names.empty() ? "" : ", ") + known.name;
    return Error{who + "is no number of the profile '" + base.name() + "', expected one of " + names,
                 ErrorCode::kUnknownName, d.name};
  }
  const std::string range = brief(field->min) + " to " + brief(field->max);
  if (!(d.min >= field->min)) return Error::invalid(d.name + ".min", brief(d.min), range).within(who);
  if (!(d.max <= field->max)) return Error::invalid(d.name + ".max", brief(d.max), range).within(who);
  if (!(d.min < d.max)) return Error::invalid(d.name + ".min", brief(d.min), "less than max").within(who);
  if (d.logarithmic && !(d.min > 0.0))
    return Error::invalid(d.name + ".min", brief(d.min), "more than 0, or scale: LINEAR").within(who);
  const double value = *base.number(d.name);
  if (value < d.min || value > d.max)
    return Error{who + "the base has " + brief(value) + ", expected a range with that in it, not " + brief(d.min) +
                     " to " + brief(d.max) + ": the search begins there",
                 ErrorCode::kInvalid, d.name};
  return {};
}

}  // namespace

Result<Space> Space::make(std::vector<Dimension> dimensions, const ProfileSheet& base) {
  if (dimensions.empty())
    return Error{"field: there is none, expected at least one field of the profile '" + base.name() + "'",
                 ErrorCode::kInvalid, "field"};
  std::set<std::string> names;
  for (const Dimension& d : dimensions) {
    if (auto status = check(d, base); !status) return status.failure();
    if (!names.insert(d.name).second)
      return Error{"field '" + d.name + "' stands there twice, expected each field once", ErrorCode::kInvalid, d.name};
  }
  Space space(std::move(dimensions), base);
  for (const Dimension& d : space.dimensions_) space.start_.push_back(position(d, *base.number(d.name)));
  return space;
}

std::string Space::value(const Point& point, std::size_t dimension) const {
  const Dimension& d = dimensions_[dimension];
  // The base itself is no rounded one.
  if (point[dimension] == start_[dimension]) return base_.find(d.name)->value;
  const double x = std::clamp(point[dimension], 0.0, 1.0);
  const double exact = d.logarithmic ? d.min * std::pow(d.max / d.min, x) : d.min + x * (d.max - d.min);
  const double rounded = std::stod(fmt::format("{:.4g}", exact));
  return fmt::format("{}", std::clamp(rounded, d.min, d.max));
}

ProfileSheet Space::profile(const Point& point) const {
  ProfileSheet sheet = base_;
  for (std::size_t i = 0; i < dimensions_.size(); ++i) sheet.set(dimensions_[i].name, value(point, i));
  return sheet;
}

double Space::outside(const Point& point) noexcept {
  double sum = 0.0;
  for (const double x : point) {
    const double beyond = x - std::clamp(x, 0.0, 1.0);
    sum += beyond * beyond;
  }
  return sum;
}

}  // namespace gatefield::race
