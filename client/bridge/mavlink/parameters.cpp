#include "client/bridge/mavlink/parameters.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string_view>

namespace gatefield::bridge {
namespace {

mavlink::ParameterName as_name(std::string_view text) noexcept {
  mavlink::ParameterName name{};
  std::copy_n(text.begin(), std::min(text.size(), name.size()), name.begin());
  return name;
}

bool has_thrust_bit(double value) noexcept {
  return value >= 0.0 && value < 1e9 && (static_cast<std::uint32_t>(value) & mavlink::kGuidedThrustAsThrust) != 0;
}

}  // namespace

Parameters::Parameters(Dialect dialect, bool may_set) noexcept : dialect_(dialect), may_set_(may_set) {
  assert(rules(dialect).parameters.size() <= kMost);
  values_.fill(std::numeric_limits<double>::quiet_NaN());
}

Parameters::Request Parameters::tick(Stamp now) noexcept {
  if (done() || (tries_ > 0 && now < next_)) return {};
  if (tries_ == kTries) {
    ++current_;
    tries_ = 0;
    setting_ = false;
    if (done()) return {};
  }
  ++tries_;
  next_ = now + kAnswer;
  const auto name = as_name(rules(dialect_).parameters[current_].name);
  Request request;
  if (setting_) {
    request.set.emplace();
    request.set->param_id = name;
    request.set->param_type = type_;
    request.set->param_value = encoded_parameter(dialect_, wanted_, type_);
  } else {
    request.read.emplace();
    request.read->param_id = name;
  }
  return request;
}

void Parameters::on_value(const mavlink::ParamValue& parameter) noexcept {
  const auto known = rules(dialect_).parameters;
  const auto rule =
      std::ranges::find_if(known, [&](const ParameterRule& r) { return as_name(r.name) == parameter.param_id; });
  if (rule == known.end()) return;
  const auto index = static_cast<std::size_t>(rule - known.begin());
  values_[index] = parameter_value(dialect_, parameter);
  if (index != current_) return;
  const bool missing = rule->use == ParameterRule::Use::kThrustBit && !has_thrust_bit(values_[index]);
  if (missing && setting_) return;  // an answer to the reading before it, or it was not taken: tick() asks again
  tries_ = 0;
  setting_ = missing && may_set_ && values_[index] >= 0.0;
  if (setting_) {
    wanted_ = values_[index] + mavlink::kGuidedThrustAsThrust;
    type_ = parameter.param_type;
  } else {
    ++current_;
  }
}

double Parameters::value(ParameterRule::Use use) const noexcept {
  const auto known = rules(dialect_).parameters;
  for (std::size_t i = 0; i < known.size(); ++i)
    if (known[i].use == use) return values_[i];
  return std::numeric_limits<double>::quiet_NaN();
}

bool Parameters::thrust_is_thrust() const noexcept {
  return dialect_ != Dialect::kArduPilot || has_thrust_bit(value(ParameterRule::Use::kThrustBit));
}

}  // namespace gatefield::bridge
