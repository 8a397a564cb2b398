#include "client/firmware/px4_hil/hil_link.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "client/firmware/mavlink/constants.h"
#include "common/base/text.h"

namespace gatefield::firmware {
namespace {

using namespace std::chrono_literals;

constexpr mavlink::Address kSimulator{1, 51};  // a system and component that no autopilot has
constexpr Stamp kLook = 20ms;                  // how often a waiting listener looks up

/// Outputs of 1 and a rounding more are 1.
constexpr double kFullOutput = 1.001;

std::string in_seconds(Stamp span) { return text(seconds(span)) + " s"; }

bool is_datagram(Address::Kind kind) noexcept {
  return kind == Address::Kind::kUdp || kind == Address::Kind::kUdpListen;
}

}  // namespace

Status validate(const HilOptions& options) {
  const auto address = parse_address(options.address);
  if (!address) return address.failure().within("address: ", "address.");
  if (is_datagram(address->kind))
    return Error::invalid("address", options.address, "a tcp-listen: or serial: address, which loses nothing");
  if (options.connect_timeout < 100ms || options.connect_timeout > 10min)
    return Error::invalid("connect_timeout", in_seconds(options.connect_timeout), "0.1 to 600 s");
  if (options.boot_timeout < 1s || options.boot_timeout > 10min)
    return Error::invalid("boot_timeout", in_seconds(options.boot_timeout), "1 to 600 s");
  if (options.answer_timeout < 10ms || options.answer_timeout > 60s)
    return Error::invalid("answer_timeout", in_seconds(options.answer_timeout), "0.01 to 60 s");
  return {};
}

Result<std::unique_ptr<HilLink>> HilLink::open(const HilOptions& options) {
  if (Status status = validate(options); !status) return status.failure();
  const auto address = parse_address(options.address).value();
  auto link = firmware::open(address, options.connect_timeout);
  if (!link) return link.failure();
  auto hil = std::make_unique<HilLink>(options, std::move(link).value(), std::make_unique<MonotonicClock>());
  if (address.kind == Address::Kind::kSerial) return hil;
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
  const auto packet = mavlink::pack(message, kSimulator, sequence_++);
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
      if (message && status.ok()) status = take(*message);
    });
    if (!status) return status;
  }
}

Status HilLink::take(const mavlink::Message& message) {
  const auto* const controls = std::get_if<mavlink::HilActuatorControls>(&message);
  if (controls == nullptr) return {};
  motors_.armed = (controls->mode & mavlink::kModeArmed) != 0;
  for (std::size_t i = 0; i < HilMotors::kMotors; ++i) {
    const auto output = static_cast<double>(controls->controls[i]);
    const bool off = std::isnan(output) || !motors_.armed;
    if (!off && !(output >= 0.0 && output <= kFullOutput))
      return Error::invalid("HIL_ACTUATOR_CONTROLS.controls[" + text(i) + "]", text(output),
                            "0 to 1, as motors that turn one way have it");
    motors_.outputs[i] = off ? 0.0 : std::min(output, 1.0);
  }
  ++motors_.answers;
  answered_at_ = clock_->now();
  return {};
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
    const Stamp silent = options_.lockstep ? waited : clock_->now() - answered_at_;
    if (silent >= options_.answer_timeout) return hung(silent);
    if (!options_.lockstep) return motors_;
    link_->wait(std::min<Stamp>(options_.answer_timeout - waited, kLook));
  }
}

}  // namespace gatefield::firmware
