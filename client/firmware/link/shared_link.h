#pragma once

#include <memory>

#include "client/firmware/link/link.h"

namespace gatefield::firmware {

/// One connection for several takers, each with a link of his own: all hear every byte that comes, and what one sends
/// goes out whole, as Link::send() has it, so messages of two are never mixed.
///
/// Who does not read loses the oldest of what came, beyond kKept bytes. A connection that breaks is told to each once
/// he has read what came before.
/// Thread-safe: no; all takers on one thread.   Real-time safe: as the link itself.
class SharedLink {
 public:
  static constexpr std::size_t kKept = 1 << 16;

  explicit SharedLink(std::unique_ptr<Link> link);
  ~SharedLink();
  SharedLink(SharedLink&&) noexcept;
  SharedLink& operator=(SharedLink&&) noexcept;

  /// Another taker. It hears what comes from now on, and keeps the connection for as long as it lives.
  std::unique_ptr<Link> taker();

 private:
  class Core;
  class Taker;
  std::shared_ptr<Core> core_;
};

}  // namespace gatefield::firmware
