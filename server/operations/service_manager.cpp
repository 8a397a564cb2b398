#include "server/operations/service_manager.h"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <cstdint>

namespace gatefield::operations {
namespace {

constexpr int kKeepEnvironment = 0;

void notify(const std::string& what, const std::string& status) {
  std::string line = status;
  std::replace(line.begin(), line.end(), '\n', ' ');
  (void)sd_notify(kKeepEnvironment, (what + "\nSTATUS=" + line).c_str());
}

}  // namespace

ServiceManager::ServiceManager() {
  std::uint64_t microseconds = 0;
  if (sd_watchdog_enabled(kKeepEnvironment, &microseconds) > 0) watchdog_ = std::chrono::microseconds(microseconds);
}

void ServiceManager::ready(const std::string& status) { notify("READY=1", status); }
void ServiceManager::alive(const std::string& status) { notify("WATCHDOG=1", status); }
void ServiceManager::reloading() { (void)sd_notify(kKeepEnvironment, "RELOADING=1"); }
void ServiceManager::stopping(const std::string& status) { notify("STOPPING=1", status); }

}  // namespace gatefield::operations
