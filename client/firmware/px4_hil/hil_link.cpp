#include "client/firmware/px4_hil/hil_link.h"

#include <algorithm>
#include <string>
#include <utility>

#include "client/firmware/px4_hil/simulator_address.h"
#include "common/base/text.h"

namespace gatefield::firmware {
namespace {

using namespace std::chrono_literals;

constexpr Stamp kLook = 20ms;  // how often a waiting listener looks up

std::string in_seconds(Stamp span) { return text(seconds(span)) + " s"; }

}  // namespace

Result<std::unique_ptr<HilLink>> HilLink::open(const HilOptions& options) {
  if (Status status = validate(options); !status) return status.failure();
  const auto address = parse_address(options.address).value();
  auto link = firmware::open(address, options.connect_timeout);
  if (!link) return link.failure();
  auto hil = std::make_unique<HilLink>(options, std::move(link).value(), std::make_unique<MonotonicClock>());
  // PX4 speaks first, as soon as it has connected.
  for (const Stamp end = hil->clock_->now() + options.connect_timeout;
       hil->counts().frames + hil->counts().unknown == 0;) {
    if (hil->clock_->now() >= end)
      return Error("no firmware connected to " + options.address + " within " + in_seconds(options.connect_timeout) +
                       "; start it with its simulator's address set to this one",
                   ErrorCode::kNoAnswer, "address");
    hil->link_->wait(kLook);
    if (Status status = hil->receive(); !status) return status.failure();
  }
  return hil;
}

HilLink::HilLink(const HilOptions& options, std::unique_ptr<Link> link, std::unique_ptr<Clock> clock)
    : options_(options), link_(std::move(link)), clock_(std::move(clock)), begin_(clock_->now()) {}

Error HilLink::hung(Stamp waited) const {
  return Error(
      "the firmware on " + link_->name() + " sent no motor outputs for " + fixed(seconds(waited), 1) + " s" +
          (answered() ? "; it hangs, or waits for something else"
                      : "; it has not booted, or runs no simulated motors (its airframe has to be one for HIL)"),
      ErrorCode::kNotAnswering, "address");
}

Status HilLink::send(const mavlink::Message& message) {
  const auto packet = mavlink::pack(message, kSimulatorAddress, sequence_++);
  const Stamp begin = clock_->now();
  for (;;) {
    const Transfer transfer = link_->send(packet.bytes());
    if (transfer.broken != 0) {
      Error error = broken(*link_, transfer);
      error.code = ErrorCode::kNotAnswering;
      return error;
    }
    if (transfer.bytes > 0) return {};
    if (clock_->now() - begin >= options_.answer_timeout) return hung(clock_->now() - begin);
    link_->wait(1ms);  // it does not read: there is no room
    if (Status status = receive(); !status) return status;
  }
}

Status HilLink::receive() {
  for (;;) {
    const Transfer transfer = link_->receive(buffer_);
    if (transfer.broken != 0) {
      Error error = broken(*link_, transfer);
      error.code = ErrorCode::kNotAnswering;
      return error;
    }
    if (transfer.bytes == 0) return {};
    Status status;
    reader_.read({buffer_.data(), transfer.bytes}, false, [&](const mavlink::Frame& frame) {
      const auto message = mavlink::unpack(frame);
      const auto* const controls = message ? std::get_if<mavlink::HilActuatorControls>(&*message) : nullptr;
      if (controls != nullptr && status.ok()) status = motors_.take(*controls);
    });
    if (!status) return status;
  }
}

Result<HilMotors> HilLink::exchange(const mavlink::HilSensor& sensor, const std::optional<mavlink::HilGps>& gps,
                                    const std::optional<mavlink::HilStateQuaternion>& truth) {
  if (Status status = receive(); !status) return status.failure();
  const std::uint64_t before = motors_.answers;
  if (gps)
    if (Status status = send(*gps); !status) return status.failure();
  if (truth)
    if (Status status = send(*truth); !status) return status.failure();
  if (Status status = send(sensor); !status) return status.failure();
  const Stamp begin = clock_->now();
  for (;;) {
    if (Status status = receive(); !status) return status.failure();
    const Stamp waited = clock_->now() - begin;
    if (!answered()) {
      if (clock_->now() - begin_ > options_.boot_timeout) return hung(clock_->now() - begin_);
      return motors_;
    }
    if (motors_.answers > before) return motors_;
    if (waited >= options_.answer_timeout) return hung(waited);
    link_->wait(std::min<Stamp>(options_.answer_timeout - waited, kLook));
  }
}

}  // namespace gatefield::firmware
