#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "client/firmware/link/link.h"

/// Both ends of a link in memory: what goes into one comes out of the other. Whoever waits at one end lets the other
/// side work, so that a test needs no thread.
namespace gatefield::test {

/// A cable: two ends, and what may happen to them.
struct Cable {
  std::deque<std::uint8_t> to_board, to_us;
  bool cut = false;                                       ///< nothing goes through any more, without anybody being told
  int broken = 0;                                         ///< what our end says of itself
  bool full = false;                                      ///< our end takes nothing
  std::function<void(std::deque<std::uint8_t>*)> noise;   ///< done to what the board sends
  std::function<void(std::chrono::nanoseconds)> on_wait;  ///< what happens while we wait, at most so long
};

class CableEnd final : public firmware::Link {
 public:
  CableEnd(std::shared_ptr<Cable> cable, bool ours) : cable_(std::move(cable)), ours_(ours) {}

  firmware::Transfer send(std::span<const std::uint8_t> message) noexcept override {
    if (ours_ && cable_->broken != 0) return {0, cable_->broken};
    if (ours_ && cable_->full) return {};
    if (cable_->cut) return {message.size(), 0};
    std::deque<std::uint8_t> bytes(message.begin(), message.end());
    if (!ours_ && cable_->noise) cable_->noise(&bytes);
    auto& queue = ours_ ? cable_->to_board : cable_->to_us;
    queue.insert(queue.end(), bytes.begin(), bytes.end());
    return {message.size(), 0};
  }

  firmware::Transfer receive(std::span<std::uint8_t> buffer) noexcept override {
    if (ours_ && cable_->broken != 0) return {0, cable_->broken};
    auto& queue = ours_ ? cable_->to_us : cable_->to_board;
    const std::size_t count = std::min(buffer.size(), queue.size());
    std::copy_n(queue.begin(), count, buffer.begin());
    queue.erase(queue.begin(), queue.begin() + static_cast<std::ptrdiff_t>(count));
    return {count, 0};
  }

  bool wait(std::chrono::nanoseconds timeout) noexcept override {
    if (cable_->on_wait) cable_->on_wait(timeout);
    return !(ours_ ? cable_->to_us : cable_->to_board).empty();
  }
  std::uint16_t local_port() const noexcept override { return 0; }
  const std::string& name() const noexcept override { return name_; }

 private:
  const std::shared_ptr<Cable> cable_;
  const bool ours_;
  const std::string name_ = "cable";
};

}  // namespace gatefield::test
