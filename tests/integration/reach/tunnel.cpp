// One end of a VPN, without its cipher: what a tun device is given goes to the other end in UDP packets, and back.
//   tunnel --device vpn0 --port 51820 --to 10.81.2.2 --allowed 10.82.0.2
// Like WireGuard it carries what is for an address of the other end, and comes from there: no multicast. The device is
// there already, with its addresses. Says "up", and when it is told to end "carried 1234 packets, the largest of 1280
// bytes". Exit codes: 0, 1 when something of that can't be had.

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <string>

namespace {

volatile std::sig_atomic_t ends = 0;

int fail(const char* what) {
  std::perror(what);
  return 1;
}

/// Whether an IPv4 packet is of the other end.
/// @param address_at  12: of its source, 16: of its destination
bool is_of(const in_addr& other, const char* packet, ssize_t size, std::ptrdiff_t address_at) {
  constexpr ssize_t kHeader_bytes = 20;
  return size >= kHeader_bytes && (packet[0] >> 4) == 4 &&
         std::memcmp(packet + address_at, &other.s_addr, sizeof other.s_addr) == 0;
}

int run(const std::string& device, std::uint16_t port, const std::string& to, const std::string& allowed) {
  const int tun = open("/dev/net/tun", O_RDWR);
  if (tun < 0) return fail("/dev/net/tun");
  ifreq request{};
  device.copy(request.ifr_name, IFNAMSIZ - 1);
  request.ifr_flags = IFF_TUN | IFF_NO_PI;
  if (ioctl(tun, TUNSETIFF, &request) != 0) return fail(device.c_str());
  const int udp = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  if (udp < 0 || bind(udp, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return fail("bind");
  if (inet_pton(AF_INET, to.c_str(), &address.sin_addr) != 1) return fail("--to");
  in_addr other{};
  if (inet_pton(AF_INET, allowed.c_str(), &other) != 1) return fail("--allowed");
  if (connect(udp, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return fail("connect");
  std::printf("up\n");
  std::fflush(stdout);

  std::array<char, 65536> packet{};
  ssize_t largest = 0;
  long carried = 0;
  std::array<pollfd, 2> waits{{{tun, POLLIN, 0}, {udp, POLLIN, 0}}};
  while (ends == 0) {
    if (poll(waits.data(), waits.size(), 100) <= 0) continue;
    for (std::size_t i = 0; i < waits.size(); ++i) {
      if ((waits[i].revents & (POLLIN | POLLERR)) == 0) continue;
      const ssize_t size = read(waits[i].fd, packet.data(), packet.size());
      if (size <= 0) continue;  // the other end isn't up yet
      if (!is_of(other, packet.data(), size, waits[i].fd == tun ? 16 : 12)) continue;
      // What is lost here is lost, as on any network.
      static_cast<void>(write(waits[1 - i].fd, packet.data(), static_cast<std::size_t>(size)));
      largest = std::max(largest, size);
      ++carried;
    }
  }
  std::printf("carried %ld packets, the largest of %zd bytes\n", carried, largest);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::string device = "vpn0", to, allowed;
  std::uint16_t port = 51820;
  CLI::App app;
  app.add_option("--device", device);
  app.add_option("--port", port);
  app.add_option("--to", to)->required();
  app.add_option("--allowed", allowed)->required();
  CLI11_PARSE(app, argc, argv);
  std::signal(SIGTERM, [](int) { ends = 1; });
  return run(device, port, to, allowed);
}
