#include "common/base/progress_line.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "common/base/text.h"

namespace gatefield {

ProgressLine::ProgressLine(std::string title) : title_(std::move(title)), terminal_(isatty(STDOUT_FILENO) == 1) {}

ProgressLine::~ProgressLine() {
  if (open_) std::printf("\n");
  std::fflush(stdout);
}

void ProgressLine::show(double part, double time_left_s, const std::string& rest) {
  const auto now = std::chrono::steady_clock::now();
  const auto pause = terminal_ ? std::chrono::milliseconds(250) : std::chrono::milliseconds(30'000);
  if (part < 1.0 && last_.time_since_epoch().count() != 0 && now - last_ < pause) return;
  last_ = now;
  constexpr int kWidth = 24;
  const int filled = static_cast<int>(std::lround(std::clamp(part, 0.0, 1.0) * kWidth));
  const std::string bar =
      std::string(static_cast<std::size_t>(filled), '#') + std::string(static_cast<std::size_t>(kWidth - filled), '.');
  std::printf("%s%s [%s] %5.1f %%  %s left  %s%s", terminal_ ? "\r\033[K" : "", title_.c_str(), bar.c_str(),
              100.0 * part, clock_text(time_left_s).c_str(), rest.c_str(), terminal_ ? "" : "\n");
  std::fflush(stdout);
  open_ = terminal_;
}

void ProgressLine::say(const std::string& text) {
  std::printf("%s%s\n", open_ ? "\n" : "", text.c_str());
  std::fflush(stdout);
  open_ = false;
}

}  // namespace gatefield
