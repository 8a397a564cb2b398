#include "client/firmware/link/link.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cstring>

#include "client/firmware/link/file_descriptor.h"
#include "client/firmware/link/serial_port.h"
#include "common/base/clock.h"
#include "common/base/text.h"

namespace gatefield::firmware {
namespace {

/// @return what poll() found; 0: the time is over
short poll_for(int descriptor, short events, std::chrono::nanoseconds timeout) noexcept {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (true) {
    const auto rest = std::max(deadline - std::chrono::steady_clock::now(), std::chrono::nanoseconds{0});
    const auto whole = std::chrono::floor<std::chrono::seconds>(rest);
    const timespec wait{static_cast<time_t>(whole.count()), static_cast<long>((rest - whole).count())};
    pollfd asked{descriptor, events, 0};
    const int ready = ppoll(&asked, 1, &wait, nullptr);
    if (ready > 0) return asked.revents;
    if (ready == 0 || errno != EINTR) return 0;
  }
}

bool passes(int reason) noexcept {
  return reason == EAGAIN || reason == EWOULDBLOCK || reason == EINTR || reason == ENOBUFS;
}

std::uint16_t port_of(int socket) noexcept {
  sockaddr_in bound{};
  socklen_t size = sizeof bound;
  if (getsockname(socket, reinterpret_cast<sockaddr*>(&bound), &size) != 0) return 0;
  return ntohs(bound.sin_port);
}

/// A serial port or a TCP connection. With a listener the connection comes and goes.
class Stream final : public Link {
 public:
  Stream(const Address& address, FileDescriptor connection, FileDescriptor listener)
      : name_(to_text(address)),
        socket_(address.kind != Address::Kind::kSerial),
        connection_(std::move(connection)),
        listener_(std::move(listener)) {}

  Transfer send(std::span<const std::uint8_t> message) noexcept override {
    assert(message.size() <= kMaxMessage);
    if (!connection_) return {};
    if (const int reason = finish_pending(); reason != 0) return lost(reason);
    if (pending_ > 0) return {};
    const ssize_t taken = write(message);
    if (taken < 0 && !passes(errno)) return lost(errno);
    const std::size_t done = taken > 0 ? static_cast<std::size_t>(taken) : 0;
    if (done == 0) return {};
    pending_ = message.size() - done;
    std::copy(message.begin() + static_cast<std::ptrdiff_t>(done), message.end(), rest_.begin());
    return {message.size(), 0};
  }

  Transfer receive(std::span<std::uint8_t> buffer) noexcept override {
    if (!connection_ && !accept_one()) return {};
    const ssize_t got = socket_ ? recv(connection_.get(), buffer.data(), buffer.size(), 0)
                                : ::read(connection_.get(), buffer.data(), buffer.size());
    if (got > 0) return {static_cast<std::size_t>(got), 0};
    if (got == 0) return buffer.empty() ? Transfer{} : lost(Transfer::kHungUp);
    return passes(errno) ? Transfer{} : lost(errno);
  }

  bool wait(std::chrono::nanoseconds timeout) noexcept override {
    const auto deadline = std::chrono::steady_clock::now() + timeout;
    if (!connection_) {
      if (!listener_ || poll_for(listener_.get(), POLLIN, timeout) == 0 || !accept_one()) return false;
    }
    return poll_for(connection_.get(), POLLIN, deadline - std::chrono::steady_clock::now()) != 0;
  }

  std::uint16_t local_port() const noexcept override {
    return socket_ ? port_of(listener_ ? listener_.get() : connection_.get()) : std::uint16_t{0};
  }
  const std::string& name() const noexcept override { return name_; }

 private:
  ssize_t write(std::span<const std::uint8_t> bytes) noexcept {
    return socket_ ? ::send(connection_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL)
                   : ::write(connection_.get(), bytes.data(), bytes.size());
  }

  /// @return errno that ends the link, or 0
  int finish_pending() noexcept {
    if (pending_ == 0) return 0;
    const ssize_t taken = write({rest_.data(), pending_});
    if (taken < 0) return passes(errno) ? 0 : errno;
    const auto done = static_cast<std::size_t>(taken);
    pending_ -= done;
    std::copy_n(rest_.begin() + static_cast<std::ptrdiff_t>(done), pending_, rest_.begin());
    return 0;
  }

  bool accept_one() noexcept {
    if (!listener_) return false;
    connection_ = FileDescriptor(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!connection_) return false;
    const int on = 1;
    setsockopt(connection_.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    return true;
  }

  Transfer lost(int reason) noexcept {
    if (listener_) {
      connection_.close();
      pending_ = 0;
    }
    return {0, reason == EPIPE || reason == ECONNRESET ? Transfer::kHungUp : reason};
  }

  const std::string name_;
  const bool socket_;
  FileDescriptor connection_, listener_;
  std::array<std::uint8_t, kMaxMessage> rest_{};  // of a message that was half taken
  std::size_t pending_ = 0;
};

class Datagrams final : public Link {
 public:
  Datagrams(const Address& address, FileDescriptor socket, std::optional<sockaddr_in> peer)
      : name_(to_text(address)), learns_(!peer), socket_(std::move(socket)), peer_(peer) {}

  Transfer send(std::span<const std::uint8_t> message) noexcept override {
    assert(message.size() <= kMaxMessage);
    if (!peer_) return {};
    const ssize_t taken = sendto(socket_.get(), message.data(), message.size(), MSG_NOSIGNAL,
                                 reinterpret_cast<const sockaddr*>(&*peer_), sizeof *peer_);
    if (taken >= 0) return {message.size(), 0};
    return nobody_there_yet(errno) ? Transfer{} : Transfer{0, errno};
  }

