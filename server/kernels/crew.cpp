#include "server/kernels/crew.h"

#include <sched.h>

#include <algorithm>
#include <cassert>

namespace gatefield::kernels {
namespace {

/// Turns of a waiting loop, some tens of microseconds, after which the helper has surely been put aside.
constexpr int kPatience = 2000;

}  // namespace

Crew::Crew(int callers) : callers_(std::max(1, callers)), slots_(std::make_unique<Slot[]>(callers_)) {}

bool Crew::work(Slot* slot) noexcept {
  bool any = false;
  std::uint64_t tickets = slot->tickets.load(std::memory_order_acquire);
  for (;;) {
    const auto next = static_cast<int>(tickets & 0xffff), count = static_cast<int>(tickets >> 16 & 0xffff);
    if (next >= count) return any;
    if (!slot->tickets.compare_exchange_weak(tickets, tickets + 1, std::memory_order_acq_rel,
                                             std::memory_order_acquire))
      continue;
    slot->call(slot->body, next);
    slot->unfinished.fetch_sub(1, std::memory_order_release);
    any = true;
    tickets = slot->tickets.load(std::memory_order_acquire);
  }
}

bool Crew::help() noexcept {
  bool any = false;
  for (int i = 0; i < callers_; ++i) any = work(&slots_[static_cast<std::size_t>(i)]) || any;
  return any;
}

void Crew::share(int count, Call call, const void* body) noexcept {
  assert(count <= 0xffff);
  Slot* slot = nullptr;
  for (int i = 0; i < callers_ && slot == nullptr && count > 1; ++i) {
    Slot& candidate = slots_[static_cast<std::size_t>(i)];
    if (!candidate.taken.exchange(true, std::memory_order_acquire)) slot = &candidate;
  }
  if (slot == nullptr) {
    for (int i = 0; i < count; ++i) call(body, i);
    return;
  }
  slot->call = call;
  slot->body = body;
  slot->unfinished.store(count, std::memory_order_relaxed);
  const std::uint64_t number = (slot->tickets.load(std::memory_order_relaxed) >> 32) + 1;
  slot->tickets.store(number << 32 | static_cast<std::uint64_t>(count) << 16, std::memory_order_release);
  work(slot);
  for (int turn = 0; slot->unfinished.load(std::memory_order_acquire) > 0; ++turn) {
    if (turn < kPatience)
      relax();
    else
      sched_yield();
  }
  slot->taken.store(false, std::memory_order_release);
}

}  // namespace gatefield::kernels
