#include "client/firmware/link/serial_port.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>

namespace gatefield::firmware {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr auto kSoon = 2s;

/// A pseudo terminal: what is written into one end comes out of the other, which looks like a serial port.
class SerialLink : public testing::Test {
 protected:
  void SetUp() override {
    board = FileDescriptor(posix_openpt(O_RDWR | O_NOCTTY));
    ASSERT_TRUE(board);
    ASSERT_EQ(grantpt(board.get()), 0);
    ASSERT_EQ(unlockpt(board.get()), 0);
    std::array<char, 64> name{};
    ASSERT_EQ(ptsname_r(board.get(), name.data(), name.size()), 0);
    address.place = name.data();
    address.baud = 115200;
  }

  FileDescriptor board;
  Address address;
};

TEST_F(SerialLink, CarriesEveryByteUnchangedBothWays) {
  auto link = open(address, kSoon);
  ASSERT_TRUE(link.ok()) << link.error();
  std::array<std::uint8_t, 256> all{}, back{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);

  EXPECT_EQ((*link)->send(all).bytes, all.size());
  ASSERT_EQ(::read(board.get(), back.data(), back.size()), 256);
  EXPECT_EQ(back, all);

  ASSERT_EQ(::write(board.get(), all.data(), all.size()), 256);
  back.fill(0);
  for (std::size_t got = 0; got < all.size();) {
    ASSERT_TRUE((*link)->wait(kSoon));
    got += (*link)->receive(std::span(back).subspan(got)).bytes;
  }
  EXPECT_EQ(back, all);
}

TEST_F(SerialLink, NothingThereIsNoFailure) {
  auto link = open(address, kSoon);
  ASSERT_TRUE(link.ok()) << link.error();
  std::array<std::uint8_t, 8> buffer{};
  const Transfer nothing = (*link)->receive(buffer);
  EXPECT_EQ(nothing.bytes, 0u);
  EXPECT_EQ(nothing.broken, 0);
  EXPECT_EQ((*link)->local_port(), 0);
}

TEST_F(SerialLink, ABoardThatIsUnpluggedIsTold) {
  auto link = open(address, kSoon);
  ASSERT_TRUE(link.ok()) << link.error();
  board.close();
  EXPECT_TRUE((*link)->wait(kSoon));
  std::array<std::uint8_t, 8> buffer{};
  EXPECT_NE((*link)->receive(buffer).broken, 0);
}

TEST_F(SerialLink, EveryRateThatIsAllowedIsSet) {
  for (const int baud : baud_rates()) {
    address.baud = baud;
    EXPECT_TRUE(open_serial_port(address).ok()) << baud;
  }
  address.baud = 12345;
  const auto port = open_serial_port(address);
  ASSERT_FALSE(port.ok());
  EXPECT_EQ(port.failure().field, "baud");
}

TEST(SerialPort, ADeviceThatIsMissingOrNoneIsToldWithTheNextStep) {
  Address address;
  address.baud = 115200;
  address.place = "/dev/no-such-board";
  auto port = open_serial_port(address);
  ASSERT_FALSE(port.ok());
  EXPECT_EQ(port.failure().code, ErrorCode::kUnreadable);
  EXPECT_EQ(port.failure().field, "device");
  EXPECT_THAT(port.error(), HasSubstr("plug the board in"));

  address.place = "/dev/null";
  port = open_serial_port(address);
  ASSERT_FALSE(port.ok());
  EXPECT_EQ(port.failure().field, "device");
  EXPECT_THAT(port.error(), HasSubstr("expected a serial port"));
}

TEST_F(SerialLink, ADeviceWithoutPermissionIsToldWithTheGroup) {
  ASSERT_EQ(chmod(address.place.c_str(), 0), 0);
  constexpr uid_t kNobody = 65534;
  const bool root = geteuid() == 0;  // who may open everything
  ASSERT_EQ(root ? seteuid(kNobody) : 0, 0);
  const auto port = open_serial_port(address);
  ASSERT_EQ(root ? seteuid(0) : 0, 0);
  ASSERT_FALSE(port.ok());
  EXPECT_EQ(port.failure().code, ErrorCode::kUnreadable);
  EXPECT_EQ(port.failure().field, "device");
  EXPECT_THAT(port.error(), HasSubstr("dialout"));
}

}  // namespace
}  // namespace gatefield::firmware
