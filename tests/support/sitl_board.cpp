#include "tests/support/sitl_board.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "common/base/clock.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

std::unique_ptr<firmware::Link> opened(const std::string& written) {
  auto link = firmware::open(*firmware::parse_address(written), 1s);
  if (!link) std::abort();
  return std::move(link).value();
}

}  // namespace

SitlBoard::SitlBoard(std::uint16_t motors_port, firmware::betaflight_sitl::Wire wire)
    : wire_(wire),
      states_(opened("udp-listen:127.0.0.1:0")),
      motors_(opened("udp:127.0.0.1:" + std::to_string(motors_port))),
      channels_(opened("udp-listen:127.0.0.1:0")) {
  auto msp = opened("tcp-listen:127.0.0.1:0");
  msp_port_ = msp->local_port();
  board_ = std::make_unique<BetaflightController>(std::move(msp));
  thread_ = std::thread([this] { run(); });
}

SitlBoard::~SitlBoard() {
  stop_ = true;
  thread_.join();
}

void SitlBoard::take_channels() {
  std::array<std::uint8_t, 256> packet{};
  while (const std::size_t size = channels_->receive(packet).bytes) {
    const auto channels = firmware::betaflight_sitl::read_channels(std::span(packet).first(size));
    if (channels) board_->take_channels(time_, *channels);
  }
}

void SitlBoard::run() {
  constexpr double kMaxStep_s = 0.1;
  const MonotonicClock clock;
  Stamp last = clock.now();
  time_ = last;
  double last_stamp_s = 0.0;
  while (!stop_) {
    const bool came = states_->wait(1ms);
    if (hangs_) continue;
    const Stamp now = clock.now();
    take_channels();
    board_->serve(time_);
    armed_ = board_->loop().armed();
    if (!came) continue;
    std::array<std::uint8_t, 256> packet{};
    const auto bytes = std::span(packet).first(states_->receive(packet).bytes);
    const auto state = firmware::betaflight_sitl::read_state(bytes, wire_);
    if (!state) continue;
    const double stamp_s = firmware::betaflight_sitl::read_stamp_s(bytes);
    const double step_s = stamp_s - std::exchange(last_stamp_s, stamp_s);
    const bool lockstep = !own_clock_ && step_s > 0 && step_s <= kMaxStep_s;
    board_->gyro_rad_s = state->body_rates_rad_s;
    board_->acceleration_g = state->specific_force_m_s2 / 9.80665;
    const double dt_s = lockstep ? step_s : std::clamp(seconds(now - last), 1e-4, 0.02);
    last = now;
    time_ += from_seconds(dt_s);
    const auto motors = board_->loop().step(time_, state->body_rates_rad_s, dt_s);
    if (lockstep) {
      (void)motors_->send(encode(firmware::betaflight_sitl::StampedMotors{motors, stamp_s}, wire_));
    } else {
      (void)motors_->send(encode(motors, wire_));
    }
  }
}

}  // namespace gatefield::test
