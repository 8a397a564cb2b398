#pragma once

#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/process.h"

namespace gatefield::test {

/// A network namespace: interfaces, addresses and ports of its own, as another host would have. Gone with the object.
/// Needs root.
class NetworkSpace {
 public:
  /// @param name  short; the process's number is added
  explicit NetworkSpace(const std::string& name) : name_(name + "-" + std::to_string(getpid())) {
    ip("netns add " + name_);
    ip("-n " + name_ + " link set lo up");
  }
  ~NetworkSpace() { attempt("ip netns delete " + name_); }
  NetworkSpace(const NetworkSpace&) = delete;
  NetworkSpace& operator=(const NetworkSpace&) = delete;

  /// Whether this user may have any.
  static bool permitted() {
    const std::string name = "gf-try-" + std::to_string(getpid());
    return attempt("ip netns add " + name + " && ip netns delete " + name);
  }

  /// A cable to another one, and its ends' addresses ("10.81.1.2/24").
  void connect(NetworkSpace& other, const std::string& device, const std::string& address,
               const std::string& other_device, const std::string& other_address) {
    ip("-n " + name_ + " link add " + device + " type veth peer name " + other_device + " netns " + other.name_);
    address_of(device, address);
    other.address_of(other_device, other_address);
  }
  /// `ip -n <this> <words>`
  void configure(const std::string& words) { ip("-n " + name_ + " " + words); }
  /// Whether this machine has what is asked for: configure() without an exception.
  bool may_have(const std::string& words) const { return attempt("ip -n " + name_ + " " + words); }
  /// Hands packets on between its interfaces.
  void route() { shell("ip netns exec " + name_ + " sh -c 'echo 1 > /proc/sys/net/ipv4/ip_forward'"); }

  /// A program in here.
  Process run(const std::string& program, const std::vector<std::string>& arguments,
              const std::filesystem::path& output) const {
    std::vector<std::string> words{"netns", "exec", name_, program};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return Process("/usr/sbin/ip", words, output);
  }

 private:
  void address_of(const std::string& device, const std::string& address) {
    configure("addr add " + address + " dev " + device);
    configure("link set " + device + " up");
  }
  static bool attempt(const std::string& command) {
    const auto log = std::filesystem::temp_directory_path() / ("gatefield-ip-" + std::to_string(getpid()));
    Process process("/bin/sh", {"-c", command}, log);
    const bool good = process.wait(std::chrono::seconds(20)).value_or(-1) == 0;
    std::error_code failed;
    std::filesystem::remove(log, failed);
    return good;
  }
  static void shell(const std::string& command) {
    if (!attempt(command)) throw std::runtime_error("failed: " + command);
  }
  static void ip(const std::string& words) { shell("ip " + words); }

  std::string name_;
};

}  // namespace gatefield::test
