#include "common/protocol/identified_drive.h"

#include <fmt/format.h>

namespace gatefield::protocol {

std::string in_words(const IdentifiedDrive& found, const Actuation& told) {
  std::string out;
  if (found.thrust_factor > 0.0) out = fmt::format("thrust {:.2f} of what is asked for", found.thrust_factor);
  if (!(found.rate_time_constant_s.maxCoeff() > 0.0)) return out;
  const auto ms = [](double lag_s) { return lag_s > 0.0 ? fmt::format("{:.0f}", 1e3 * lag_s) : std::string("?"); };
  const auto list = [&](const auto& lags_s) {
    return ms(lags_s[0]) + ", " + ms(lags_s[1]) + ", " + ms(lags_s[2]) + " ms";
  };
  if (!out.empty()) out += "; ";
  return out + "rates " + list(found.rate_time_constant_s) + " behind (told: " + list(told.rate_time_constant_s) + ")";
}

}  // namespace gatefield::protocol
