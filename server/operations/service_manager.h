#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace gatefield::operations {

/// What systemd is told of a service of Type=notify (man 3 sd_notify); without systemd nothing happens.
/// Thread-safe: no.   Real-time safe: no.
class ServiceManager {
 public:
  ServiceManager();

  /// Clients may come.
  void ready(const std::string& status);
  /// The watchdog's sign of life, and a line for `systemctl status`.
  void alive(const std::string& status);
  /// Configuration is read again; ready() ends it.
  void reloading();
  void stopping(const std::string& status);
  /// Within which time alive() has to come again (WatchdogSec=); empty: nobody watches.
  const std::optional<std::chrono::microseconds>& watchdog() const noexcept { return watchdog_; }

 private:
  std::optional<std::chrono::microseconds> watchdog_;
};

}  // namespace gatefield::operations
