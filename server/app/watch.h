#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "server/app/signals.h"
#include "server/operations/http_pages.h"
#include "server/operations/metrics.h"
#include "server/operations/service_manager.h"
#include "server/operations/spare_memory.h"
#include "server/service/service.h"

namespace gatefield::app {

/// What is offered to those who keep a server running, while it serves: pages over HTTP, signs of life for systemd, and
/// profiles that are read again when asked for. Their problems never end the server.
/// Thread-safe: no.
class Watch {
 public:
  struct Parts {
    const service::Service* service = nullptr;
    const Clock* clock = nullptr;  ///< the service's
    operations::ServerWords words;
    std::function<bool()> deaf;
    std::function<std::uint64_t()> packets_dropped;
    std::function<void()> reload;  ///< SIGHUP
    std::function<void()> drain;   ///< SIGUSR1
  };
  explicit Watch(Parts parts) : parts_(std::move(parts)) {}

  /// Pages /metrics and /healthz. @param address  as HttpPages::open(); empty: none
  Status offer(const std::string& address);
  /// Until SIGINT or SIGTERM, or `deaf`, or until the service is drained. @return which it was
  const char* run(const Signals& signals);

 private:
  operations::Health health() const;
  operations::HttpAnswer metrics_page() const;
  operations::HttpAnswer health_page() const;
  void look();

  const Parts parts_;
  operations::ServiceManager manager_;
  operations::SpareMemory memory_;
  std::unique_ptr<operations::HttpPages> pages_;
  bool was_well_ = true;
};

}  // namespace gatefield::app
