#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <vector>

#include "client/firmware/link/link.h"
#include "client/firmware/link/serial_port.h"
#include "common/base/text.h"

namespace gatefield::firmware {
namespace {

constexpr std::array<std::pair<std::string_view, Address::Kind>, 5> kKinds{{{"serial", Address::Kind::kSerial},
                                                                            {"tcp", Address::Kind::kTcp},
                                                                            {"tcp-listen", Address::Kind::kTcpListen},
                                                                            {"udp", Address::Kind::kUdp},
                                                                            {"udp-listen", Address::Kind::kUdpListen}}};
constexpr std::size_t kMaxShown = 200;

std::vector<std::string_view> parts_of(std::string_view whole) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0;;) {
    const std::size_t end = whole.find(':', begin);
    parts.push_back(whole.substr(begin, end - begin));
    if (end == std::string_view::npos) return parts;
    begin = end + 1;
  }
}

std::optional<int> whole_number(std::string_view digits) {
  int number = 0;
  const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (failure != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  return number;
}

Error wrong(const char* field, std::string_view value, const std::string& expected) {
  return Error::invalid(field, "'" + shown(value, kMaxShown) + "'", expected);
}

Result<std::uint16_t> to_port(std::string_view digits, bool may_be_free) {
  const auto number = whole_number(digits);
  if (!number || *number < (may_be_free ? 0 : 1) || *number > 65535)
    return wrong("port", digits, may_be_free ? "a port, 1 to 65535, or 0 for any that is free" : "a port, 1 to 65535");
  return static_cast<std::uint16_t>(*number);
}

Result<Address> to_serial(const std::vector<std::string_view>& parts) {
  if (parts.size() != 3 || !parts[1].starts_with('/') || !printable(parts[1]))
    return wrong("device", parts.size() > 1 ? parts[1] : "",
                 "serial:DEVICE:BAUD with the device's whole path, serial:/dev/ttyACM0:115200");
  Address address;
  address.place = parts[1];
  const auto baud = whole_number(parts[2]);
  const auto known = baud_rates();
  if (!baud || std::find(known.begin(), known.end(), *baud) == known.end()) {
    std::string expected = "one of";
    for (const int rate : known) expected += " " + std::to_string(rate);
    return wrong("baud", parts[2], expected);
  }
  address.baud = *baud;
  return address;
}

Result<Address> to_network(Address::Kind kind, const std::vector<std::string_view>& parts) {
  const bool listens = kind == Address::Kind::kTcpListen || kind == Address::Kind::kUdpListen;
  const bool has_local_port = kind == Address::Kind::kUdp && parts.size() == 4;
  if (parts.size() != 3 && !has_local_port)
    return wrong(
        "port", parts.size() > 3 ? parts[3] : "",
        std::string(parts[0]) + ":HOST:PORT" + (kind == Address::Kind::kUdp ? " or udp:HOST:PORT:OWN_PORT" : ""));
  Address address;
  address.kind = kind;
  address.place = parts[1] == "localhost" ? "127.0.0.1" : std::string(parts[1]);
  in_addr ignored{};
  if (inet_pton(AF_INET, address.place.c_str(), &ignored) != 1)
    return wrong("host", parts[1], "an IPv4 address (192.168.4.1) or localhost");
  auto port = to_port(parts[2], listens);
  if (!port) return port.failure();
  address.port = *port;
  if (has_local_port) {
    auto own = to_port(parts[3], false);
    if (!own) return own.failure();
    address.local_port = *own;
  }
  return address;
}

}  // namespace

Result<Address> parse_address(std::string_view text) {
  const auto parts = parts_of(text);
  for (const auto& [name, kind] : kKinds) {
    if (parts[0] != name) continue;
    return kind == Address::Kind::kSerial ? to_serial(parts) : to_network(kind, parts);
  }
  std::string expected = "one of";
  for (const auto& [name, kind] : kKinds) expected.append(" ").append(name).append(":");
  return wrong("kind", parts[0], expected + ", as in serial:/dev/ttyACM0:115200 or tcp:127.0.0.1:5761");
}

std::string to_text(const Address& address) {
  std::string written;
  for (const auto& [name, kind] : kKinds)
    if (kind == address.kind) written = name;
  written.append(":").append(address.place).append(":");
  if (address.kind == Address::Kind::kSerial) return written + std::to_string(address.baud);
  written += std::to_string(address.port);
  if (address.local_port != 0) written += ":" + std::to_string(address.local_port);
  return written;
}

}  // namespace gatefield::firmware
