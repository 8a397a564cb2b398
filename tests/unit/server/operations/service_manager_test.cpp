#include "server/operations/service_manager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace gatefield::operations {
namespace {

using ::testing::HasSubstr;

/// In systemd's place: hears what a service says.
class Systemd {
 public:
  Systemd() : path_(std::filesystem::temp_directory_path() / ("gatefield-notify-" + std::to_string(getpid()))) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.string().copy(address.sun_path, sizeof address.sun_path - 1);
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    setenv("NOTIFY_SOCKET", path_.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): one thread
    setenv("WATCHDOG_USEC", "3000000", 1);      // NOLINT(concurrency-mt-unsafe): one thread
    unsetenv("WATCHDOG_PID");                   // NOLINT(concurrency-mt-unsafe): one thread
  }
  ~Systemd() {
    unsetenv("NOTIFY_SOCKET");  // NOLINT(concurrency-mt-unsafe): one thread
    unsetenv("WATCHDOG_USEC");  // NOLINT(concurrency-mt-unsafe): one thread
    close(socket_);
    std::filesystem::remove(path_);
  }
  Systemd(const Systemd&) = delete;
  Systemd& operator=(const Systemd&) = delete;

  std::string heard() const {
    char buffer[512];
    const ssize_t got = recv(socket_, buffer, sizeof buffer, 0);
    return got > 0 ? std::string(buffer, static_cast<std::size_t>(got)) : std::string();
  }

 private:
  std::filesystem::path path_;
  int socket_ = -1;
};

TEST(ServiceManager, SaysWhatTheServiceDoes) {
  const Systemd systemd;
  ServiceManager manager;
  ASSERT_TRUE(manager.watchdog());
  EXPECT_EQ(*manager.watchdog(), std::chrono::seconds(3));
  manager.ready("serves 0 vehicles");
  EXPECT_EQ(systemd.heard(), "READY=1\nSTATUS=serves 0 vehicles");
  manager.alive("a line\nREADY=0");  // no status may become another word
  EXPECT_EQ(systemd.heard(), "WATCHDOG=1\nSTATUS=a line READY=0");
  manager.reloading();
  EXPECT_EQ(systemd.heard(), "RELOADING=1");
  manager.stopping("ends");
  EXPECT_THAT(systemd.heard(), HasSubstr("STOPPING=1"));
}

TEST(ServiceManager, WithoutSystemdNothingHappens) {
  ServiceManager manager;
  EXPECT_FALSE(manager.watchdog());
  manager.ready("");
  manager.alive("");
}

}  // namespace
}  // namespace gatefield::operations
