// What comes in from a network that nobody trusts, beside a race.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <thread>

#include "common/base/random.h"
#include "common/dds/packet_check.h"
#include "tests/integration/race/programs.h"
#include "tests/support/rtps_corpus.h"
#include "tests/support/rtps_packet.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

using Bytes = std::vector<std::uint8_t>;

/// A stranger on the network of this test's domain: hears who announces itself, and sends to everybody.
class Stranger {
 public:
  Stranger() : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const int yes = 1;
    ::setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in any = address("0.0.0.0", kFirstPort);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&any), sizeof any), 0);
    ip_mreq group{};
    ::inet_pton(AF_INET, kGroup, &group.imr_multiaddr);
    EXPECT_EQ(::setsockopt(socket_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group), 0);
    const timeval second{1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &second, sizeof second);
  }
  ~Stranger() { ::close(socket_); }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;

  /// The first 20 bytes of an announcement: protocol, vendor and who it is.
  std::optional<Bytes> hear_somebody() const {
    Bytes packet(65536);
    const ssize_t size = ::recv(socket_, packet.data(), packet.size(), 0);
    if (size < 20) return std::nullopt;
    packet.resize(20);
    return packet;
  }
  /// To the port where everybody listens, and to those of the first participants.
  void send(const Bytes& packet) const {
    send(packet, address(kGroup, kFirstPort));
    for (std::uint16_t port = 10; port < 18; ++port)
      send(packet, address("127.0.0.1", static_cast<std::uint16_t>(kFirstPort + port)));
  }

 private:
  static constexpr const char* kGroup = "239.255.0.1";
  static inline const std::uint16_t kFirstPort = static_cast<std::uint16_t>(7400 + 250 * own_domain());

  static sockaddr_in address(const char* host, std::uint16_t port) {
    sockaddr_in result{};
    result.sin_family = AF_INET;
    result.sin_port = htons(port);
    ::inet_pton(AF_INET, host, &result.sin_addr);
    return result;
  }
  void send(const Bytes& packet, const sockaddr_in& to) const {
    ::sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }

  int socket_;
};

/// One of the entities that discovery makes, or one of ours.
std::uint32_t entity(Random* random, bool writer) {
  constexpr std::uint32_t kDiscovery[] = {0xc2000100, 0xc2030000, 0xc2040000, 0xc2000200};
  if (random->chance(0.5)) return kDiscovery[random->below(4)] + (writer ? 0 : 0x05000000);
  const std::uint32_t kind = writer ? (random->chance(0.5) ? 0x02 : 0x03) : (random->chance(0.5) ? 0x04 : 0x07);
  return kind << 24 | (1 + random->below(12)) << 16;
}

/// A packet that no participant sends, as if from somebody who is there: ranges that no memory holds, fragments of
/// samples that don't fit, statistics that the library asserts, and noise.
Bytes hostile(const Bytes& somebody, Random* random) {
  RtpsPacket packet;
  const std::uint32_t reader = entity(random, false), writer = entity(random, true);
  switch (random->below(8)) {
    case 0:
      packet.u8({0x80, 1}).u16(56).zeros(56 + random->below(64) + 1);
      break;
    case 1:  // GAP: a reader would keep each of its numbers
      packet.begin(0x08).u32(reader).u32(writer).sequence(1 + random->below(1000)).sequence(std::int64_t{1} << 40);
      packet.u32(0).end();
      break;
    case 2:  // HEARTBEAT
      packet.begin(0x07).u32(reader).u32(writer).sequence(1).sequence(std::int64_t{1} << 60).u32(random->bits()).end();
      break;
    case 3:  // ACKNACK
      packet.begin(0x06).u32(reader).u32(writer).sequence(1).u32(0x10000).zeros(32).u32(random->bits()).end();
      break;
    case 4:  // DATA_FRAG of four gigabytes
      packet.begin(0x16).u16(0).u16(28).u32(reader).u32(writer).sequence(1 + random->below(100)).u32(1).u16(1);
      packet.u16(64).u32(0xffffff00).zeros(64).end();
      break;
    case 5:  // DATA of discovery whose list has no end
      packet.begin(0x15, 4).u16(0).u16(16).u32(0).u32(0xc2000100).sequence(1 + random->below(100));
      packet.u8({0, 3, 0, 0}).u16(0x15).u16(0xfff0).zeros(40).end();
      break;
    case 6:  // a length beyond the end
      packet.u8({static_cast<int>(random->below(0x20)), 1}).u16(0x7000).zeros(random->below(40));
      break;
    default:  // noise behind a submessage's header that can't be
      packet.u8({0x15, 5}).u16(0xffff);
      for (std::uint32_t i = random->below(200); i > 0; --i) packet.u8({static_cast<int>(random->bits() & 0xff)});
  }
  Bytes bytes = packet.bytes();
  std::copy(somebody.begin(), somebody.end(), bytes.begin());
  return bytes;
}

