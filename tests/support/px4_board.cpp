#include "tests/support/px4_board.h"

#include <cstdlib>
#include <memory>

#include "client/firmware/link/link.h"
#include "client/firmware/mavlink/constants.h"
#include "tests/support/hil_firmware.h"
#include "tests/support/mavlink_controller.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

std::unique_ptr<firmware::Link> opened(const std::string& written) {
  auto link = firmware::open(*firmware::parse_address(written), 1s);
  return link ? std::move(link).value() : nullptr;
}

/// Lets somebody else look at what a link brings.
class Lent final : public firmware::Link {
 public:
  explicit Lent(firmware::Link* link) : link_(*link) {}
  firmware::Transfer send(std::span<const std::uint8_t> message) noexcept override { return link_.send(message); }
  firmware::Transfer receive(std::span<std::uint8_t> buffer) noexcept override { return link_.receive(buffer); }
  bool wait(std::chrono::nanoseconds timeout) noexcept override { return link_.wait(timeout); }
  std::uint16_t local_port() const noexcept override { return link_.local_port(); }
  const std::string& name() const noexcept override { return link_.name(); }

 private:
  firmware::Link& link_;
};

}  // namespace

Px4Board::Px4Board(std::uint16_t simulator, std::uint16_t bridge, const RateController::Options& loop)
    : thread_([this, simulator, bridge, loop] { run(simulator, bridge, loop); }) {}

Px4Board::~Px4Board() {
  stop_ = true;
  thread_.join();
}

void Px4Board::run(std::uint16_t simulator, std::uint16_t bridge, const RateController::Options& loop) {
  std::unique_ptr<firmware::Link> sensors;
  while (!stop_ && !(sensors = opened("tcp:127.0.0.1:" + std::to_string(simulator)))) std::this_thread::sleep_for(5ms);
  if (!sensors) return;
  MavlinkController controller(opened("udp:127.0.0.1:" + std::to_string(bridge)), bridge::Dialect::kPx4, loop);
  controller.sends_odometry = false;
  HilFirmware firmware(std::make_unique<Lent>(sensors.get()), &controller);
  while (!stop_) {
    sensors->wait(1ms);
    if (refuses_)
      controller.refuses[static_cast<std::uint16_t>(firmware::mavlink::Command::kArmDisarm)] =
          firmware::mavlink::CommandResult::kDenied;
    switch (does_) {
      case Does::kFly:
        break;
      case Does::kHang:
        continue;
      case Does::kDie:
        return;
      case Does::kDisarm:
        controller.loop().arm_switch(firmware.time(), false);
        break;
      case Does::kLeaveMode:
        controller.leave_mode();
        break;
      case Does::kSayNothing:
        controller.silent = true;
        break;
    }
    firmware.serve(firmware.time());
    controller.serve(firmware.time());
    armed_ = controller.armed();
  }
}

std::uint16_t free_port(const std::string& kind) { return opened(kind + ":127.0.0.1:0")->local_port(); }

}  // namespace gatefield::test
