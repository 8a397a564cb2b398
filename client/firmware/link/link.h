#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/base/result.h"

/// Bytes to and from a flight controller: a serial port, TCP or UDP. What they mean is the codecs' affair.
namespace gatefield::firmware {

/// Where the other side is. As text, the way configuration files say it:
///   serial:/dev/ttyACM0:115200   device and baud rate (one of those that Linux names, 9600 to 4000000)
///   tcp:127.0.0.1:5761           connects to it
///   tcp-listen:127.0.0.1:4560    waits for the other side to connect; one at a time, the next when it has gone
///   udp:127.0.0.1:9003           sends there, hears what comes back to the port it sent from
///   udp-listen:0.0.0.0:14550     hears on this port, answers whoever was heard last
///   udp:127.0.0.1:9003:9002      sends to the first port, hears on the second
/// Hosts are IPv4 addresses or "localhost", so that no name server is waited for. Port 0 of the listening kinds: any
/// that is free (Link::local_port()).
struct Address {
  enum class Kind : std::uint8_t { kSerial, kTcp, kTcpListen, kUdp, kUdpListen };
  Kind kind = Kind::kSerial;
  std::string place;             ///< device of a serial port, else the host's IPv4 address
  int baud = 0;                  ///< serial
  std::uint16_t port = 0;        ///< TCP and UDP
  std::uint16_t local_port = 0;  ///< kUdp: where to hear; 0: any
};

/// Errors: kInvalid with the part that is wrong as field ("kind", "device", "baud", "host", "port"), its value, and
/// what was expected.
Result<Address> parse_address(std::string_view text);
std::string to_text(const Address& address);

/// What a receive() or a send() came to.
struct Transfer {
  std::size_t bytes = 0;  ///< moved; 0 and not broken: nothing there, or no room now
  int broken = 0;  ///< errno of a link that is of no more use, kHungUp when the other side closed it; 0: it works
  static constexpr int kHungUp = -1;
};

/// One connection. No call but wait() waits. A link that listens tells once that the other side has gone (kHungUp), and
/// hears the next one after that.
/// Thread-safe: no.   Real-time safe: send() and receive() yes (system calls, no allocation).
class Link {
 public:
  virtual ~Link() = default;

  /// Takes the whole message or nothing of it. Nothing is taken while the rest of an earlier message still waits for
  /// room, so old commands do not queue up before new ones; what is half sent is finished first. Links that listen take
  /// nothing (0 bytes) before the other side has been heard.
  /// @pre message.size() <= kMaxMessage
  virtual Transfer send(std::span<const std::uint8_t> message) noexcept = 0;
  static constexpr std::size_t kMaxMessage = 2048;

  /// What came, as much as `buffer` holds. UDP: one datagram, cut when it is longer than that.
  virtual Transfer receive(std::span<std::uint8_t> buffer) noexcept = 0;

  /// Waits until there is something to receive. @return false: the time is over
  virtual bool wait(std::chrono::nanoseconds timeout) noexcept = 0;

  /// Where it hears, of TCP and UDP; 0: a serial port.
  virtual std::uint16_t local_port() const noexcept = 0;

  /// The address as text, for sentences.
  virtual const std::string& name() const noexcept = 0;
};

/// Opens it. TCP waits at most `timeout` for the other side to accept; all others are there at once or not at all.
///
/// Errors, each with what to do next:
///   kUnreadable  field "device": it does not exist, may not be opened, is in use, or is no serial port
///   kInvalid     field "baud": the device refuses this rate; field "port": taken, or not allowed
///   kNoAnswer    field "host" or "port": nobody listens there, or did not answer in time
/// Thread-safe: yes.   Real-time safe: no.
Result<std::unique_ptr<Link>> open(const Address& address, std::chrono::nanoseconds timeout);

/// What a broken link means: "serial:/dev/ttyACM0:115200 broke: ...", code kNoAnswer.
/// @pre transfer.broken != 0
Error broken(const Link& link, const Transfer& transfer);

}  // namespace gatefield::firmware
