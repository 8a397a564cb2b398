#include "tests/support/serial_board.h"

#include <utility>

#include "client/firmware/link/shared_link.h"
#include "tests/support/hil_firmware.h"
#include "tests/support/mavlink_controller.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kOutputsAreMotors = 0xF;

}  // namespace

SerialBoard::SerialBoard(Options options) : options_(std::move(options)) {
  auto terminal = std::make_unique<Terminal>();
  terminal->noise = options_.noise;
  address_ = "serial:" + terminal->name() + ":921600";
  thread_ = std::thread([this, port = std::move(terminal)]() mutable { run(std::move(port)); });
}

SerialBoard::~SerialBoard() {
  stop_ = true;
  thread_.join();
}

void SerialBoard::run(std::unique_ptr<Terminal> terminal) {
  const MonotonicClock clock;
  const Stamp begin = clock.now();
  firmware::SharedLink port(std::move(terminal));
  MavlinkController controller(port.taker(), bridge::Dialect::kPx4, options_.loop);
  controller.sends_odometry = false;
  controller.hil = options_.hil;
  HilFirmware firmware(port.taker(), &controller, HilFirmware::Clock::kOwn);
  firmware.thrust_linear = options_.thrust_linear;
  firmware.flags = kOutputsAreMotors;
  for (; !stop_; std::this_thread::sleep_for(1ms)) {
    const Stamp now = clock.now() - begin;
    switch (does_.exchange(Does::kFly)) {
      case Does::kFly:
        break;
      case Does::kHang:
        while (!stop_) std::this_thread::sleep_for(1ms);
        return;
      case Does::kComeOff:
        return;
      case Does::kDisarm:
        controller.loop().arm_switch(now, false);
        break;
    }
    firmware.serve(now);
    controller.serve(now);
    armed_ = controller.armed();
    samples_ = firmware.samples();
    truths_ = firmware.truths();
  }
}

}  // namespace gatefield::test
