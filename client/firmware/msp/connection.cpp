#include "client/firmware/msp/connection.h"

#include <algorithm>

#include "common/base/text.h"

namespace gatefield::firmware::msp {

Connection::Connection(std::unique_ptr<Link> link, const Clock& clock) : link_(std::move(link)), clock_(clock) {}

Result<std::vector<std::uint8_t>> Connection::ask(std::uint16_t command, std::span<const std::uint8_t> payload,
                                                  std::chrono::nanoseconds timeout) {
  constexpr std::chrono::milliseconds kAgain{200};
  const Stamp end = clock_.now() + timeout;
  while (clock_.now() < end) {
    forget_first(waiting_);  // whatever was asked before is nobody's question any more
    send(command, payload);
    const Stamp again = std::min(end, clock_.now() + kAgain);
    for (Stamp now = clock_.now(); now < again; now = clock_.now()) {
      link_->wait(again - now);
      while (const auto frame = next()) {
        if (frame->command != command) continue;
        if (frame->way == Way::kAnswer) return std::vector<std::uint8_t>(frame->payload.begin(), frame->payload.end());
        return Error(name() + ": the flight controller refuses MSP command " + text(command) +
                         "; look whether its firmware is Betaflight 4.4 or later",
                     ErrorCode::kUnsupported, "link");
      }
      if (broken_.broken != 0) return *failure();
    }
  }
  return Error(name() + ": no answer to MSP command " + text(command) + " within " + text(seconds(timeout)) +
                   " s; look whether MSP is on for this port (Ports tab), at this baud rate, and whether RX and TX are "
                   "crossed",
               ErrorCode::kNoAnswer, "link");
}

bool Connection::send(std::uint16_t command, std::span<const std::uint8_t> payload) noexcept {
  const Stamp now = clock_.now();
  forget_lost(now);
  if (waiting_ == kMaxWaiting || broken_.broken != 0) return false;
  std::array<std::uint8_t, kMaxFrame> buffer{};
  const auto bytes = encode({Way::kQuestion, Version::k2, command, payload}, buffer);
  const Transfer transfer = link_->send(bytes);
  put_out(transfer);
  if (transfer.bytes == 0) return false;
  sent_[waiting_++] = {command, now};
  return true;
}

std::optional<Frame> Connection::next() noexcept {
  for (bool fetched = false;; fetched = true) {
    while (const auto frame = reader_.next()) {
      if (frame->way == Way::kQuestion) continue;  // an echo of our own, on a line that is wired in a circle
      answered(*frame, clock_.now());
      return frame;
    }
    if (fetched) return std::nullopt;
    fetch();
  }
}

std::optional<Error> Connection::failure() const {
  if (broken_.broken == 0) return std::nullopt;
  Error error = broken(*link_, broken_);
  error.field = "link";
  return error;
}

void Connection::fetch() noexcept {
  const Transfer got = link_->receive(reader_.room());
  put_out(got);
  reader_.filled(got.bytes);
}

void Connection::put_out(Transfer transfer) noexcept {
  if (transfer.broken != 0) broken_ = transfer;
}

void Connection::forget_lost(Stamp now) noexcept {
  std::size_t old = 0;
  while (old < waiting_ && now - sent_[old].when > patience_) ++old;
  lost_ += old;
  forget_first(old);
  if (old > 0) reader_.give_up();
}

void Connection::forget_first(std::size_t count) noexcept {
  std::copy(sent_.begin() + static_cast<std::ptrdiff_t>(count), sent_.begin() + static_cast<std::ptrdiff_t>(waiting_),
            sent_.begin());
  waiting_ -= count;
}

/// Answers come in the order of the commands: what was asked before this one was lost.
void Connection::answered(const Frame& frame, Stamp now) noexcept {
  ++(frame.way == Way::kAnswer ? answers_ : refusals_);
  for (std::size_t i = 0; i < waiting_; ++i) {
    if (sent_[i].command != frame.command) continue;
    note(now - sent_[i].when);
    lost_ += i;
    forget_first(i + 1);
    return;
  }
  ++lost_;
}

void Connection::note(std::chrono::nanoseconds round_trip) noexcept {
  constexpr int kTimes = 4;
  // The longest of late: it falls by a fiftieth with every answer.
  const auto longest = std::max(round_trip, patience_ / kTimes * 49 / 50);
  patience_ = std::clamp<std::chrono::nanoseconds>(kTimes * longest, kShortest, kLongest);
  round_trip_ = round_trip;
}

}  // namespace gatefield::firmware::msp
