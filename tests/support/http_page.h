#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <string>

#include "client/firmware/link/link.h"

namespace gatefield::test {

/// What a server on this machine answers to GET, with its head; or why it does not.
inline std::string http_page(const std::string& port, const std::string& path) {
  using namespace std::chrono_literals;
  auto link = firmware::open(firmware::parse_address("tcp:127.0.0.1:" + port).value(), 5s);
  if (!link) return link.error();
  const std::string request = "GET " + path + " HTTP/1.0\r\n\r\n";
  (void)(*link)->send(std::span(reinterpret_cast<const std::uint8_t*>(request.data()), request.size()));
  std::string answer;
  while ((*link)->wait(5s)) {
    std::array<std::uint8_t, 4096> buffer{};
    const auto got = (*link)->receive(buffer);
    answer.append(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(got.bytes));
    if (got.broken != 0) break;
  }
  return answer;
}

}  // namespace gatefield::test
