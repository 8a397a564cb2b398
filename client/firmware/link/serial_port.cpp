#include "client/firmware/link/serial_port.h"

#include <fcntl.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace gatefield::firmware {
namespace {

struct BaudRate {
  int baud;
  speed_t constant;
};
constexpr std::array kBaudRates{BaudRate{9600, B9600},       BaudRate{19200, B19200},     BaudRate{38400, B38400},
                                BaudRate{57600, B57600},     BaudRate{115200, B115200},   BaudRate{230400, B230400},
                                BaudRate{460800, B460800},   BaudRate{500000, B500000},   BaudRate{576000, B576000},
                                BaudRate{921600, B921600},   BaudRate{1000000, B1000000}, BaudRate{1152000, B1152000},
                                BaudRate{1500000, B1500000}, BaudRate{2000000, B2000000}, BaudRate{2500000, B2500000},
                                BaudRate{3000000, B3000000}, BaudRate{3500000, B3500000}, BaudRate{4000000, B4000000}};

constexpr auto kBauds = [] {
  std::array<int, kBaudRates.size()> bauds{};
  for (std::size_t i = 0; i < bauds.size(); ++i) bauds[i] = kBaudRates[i].baud;
  return bauds;
}();

Error of_device(const Address& address, const std::string& what, const std::string& next_step) {
  Error error(to_text(address) + ": the device " + what + ", expected a serial port; " + next_step,
              ErrorCode::kUnreadable, "device");
  error.value = address.place;
  error.expected = "a serial port";
  return error;
}

Error not_opened(const Address& address, int reason) {
  switch (reason) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return of_device(address, "is not there",
                       "plug the board in, and look under /dev/serial/by-id for the name it has now");
    case EACCES:
    case EPERM:
      return of_device(address, "may not be opened by this user",
                       "add the user to the group that owns it (sudo usermod -aG dialout $USER) and log in again");
    case EBUSY:
      return of_device(address, "is in use by another program", "close that program (a configurator, a modem manager)");
    default:
      return of_device(address, std::string("can't be opened (") + std::strerror(reason) + ")", "try another device");
  }
}

/// Not every driver has it, and without it the port works as well.
void ask_for_low_latency(int port) noexcept {
  serial_struct settings{};
  if (ioctl(port, TIOCGSERIAL, &settings) != 0) return;
  settings.flags |= ASYNC_LOW_LATENCY;
  ioctl(port, TIOCSSERIAL, &settings);
}

}  // namespace

std::span<const int> baud_rates() noexcept { return kBauds; }

Result<FileDescriptor> open_serial_port(const Address& address) {
  FileDescriptor port(::open(address.place.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!port) return not_opened(address, errno);
  termios settings{};
  if (tcgetattr(port.get(), &settings) != 0) return of_device(address, "is none", "name the board's own device");
  if (ioctl(port.get(), TIOCEXCL) != 0) return not_opened(address, errno);

  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  settings.c_cc[VMIN] = 1;  // with O_NONBLOCK: an empty read is EAGAIN, and 0 bytes mean that the device has gone
  settings.c_cc[VTIME] = 0;
  const auto* const rate = std::find_if(kBaudRates.begin(), kBaudRates.end(),
                                        [&](const BaudRate& known) { return known.baud == address.baud; });
  if (rate == kBaudRates.end() || cfsetspeed(&settings, rate->constant) != 0 ||
      tcsetattr(port.get(), TCSANOW, &settings) != 0)
    return Error::invalid("baud", std::to_string(address.baud),
                          "a rate that " + address.place + " offers; 115200 works with every board");
  ask_for_low_latency(port.get());
  tcflush(port.get(), TCIOFLUSH);
  return port;
}

}  // namespace gatefield::firmware
