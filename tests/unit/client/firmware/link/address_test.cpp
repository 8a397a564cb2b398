#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/firmware/link/link.h"

namespace gatefield::firmware {
namespace {

using testing::HasSubstr;

TEST(LinkAddress, WhatIsWrittenIsReadAndWrittenAgain) {
  for (const char* written : {"serial:/dev/ttyACM0:115200", "serial:/dev/serial/by-id/usb-x-if00:4000000",
                              "tcp:127.0.0.1:5761", "tcp-listen:0.0.0.0:4560", "tcp-listen:127.0.0.1:0",
                              "udp:192.168.4.1:14550", "udp:127.0.0.1:9003:9002", "udp-listen:0.0.0.0:14550"}) {
    const auto address = parse_address(written);
    ASSERT_TRUE(address.ok()) << address.error();
    EXPECT_EQ(to_text(*address), written);
  }
}

TEST(LinkAddress, LocalhostIsThisMachine) {
  const auto address = parse_address("tcp:localhost:5761");
  ASSERT_TRUE(address.ok());
  EXPECT_EQ(to_text(*address), "tcp:127.0.0.1:5761");
}

TEST(LinkAddress, SaysWhichPartIsWrongAndWhatWouldBeRight) {
  struct Case {
    const char *written, *field, *expected;
  };
  for (const auto& [written, field, expected] : {Case{"", "kind", "serial: tcp: tcp-listen: udp: udp-listen:"},
                                                 Case{"usb:/dev/ttyACM0:115200", "kind", "one of"},
                                                 Case{"serial:ttyACM0:115200", "device", "whole path"},
                                                 Case{"serial:/dev/ttyACM0", "device", "serial:DEVICE:BAUD"},
                                                 Case{"serial:/dev/ttyACM0:115201", "baud", "115200"},
                                                 Case{"serial:/dev/ttyACM0:-1", "baud", "one of 9600"},
                                                 Case{"serial:/dev/ttyACM0:fast", "baud", "one of 9600"},
                                                 Case{"serial:/dev/ttyACM0:115200:8N1", "device", "BAUD"},
                                                 Case{"serial:/dev/tty\nACM0:115200", "device", "whole path"},
                                                 Case{"tcp:drone.local:5761", "host", "IPv4"},
                                                 Case{"tcp:127.0.0.256:5761", "host", "IPv4"},
                                                 Case{"tcp::5761", "host", "IPv4"},
                                                 Case{"tcp:127.0.0.1", "port", "tcp:HOST:PORT"},
                                                 Case{"tcp:127.0.0.1:0", "port", "1 to 65535"},
                                                 Case{"tcp:127.0.0.1:65536", "port", "1 to 65535"},
                                                 Case{"tcp:127.0.0.1:99999999999", "port", "1 to 65535"},
                                                 Case{"tcp:127.0.0.1: 80", "port", "1 to 65535"},
                                                 Case{"tcp:127.0.0.1:5761:5762", "port", "tcp:HOST:PORT"},
                                                 Case{"udp:127.0.0.1:1:2:3", "port", "OWN_PORT"},
                                                 Case{"udp:127.0.0.1:9003:0", "port", "1 to 65535"},
                                                 Case{"udp-listen:0.0.0.0:-1", "port", "0 for any"}}) {
    const auto address = parse_address(written);
    ASSERT_FALSE(address.ok()) << written;
    EXPECT_EQ(address.failure().code, ErrorCode::kInvalid) << written;
    EXPECT_EQ(address.failure().field, field) << written;
    EXPECT_THAT(address.error(), HasSubstr(expected)) << written;
    EXPECT_THAT(address.error(), testing::Not(HasSubstr("\n"))) << written;
  }
}

}  // namespace
}  // namespace gatefield::firmware
