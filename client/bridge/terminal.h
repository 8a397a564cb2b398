#pragma once

#include <atomic>
#include <optional>
#include <string>

#include "client/bridge/betaflight/ground_check.h"

namespace gatefield::bridge {

/// The person at the terminal that the program was started from: standard output and input.
/// Thread-safe: no.
class Terminal final : public betaflight::Person {
 public:
  /// @param stop  set: the person leaves, as when the input ends
  explicit Terminal(const std::atomic<bool>& stop) : stop_(stop) {}

  void tell(const std::string& sentence) override;
  std::optional<std::string> answer() override;
  bool leaves() override { return stop_ || over_; }

 private:
  const std::atomic<bool>& stop_;
  bool over_ = false;  // the input has ended
  std::string typed_;
};

}  // namespace gatefield::bridge