  Transfer receive(std::span<std::uint8_t> buffer) noexcept override {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t got =
        recvfrom(socket_.get(), buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (got < 0) return nobody_there_yet(errno) ? Transfer{} : Transfer{0, errno};
    if (learns_) peer_ = from;
    return {static_cast<std::size_t>(got), 0};
  }

  bool wait(std::chrono::nanoseconds timeout) noexcept override {
    return poll_for(socket_.get(), POLLIN, timeout) != 0;
  }

  std::uint16_t local_port() const noexcept override { return port_of(socket_.get()); }
  const std::string& name() const noexcept override { return name_; }

 private:
  /// The other machine says that nobody hears there: UDP has no connection, so somebody may later.
  static bool nobody_there_yet(int reason) noexcept {
    return passes(reason) || reason == ECONNREFUSED || reason == EHOSTUNREACH || reason == ENETUNREACH;
  }

  const std::string name_;
  const bool learns_;
  FileDescriptor socket_;
  std::optional<sockaddr_in> peer_;
};

sockaddr_in socket_address(const std::string& host, std::uint16_t port) noexcept {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  inet_pton(AF_INET, host.c_str(), &address.sin_addr);
  return address;
}

Error no_socket(const Address& address, int reason) {
  return Error(to_text(address) + ": no socket can be made: " + std::strerror(reason) +
                   "; close programs that hold many files open",
               ErrorCode::kOther);
}

Status bind_to(const FileDescriptor& socket, const Address& address, const std::string& host, std::uint16_t port) {
  const sockaddr_in own = socket_address(host, port);
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0) return {};
  const int reason = errno;
  const auto invalid = [&](const char* field, const std::string& value, const std::string& what) {
    Error error(to_text(address) + ": " + what, ErrorCode::kInvalid, field);
    error.value = value;
    return error;
  };
  const std::string number = std::to_string(port);
  if (reason == EADDRINUSE)
    return invalid("port", number,
                   "port " + number + " is in use; end the program that hears there (ss -lnp), or take another port");
  if (reason == EACCES)
    return invalid("port", number, "port " + number + " is not for this user, expected one from 1024 on");
  if (reason == EADDRNOTAVAIL)
    return invalid("host", host, host + " is no address of this machine, expected one (ip address) or 0.0.0.0 for all");
  return invalid("port", number, "can't hear on port " + number + ": " + std::strerror(reason));
}

Error nobody(const Address& address, const std::string& what) {
  return Error(to_text(address) + ": " + what +
                   "; start the flight controller (or its simulator) first, and look whether "
                   "host and port are its own",
               ErrorCode::kNoAnswer, "port");
}

Result<std::unique_ptr<Link>> connect_tcp(const Address& address, std::chrono::nanoseconds timeout) {
  FileDescriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket) return no_socket(address, errno);
  const int on = 1;
  setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  const sockaddr_in peer = socket_address(address.place, address.port);
  if (connect(socket.get(), reinterpret_cast<const sockaddr*>(&peer), sizeof peer) != 0) {
    int reason = errno;
    if (reason == EINPROGRESS) {
      if (poll_for(socket.get(), POLLOUT, timeout) == 0)
        return nobody(address, "no answer within " + text(seconds(timeout)) + " s");
      socklen_t size = sizeof reason;
      getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &reason, &size);
    }
    if (reason != 0) return nobody(address, std::string("no connection: ") + std::strerror(reason));
  }
  return std::unique_ptr<Link>(std::make_unique<Stream>(address, std::move(socket), FileDescriptor()));
}

Result<std::unique_ptr<Link>> listen_tcp(const Address& address) {
  FileDescriptor listener(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!listener) return no_socket(address, errno);
  const int on = 1;
  setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);  // a server of a moment ago may still linger
  if (auto status = bind_to(listener, address, address.place, address.port); !status) return status.failure();
  if (listen(listener.get(), 1) != 0) return no_socket(address, errno);
  return std::unique_ptr<Link>(std::make_unique<Stream>(address, FileDescriptor(), std::move(listener)));
}

Result<std::unique_ptr<Link>> open_udp(const Address& address) {
  FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket) return no_socket(address, errno);
  const bool listens = address.kind == Address::Kind::kUdpListen;
  if (auto status = listens ? bind_to(socket, address, address.place, address.port)
                            : bind_to(socket, address, "0.0.0.0", address.local_port);
      !status)
    return status.failure();
  std::optional<sockaddr_in> peer;
  if (!listens) peer = socket_address(address.place, address.port);
  return std::unique_ptr<Link>(std::make_unique<Datagrams>(address, std::move(socket), peer));
}

}  // namespace

Result<std::unique_ptr<Link>> open(const Address& address, std::chrono::nanoseconds timeout) {
  switch (address.kind) {
    case Address::Kind::kSerial: {
      auto port = open_serial_port(address);
      if (!port) return port.failure();
      return std::unique_ptr<Link>(std::make_unique<Stream>(address, std::move(port).value(), FileDescriptor()));
    }
    case Address::Kind::kTcp:
      return connect_tcp(address, timeout);
    case Address::Kind::kTcpListen:
      return listen_tcp(address);
    case Address::Kind::kUdp:
    case Address::Kind::kUdpListen:
      break;
  }
  return open_udp(address);
}

Error broken(const Link& link, const Transfer& transfer) {
  assert(transfer.broken != 0);
  const std::string what =
      transfer.broken == Transfer::kHungUp ? "the other side closed it" : std::strerror(transfer.broken);
  return Error(link.name() + " broke: " + what + "; look at cable and power of the flight controller, then start again",
               ErrorCode::kNoAnswer);
}

}  // namespace gatefield::firmware
