// What the clock library is loaded into in tests: threads, sockets and ports as a firmware on a computer has them.
// Motors say what it knows: the time since its start in units of 100 s, and the first channel in units of 2000.

#include <arpa/inet.h>
#include <sys/select.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <thread>

namespace {

constexpr std::uint16_t kStatePort = 9003, kChannelsPort = 9004, kMotorsPort = 9002;

sockaddr_in local(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

/// Takes packets of this port for ever.
template <typename Take>
void listen_at(std::uint16_t port, Take take) {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  const sockaddr_in address = local(port);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) std::_Exit(1);
  for (;;) {
    fd_set readable;
    FD_ZERO(&readable);
    FD_SET(fd, &readable);
    timeval timeout{0, 100000};
    if (select(fd + 1, &readable, nullptr, nullptr, &timeout) != 1) continue;
    std::array<std::uint8_t, 256> packet{};
    if (recvfrom(fd, packet.data(), packet.size(), 0, nullptr, nullptr) > 0) take(packet.data());
  }
}

double now_s() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

int main() {
  std::atomic<int> channel{0};
  std::atomic<bool> answers{false};
  std::thread([&] { listen_at(kStatePort, [&](const std::uint8_t*) { answers = true; }); }).detach();
  std::thread([&] {
    listen_at(kChannelsPort, [&](const std::uint8_t* packet) {
      std::uint16_t first = 0;
      std::memcpy(&first, packet + sizeof(double), sizeof(first));
      channel = first;
    });
  }).detach();

  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  const sockaddr_in simulator = local(kMotorsPort);
  const double begin_s = now_s();
  for (;;) {
    if (answers.exchange(false)) {
      const std::array<float, 4> motors{static_cast<float>((now_s() - begin_s) / 100),
                                        static_cast<float>(channel) / 2000.0f};
      sendto(fd, motors.data(), sizeof(motors), 0, reinterpret_cast<const sockaddr*>(&simulator), sizeof(simulator));
    }
    const timespec loop{0, 50000};
    nanosleep(&loop, nullptr);
  }
}
