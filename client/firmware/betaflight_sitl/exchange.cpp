#include "client/firmware/betaflight_sitl/exchange.h"

#include "common/base/text.h"

namespace gatefield::firmware::betaflight_sitl {

Result<std::unique_ptr<Exchange>> Exchange::open(const ExchangeOptions& options, const Clock& clock) {
  const auto opened = [](const std::string& written) -> Result<std::unique_ptr<Link>> {
    const auto address = parse_address(written);
    if (!address) return address.failure();
    return firmware::open(*address, {});
  };
  auto states = opened("udp:" + options.host + ":" + std::to_string(options.state_port));
  if (!states) return states.failure();
  auto motors = opened("udp-listen:0.0.0.0:" + std::to_string(options.motors_port));
  if (!motors) return motors.failure();
  return std::unique_ptr<Exchange>(
      new Exchange(std::move(states).value(), std::move(motors).value(), options.wire, clock));
}

Exchange::Exchange(std::unique_ptr<Link> state_link, std::unique_ptr<Link> motors_link, Wire wire, const Clock& clock)
    : state_link_(std::move(state_link)),
      motors_link_(std::move(motors_link)),
      wire_(wire),
      clock_(clock),
      heard_(clock.now()) {}

std::optional<Motors> Exchange::exchange(const State& state) noexcept {
  if (state_link_->send(encode(state, wire_)).bytes > 0) ++sent_;
  std::array<std::uint8_t, 2 * kStateBytes> packet{};
  while (const std::size_t size = motors_link_->receive(packet).bytes) {
    const auto motors = read_motors(std::span(packet).first(size), wire_);
    if (!motors) {
      ++malformed_;
      continue;
    }
    motors_ = motors;
    heard_ = clock_.now();
    ++received_;
  }
  return motors_;
}

Error Exchange::silence() const {
  const std::string so_far =
      received_ == 0 ? "no motors came from the firmware for "
                     : "the firmware, which had sent " + text(received_) + " sets of motors, is silent for ";
  return Error(so_far + fixed(seconds(silent_for()), 1) + " s (states go to " + state_link_->name() +
                   ", motors are heard on port " + std::to_string(motors_link_->local_port()) +
                   "); look whether it still runs, and start it with real-time priority (chrt -f 10) on a busy machine",
               ErrorCode::kNotAnswering, "flight_controller");
}

}  // namespace gatefield::firmware::betaflight_sitl
