#include "client/firmware/link/shared_link.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace gatefield::firmware {

class SharedLink::Core {
 public:
  explicit Core(std::unique_ptr<Link> link) : link_(std::move(link)) {}

  Link& link() noexcept { return *link_; }
  void add(Taker* taker) { takers_.push_back(taker); }
  void remove(const Taker* taker) noexcept { std::erase(takers_, taker); }
  /// Hands what came to all.
  void pump() noexcept;

 private:
  const std::unique_ptr<Link> link_;
  std::vector<Taker*> takers_;
  std::array<std::uint8_t, Link::kMaxMessage> buffer_{};
};

class SharedLink::Taker final : public Link {
 public:
  explicit Taker(std::shared_ptr<Core> core) : core_(std::move(core)) { core_->add(this); }
  ~Taker() override { core_->remove(this); }
  Taker(const Taker&) = delete;
  Taker& operator=(const Taker&) = delete;

  /// @pre bytes.size() <= kKept
  void take(std::span<const std::uint8_t> bytes) noexcept {
    const std::size_t lost = std::max(size_ + bytes.size(), kKept) - kKept;
    begin_ = (begin_ + lost) % kKept;
    size_ -= lost;
    for (const std::uint8_t byte : bytes) kept_[(begin_ + size_++) % kKept] = byte;
  }
  void take(int broken) noexcept { broken_ = broken; }

  Transfer send(std::span<const std::uint8_t> message) noexcept override { return core_->link().send(message); }

  Transfer receive(std::span<std::uint8_t> buffer) noexcept override {
    if (size_ == 0 && broken_ == 0) core_->pump();
    if (size_ == 0) return {0, std::exchange(broken_, 0)};
    const std::size_t count = std::min(buffer.size(), size_);
    for (std::size_t i = 0; i < count; ++i) buffer[i] = kept_[(begin_ + i) % kKept];
    begin_ = (begin_ + count) % kKept;
    size_ -= count;
    return {count, 0};
  }

  bool wait(std::chrono::nanoseconds timeout) noexcept override {
    return size_ > 0 || broken_ != 0 || core_->link().wait(timeout);
  }
  std::uint16_t local_port() const noexcept override { return core_->link().local_port(); }
  const std::string& name() const noexcept override { return core_->link().name(); }

 private:
  const std::shared_ptr<Core> core_;
  std::vector<std::uint8_t> kept_ = std::vector<std::uint8_t>(kKept);  // a ring
  std::size_t begin_ = 0, size_ = 0;
  int broken_ = 0;
};

void SharedLink::Core::pump() noexcept {
  const Transfer transfer = link_->receive(buffer_);
  for (Taker* const taker : takers_) {
    if (transfer.bytes > 0) taker->take(std::span(buffer_).first(transfer.bytes));
    if (transfer.broken != 0) taker->take(transfer.broken);
  }
}

SharedLink::SharedLink(std::unique_ptr<Link> link) : core_(std::make_shared<Core>(std::move(link))) {}
SharedLink::~SharedLink() = default;
SharedLink::SharedLink(SharedLink&&) noexcept = default;
SharedLink& SharedLink::operator=(SharedLink&&) noexcept = default;

std::unique_ptr<Link> SharedLink::taker() { return std::make_unique<Taker>(core_); }

}  // namespace gatefield::firmware
