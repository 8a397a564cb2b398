#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "client/bridge/mavlink/dialect.h"
#include "common/base/clock.h"

namespace gatefield::bridge {

/// Reads the few parameters of the dialect that matter, one after the other, each asked for again until it is there or
/// kTries were in vain; and sets the bit that makes thrust mean thrust, where that is allowed.
/// Thread-safe: no.   Real-time safe: yes.
class Parameters {
 public:
  static constexpr Stamp kAnswer{std::chrono::milliseconds(500)};
  static constexpr int kTries = 6;
  static constexpr std::size_t kMost = 3;

  /// @param may_set  the thrust bit may be written when it is missing
  Parameters(Dialect dialect, bool may_set) noexcept;

  /// What to send now, if anything: exactly one of the two is set then.
  struct Request {
    std::optional<mavlink::ParamRequestRead> read;
    std::optional<mavlink::ParamSet> set;
  };
  Request tick(Stamp now) noexcept;
  void on_value(const mavlink::ParamValue& parameter) noexcept;

  /// Every one is there or given up.
  bool done() const noexcept { return current_ == rules(dialect_).parameters.size(); }
  /// NaN: not there, or not of this dialect.
  double value(ParameterRule::Use use) const noexcept;
  /// Thrust means thrust: by the bit, or because the dialect has no other meaning.
  bool thrust_is_thrust() const noexcept;

 private:
  Dialect dialect_;
  bool may_set_;
  std::array<double, kMost> values_;
  std::size_t current_ = 0;
  bool setting_ = false;
  double wanted_ = 0.0;
  std::uint8_t type_ = 0;
  Stamp next_{0};
  int tries_ = 0;
};

}  // namespace gatefield::bridge
