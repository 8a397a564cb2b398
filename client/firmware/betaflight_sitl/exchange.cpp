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
  auto channels = opened("udp:" + options.host + ":" + std::to_string(options.channels_port));
  if (!channels) return channels.failure();
  return std::unique_ptr<Exchange>(new Exchange(std::move(states).value(), std::move(motors).value(),
                                                std::move(channels).value(), options.wire, clock));
}

Exchange::Exchange(std::unique_ptr<Link> state_link, std::unique_ptr<Link> motors_link,
                   std::unique_ptr<Link> channels_link, Wire wire, const Clock& clock)
    : state_link_(std::move(state_link)),
      motors_link_(std::move(motors_link)),
      channels_link_(std::move(channels_link)),
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

Exchange::~Exchange() {
  if (time_ > Stamp{0}) state_link_->send(encode(State(), wire_, stamp_s()));
}

void Exchange::begin_step(const State& state, std::chrono::nanoseconds span) noexcept {
  if (time_ == Stamp{0}) state_link_->send(encode(state, wire_, stamp_s()));  // what the next one is later than
  time_ += span;
  if (state_link_->send(encode(state, wire_, stamp_s())).bytes > 0) ++sent_;
}

std::optional<Motors> Exchange::end_step(std::chrono::nanoseconds limit) noexcept {
  if (time_ == Stamp{0}) return std::nullopt;
  const Stamp end = clock_.now() + limit;
  for (Stamp now = clock_.now(); now < end; now = clock_.now()) {
    if (const auto motors = hear_stamped()) return motors;
    motors_link_->wait(end - now);
  }
  return std::nullopt;
}

/// The motors that answer the newest state. Others, which came too late, are passed over.
std::optional<Motors> Exchange::hear_stamped() noexcept {
  std::array<std::uint8_t, 2 * kStateBytes> buffer{};
  while (const std::size_t size = motors_link_->receive(buffer).bytes) {
    const auto packet = std::span(buffer).first(size);
    if (const auto stamped = read_stamped_motors(packet, wire_)) {
      ++stamped_;
      if (stamped->stamp_s != stamp_s()) continue;
      heard_ = clock_.now();
      ++received_;
      return stamped->motors;
    }
    ++(read_motors(packet, wire_) ? plain_ : malformed_);
  }
  return std::nullopt;
}

bool Exchange::send(const Channels& channels) noexcept { return channels_link_->send(encode(channels)).bytes > 0; }

Error Exchange::silence() const {
  if (plain_ > 0 && stamped_ == 0)
    return Error(
        "the firmware at " + state_link_->name() +
            " runs by the machine's clock; for lockstep start it with LD_PRELOAD=libgatefield-betaflight-clock.so, "
            "or fly in real time (--realtime)",
        ErrorCode::kNotAnswering, "flight_controller");
  const std::string so_far =
      received_ == 0 ? "no motors came from the firmware for "
                     : "the firmware, which had sent " + text(received_) + " sets of motors, is silent for ";
  return Error(so_far + fixed(seconds(silent_for()), 1) + " s (states go to " + state_link_->name() +
                   ", motors are heard on port " + std::to_string(motors_link_->local_port()) +
                   "); look whether it still runs, and start it with real-time priority (chrt -f 10) on a busy machine",
               ErrorCode::kNotAnswering, "flight_controller");
}

}  // namespace gatefield::firmware::betaflight_sitl
