#include "tests/integration/betaflight/real_firmware.h"

#include <sched.h>

#include <cstdio>
#include <cstdlib>
#include <thread>

#include "client/firmware/link/link.h"
#include "common/base/clock.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

std::string variable(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): one thread
  return value == nullptr ? "" : value;
}

template <typename T>
T expect(Result<T> result) {
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().c_str());
    std::abort();
  }
  return std::move(result).value();
}

/// Connects as soon as somebody listens there.
std::unique_ptr<firmware::Link> connect() {
  const auto address = expect(firmware::parse_address("tcp:127.0.0.1:5761"));
  const MonotonicClock clock;
  for (const Stamp end = clock.now() + 10s;;) {
    auto link = firmware::open(address, 1s);
    if (link || clock.now() > end) return expect(std::move(link));
    std::this_thread::sleep_for(50ms);
  }
}

/// Types a line and waits for the prompt.
void type(firmware::Link& link, const std::string& line) {
  (void)link.send(std::span(reinterpret_cast<const std::uint8_t*>(line.data()), line.size()));
  std::string said;
  while (said.find("# ") == std::string::npos && link.wait(10s)) {
    std::array<std::uint8_t, 1024> buffer{};
    const auto got = link.receive(buffer);
    if (got.broken != 0) return;
    said.append(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(got.bytes));
  }
}

}  // namespace

std::vector<std::string> bridge_settings(const std::string& type, int rc_rate, int super_rate, int expo) {
  std::vector<std::string> lines{"aux 0 0 0 1700 2100 0 0",
                                 "feature -RX_UDP",  // what 2026.6 comes with; others do not know it
                                 "feature RX_MSP", "set motor_pwm_protocol = PWM", "set small_angle = 180",
                                 "set runaway_takeoff_prevention = OFF", "set failsafe_delay = 10",
                                 "set rates_type = " + type,
                                 // its own yaw gains swing up a vehicle that turns by its rotors' drag alone
                                 "set p_yaw = 100", "set i_yaw = 30", "set iterm_relax = RPY"};
  for (const char* axis : {"roll", "pitch", "yaw"}) {
    const std::string name = axis;
    lines.push_back("set " + name + "_rc_rate = " + std::to_string(rc_rate));
    lines.push_back("set " + name + "_srate = " + std::to_string(super_rate));
    lines.push_back("set " + name + "_expo = " + std::to_string(expo));
  }
  return lines;
}

std::vector<std::string> racer_settings() {
  auto settings = bridge_settings("ACTUAL", 100, 100, 0);
  settings.insert(settings.end(), {"set yaw_motors_reversed = ON", "set throttle_boost = 0", "set thrust_linear = 0",
                                   "set rc_smoothing = OFF", "set f_roll = 0", "set f_pitch = 0", "set f_yaw = 0",
                                   "set serial_update_rate_hz = 1000"});
  if (RealFirmware::wire() == firmware::betaflight_sitl::Wire::kSince2026)
    settings.insert(settings.end(), {"feature -RX_MSP", "feature RX_UDP"});
  return settings;
}

std::string RealFirmware::program() { return variable("GATEFIELD_BETAFLIGHT_SITL"); }

firmware::betaflight_sitl::Wire RealFirmware::wire() {
  return variable("GATEFIELD_BETAFLIGHT_WIRE") == "since2026" ? firmware::betaflight_sitl::Wire::kSince2026
                                                              : firmware::betaflight_sitl::Wire::kUntil2025;
}

RealFirmware::RealFirmware(const std::filesystem::path& folder, const std::vector<std::string>& settings,
                           std::string clock)
    : folder_(folder), clock_(std::move(clock)) {
  std::filesystem::create_directories(folder_);
  std::filesystem::remove(folder_ / "eeprom.bin");
  start();
  {
    const auto link = connect();
    std::this_thread::sleep_for(500ms);
    type(*link, "#");
    for (const std::string& line : settings) type(*link, line + "\n");
    type(*link, "save\n");
  }
  if (!process_->wait(5s)) process_->stop(0ms);
  start();
  (void)connect();                  // it serves again
  std::this_thread::sleep_for(1s);  // 4.4 serves one at a time, and is slow to see that this one has gone
}

void RealFirmware::start() {
  ChildOptions options;
  options.arguments = {program()};
  options.folder = folder_;
  options.log = folder_ / "firmware.log";
  if (!clock_.empty()) options.environment = {{"LD_PRELOAD", clock_}};
  process_ = expect(ChildProcess::start(options));
  const sched_param priority{10};
  sched_setscheduler(process_->pid(), SCHED_FIFO, &priority);  // without it a busy machine starves its loop
}

}  // namespace gatefield::test
