#pragma once

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/firmware/link/file_descriptor.h"
#include "client/firmware/link/link.h"
#include "common/base/random.h"

namespace gatefield::test {

using LineNoise = std::function<void(std::vector<std::uint8_t>*)>;

/// Spoils each byte with this probability: a bit turned, the byte lost, or one that nobody sent before it.
inline LineNoise line_noise(double probability, std::uint64_t seed) {
  return [probability, random = std::make_shared<Random>(seed, Stream("gatefield.test.line_noise"))](
             std::vector<std::uint8_t>* bytes) {
    std::vector<std::uint8_t> spoiled;
    for (const std::uint8_t byte : *bytes) {
      if (random->uniform() >= probability) {
        spoiled.push_back(byte);
        continue;
      }
      const auto how = random->bits();
      if (how % 3 == 0) continue;
      if (how % 3 == 1) spoiled.push_back(static_cast<std::uint8_t>(how >> 8));
      spoiled.push_back(how % 3 == 1 ? byte : static_cast<std::uint8_t>(byte ^ 1u << (how >> 8) % 8));
    }
    *bytes = std::move(spoiled);
  };
}

/// A board's end of a pseudo terminal, which looks like a serial port at the other one (name()). When it goes out of
/// scope, the board has been unplugged.
/// Thread-safe: no.
class Terminal final : public firmware::Link {
 public:
  Terminal() : end_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    std::array<char, 64> name{};
    if (grantpt(end_.get()) == 0 && unlockpt(end_.get()) == 0 && ptsname_r(end_.get(), name.data(), name.size()) == 0)
      name_ = name.data();
  }

  LineNoise noise;  ///< done to what the board sends

  firmware::Transfer send(std::span<const std::uint8_t> message) noexcept override {
    std::vector<std::uint8_t> bytes(message.begin(), message.end());
    if (noise) noise(&bytes);
    const ssize_t written = ::write(end_.get(), bytes.data(), bytes.size());
    return {written < 0 ? 0 : message.size(), 0};
  }
  firmware::Transfer receive(std::span<std::uint8_t> buffer) noexcept override {
    return {static_cast<std::size_t>(std::max<ssize_t>(::read(end_.get(), buffer.data(), buffer.size()), 0)), 0};
  }
  bool wait(std::chrono::nanoseconds) noexcept override { return false; }
  std::uint16_t local_port() const noexcept override { return 0; }
  const std::string& name() const noexcept override { return name_; }

 private:
  firmware::FileDescriptor end_;
  std::string name_;
};

}  // namespace gatefield::test
