#include "client/bridge/terminal.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cstdio>

namespace gatefield::bridge {

void Terminal::tell(const std::string& sentence) {
  std::printf("%s\n", sentence.c_str());
  std::fflush(stdout);
}

std::optional<std::string> Terminal::answer() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (!over_ && poll(&input, 1, 0) > 0) {
    std::array<char, 256> buffer{};
    const ssize_t got = read(STDIN_FILENO, buffer.data(), buffer.size());
    if (got <= 0)
      over_ = true;
    else
      typed_.append(buffer.data(), static_cast<std::size_t>(got));
  }
  const std::size_t end = typed_.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string line = typed_.substr(0, end);
  typed_.erase(0, end + 1);
  return line;
}

}  // namespace gatefield::bridge
