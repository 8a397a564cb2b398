#pragma once

#include <memory>
#include <variant>
#include <vector>

#include "common/dds/px4/layout.h"
#include "common/dds/px4/messages.h"

namespace gatefield::test {

/// PX4's own end of its topics, as its agent has them on the bus: writes what is heard of PX4, in the release's layouts
/// (BEST_EFFORT, TRANSIENT_LOCAL), and reads what is said to it (BEST_EFFORT, VOLATILE).
class Px4Bus {
 public:
  using Heard = std::variant<px4::OffboardControlMode, px4::VehicleRatesSetpoint, px4::VehicleCommand>;

  /// Fails the test when the middleware refuses.
  static std::unique_ptr<Px4Bus> open(const px4::BusOptions& options);
  virtual ~Px4Bus() = default;

  virtual void write(const px4::Message& message) = 0;
  /// What came since the last call, in the order in which it came. Thread-safe.
  virtual std::vector<Heard> heard() = 0;
};

}  // namespace gatefield::test
