#include "common/vehicle/actuation.h"

#include <string>

#include "common/base/text.h"

namespace gatefield {
namespace {

Status check_lag(const std::string& field, double lag_s, bool wanted) {
  if (!wanted)
    return lag_s == 0.0 ? Status{}
                        : Error::invalid(field, text(lag_s) + " s", "0 for a vehicle driven by rotor thrusts");
  if (lag_s >= 0.001 && lag_s <= 1.0) return {};
  return Error::invalid(field, text(lag_s) + " s", "0.001 to 1 s");
}

}  // namespace

Status validate(const Actuation& actuation) {
  if (actuation.kind != Actuation::Kind::kRotorThrusts && actuation.kind != Actuation::Kind::kBodyRates)
    return Error::invalid("actuation.kind", text(static_cast<int>(actuation.kind)),
                          "0 (rotor thrusts) or 1 (collective thrust and body rates)");
  const bool rates = actuation.kind == Actuation::Kind::kBodyRates;
  if (auto s = check_lag("actuation.thrust_time_constant_s", actuation.thrust_time_constant_s, rates); !s) return s;
  for (Eigen::Index i = 0; i < 3; ++i)
    if (auto s = check_lag("actuation.rate_time_constant_s[" + text(i) + "]", actuation.rate_time_constant_s[i], rates);
        !s)
      return s;
  return {};
}

}  // namespace gatefield
