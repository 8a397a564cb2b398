#include "tests/support/sitl_board.h"

#include <cstdlib>

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
      motors_(opened("udp:127.0.0.1:" + std::to_string(motors_port))) {
  auto msp = opened("tcp-listen:127.0.0.1:0");
  msp_port_ = msp->local_port();
  board_ = std::make_unique<BetaflightController>(std::move(msp));
  thread_ = std::thread([this] { run(); });
}

SitlBoard::~SitlBoard() {
  stop_ = true;
  thread_.join();
}

void SitlBoard::run() {
  const MonotonicClock clock;
  Stamp last = clock.now();
  while (!stop_) {
    const bool came = states_->wait(1ms);
    if (hangs_) continue;
    const Stamp now = clock.now();
    board_->serve(now);
    armed_ = board_->loop().armed();
    if (!came) continue;
    std::array<std::uint8_t, 256> packet{};
    const std::size_t size = states_->receive(packet).bytes;
    const auto state = firmware::betaflight_sitl::read_state(std::span(packet).first(size), wire_);
    if (!state) continue;
    board_->gyro_rad_s = state->body_rates_rad_s;
    board_->acceleration_g = state->specific_force_m_s2 / 9.80665;
    const double dt_s = std::clamp(seconds(now - last), 1e-4, 0.02);
    last = now;
    const auto bytes = encode(board_->loop().step(now, state->body_rates_rad_s, dt_s), wire_);
    (void)motors_->send(bytes);
  }
}

}  // namespace gatefield::test
