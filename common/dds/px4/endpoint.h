#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/dds/px4/layout.h"
#include "common/dds/px4/messages.h"

namespace gatefield::px4 {

/// What is heard of PX4. Every message was converted and validated before it gets here.
/// Calls come from threads of the middleware: store and return, never block, never call the endpoint from inside.
/// Calls for one kind of message never overlap; calls for different kinds may.
class Handler {
 public:
  virtual ~Handler() = default;
  virtual void on_message(const Message& message) = 0;
  /// A message was not taken: it is of another layout (kVersion), or a field is out of its range. Of no topic: packets
  /// that no DDS participant sends.
  virtual void on_rejected(std::string_view topic, const Error& why) = 0;
};

/// The companion computer's end of PX4's topics.
/// Thread-safe: yes.   Real-time safe: no (system calls); what was published once does not allocate here.
class Endpoint {
 public:
  /// Joins PX4's domain. Errors: those of validate(options), and what the middleware refuses.
  /// @param handler  must outlive the endpoint; may be called before create() returns
  static Result<std::unique_ptr<Endpoint>> create(const BusOptions& options, Handler* handler);
  virtual ~Endpoint() = default;

  virtual bool publish(const OffboardControlMode& message) noexcept = 0;
  virtual bool publish(const VehicleRatesSetpoint& message) noexcept = 0;
  virtual bool publish(const VehicleCommand& message) noexcept = 0;

  /// Topics of a PX4, whichever release and namespace, that somebody writes in the domain now.
  virtual std::vector<std::string> offered() const = 0;
};

}  // namespace gatefield::px4
