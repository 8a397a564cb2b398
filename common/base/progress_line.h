#pragma once

#include <chrono>
#include <string>

namespace gatefield {

/// One line that is rewritten in place on a terminal, and printed every half minute elsewhere. Thread-safe: no.
class ProgressLine {
 public:
  explicit ProgressLine(std::string title);
  ~ProgressLine();
  /// @param part  what is done, 0 to 1
  /// @param rest  what else to say
  void show(double part, double time_left_s, const std::string& rest);
  /// A full line of its own between the progress.
  void say(const std::string& text);

 private:
  std::string title_;
  bool terminal_;
  bool open_ = false;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace gatefield
