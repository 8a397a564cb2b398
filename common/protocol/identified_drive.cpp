#include "common/protocol/identified_drive.h"

#include <fmt/format.h>

namespace gatefield::protocol {
namespace {

/// "31, ?, 60": where it is not known, a question mark.
template <typename Values>
std::string list(const Values& values, double scale, int digits) {
  std::string out;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (i > 0) out += ", ";
    out += values[i] > 0.0 ? fmt::format("{:.{}f}", scale * values[i], digits) : "?";
  }
  return out;
}

}  // namespace

std::string in_words(const IdentifiedDrive& found, const Actuation& told) {
  std::string out;
  if (found.thrust_factor > 0.0) out = fmt::format("thrust {:.2f} of what is asked for", found.thrust_factor);
  const bool lags = found.rate_time_constant_s.maxCoeff() > 0.0, limits = found.rate_limit_rad_s.maxCoeff() > 0.0;
  if (!out.empty() && (lags || limits)) out += "; ";
  if (lags || limits) out += "rates ";
  if (lags)
    out += list(found.rate_time_constant_s, 1e3, 0) + " ms behind (told: " + list(told.rate_time_constant_s, 1e3, 0) +
           " ms)";
  if (lags && limits) out += ", ";
  if (limits) out += "at most " + list(found.rate_limit_rad_s, 1.0, 1) + " rad/s";
  return out;
}

}  // namespace gatefield::protocol