/// A recorded packet to somebody who is there, with a few bytes spoiled: from somebody who is there, too, unless it is
/// right in its form still. What is right in form in another's name (a goodbye, an answer that was never given) takes
/// security to tell, docs/security.md.
Bytes spoiled(Bytes packet, const Bytes& from, const Bytes& to, Random* random) {
  constexpr std::size_t kDestination_at = 20;  // INFO_DST, where there is one
  if (packet[kDestination_at] == 0x0e) std::copy(to.begin() + 8, to.end(), packet.begin() + kDestination_at + 4);
  const auto draw = [random](std::size_t count) {
    return std::size_t{random->below(static_cast<std::uint32_t>(count))};
  };
  for (std::size_t i = 0, count = 1 + draw(4); i < count; ++i)
    packet[20 + draw(packet.size() - 20)] = static_cast<std::uint8_t>(random->bits());
  if (random->chance(0.2)) packet.resize(20 + draw(packet.size() - 19));
  if (dds::check_packet(packet).fault != dds::PacketFault::kNone) std::copy(from.begin(), from.end(), packet.begin());
  return packet;
}

const Bytes& any_of(const std::vector<Bytes>& packets, Random* random) {
  return packets[random->below(static_cast<std::uint32_t>(packets.size()))];
}

std::size_t memory_kib(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmRSS:")) return std::strtoul(line.c_str() + 6, nullptr, 10);
  return 0;
}

constexpr unsigned long kPerRound = 3;

/// GATEFIELD_HOSTILE_PACKETS sets how many are sent; docs/long-checks.md has a row for 10^6.
TEST(HostilePackets, EndNobodyAndCostNoRace) {
  const char* const wanted = std::getenv("GATEFIELD_HOSTILE_PACKETS");
  const unsigned long rounds = (wanted != nullptr ? std::strtoul(wanted, nullptr, 10) : 30'000) / kPerRound;
  const std::vector<Bytes> recorded = recorded_packets(GATEFIELD_SOURCE_DIR "/tests/data/rtps/recorded.hex");
  ASSERT_GE(recorded.size(), 30u);
  Programs programs("hostile");
  Process server = programs.server("server.log");
  ASSERT_TRUE(server.wait_for_output("ready: server", 30s)) << server.output();
  Stranger stranger;
  Random random(5);
  std::vector<Bytes> somebody;
  std::size_t kib = 0;
  std::atomic<bool> racing{true};
  std::string lost;
  int won = 0;
  std::thread races([&] {
    while (racing && lost.empty()) {
      Process sim = programs.simulator("sim.log", {"--scenario", "circle-0.3m", "--seed", "1", "--speed", "8"});
      if (sim.wait(200s).value_or(-1) != 0) lost = sim.output() + server.output();
      won += lost.empty();
    }
  });
  for (unsigned long sent = 0; sent < rounds && lost.empty() && server.running(); ++sent) {
    if (sent % 1000 == 0)
      if (auto heard = stranger.hear_somebody()) somebody.push_back(std::move(*heard));
    if (somebody.empty()) continue;
    const auto anybody = [&]() -> const Bytes& { return any_of(somebody, &random); };
    stranger.send(deadly_packet());
    stranger.send(hostile(anybody(), &random));
    stranger.send(spoiled(any_of(recorded, &random), anybody(), anybody(), &random));
    if (sent % 20 == 0) std::this_thread::sleep_for(1ms);
    if (sent == rounds / 4) kib = memory_kib(server.pid());
  }
  racing = false;
  races.join();
  EXPECT_EQ(lost, "");
  ASSERT_TRUE(server.running()) << server.output();
  EXPECT_GE(somebody.size(), 2u) << "both were heard of";
  const std::size_t kib_at_end = memory_kib(server.pid());
  EXPECT_LT(kib_at_end, kib + 20'000) << "KiB grown from " << kib;
  std::printf("%lu packets, %d races won, server of %zu KiB, %zu at the end\n", kPerRound * rounds, won, kib,
              kib_at_end);
  EXPECT_TRUE(server.wait_for_output("that no DDS participant sends", 2s)) << server.output();
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(5s).value_or(-1), 0) << server.output();
}

}  // namespace
}  // namespace gatefield::test
