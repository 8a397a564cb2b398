#include "server/service/neighbours.h"

#include <gtest/gtest.h>

#include "tests/support/messages.h"

namespace gatefield::service {
namespace {

using namespace std::chrono_literals;

protocol::ServerStatus status(const std::string& name, double room_cores, bool accepts = true) {
  auto made = test::good_status(name);
  made.room_cores = room_cores;
  made.accepts = accepts;
  return made;
}
protocol::ParticipantBytes participant(std::uint8_t number) { return {number}; }

TEST(Neighbours, WhoHasMostRoomDoesNotWait) {
  Neighbours others;
  EXPECT_EQ(others.wait(status("b", 0.0), 1s), 0ns) << "alone";
  others.hear(participant(1), status("a", 0.5), 1s);
  others.hear(participant(2), status("c", 1.0), 1s);
  EXPECT_EQ(others.wait(status("b", 1.5), 1s), 0ns);
  EXPECT_EQ(others.wait(status("b", 0.8), 1s), 150ms);
  EXPECT_EQ(others.wait(status("b", 0.1), 1s), 300ms);
  EXPECT_EQ(others.wait(status("b", 1.02), 1s), 0ns) << "as much, and the name comes first";
  EXPECT_EQ(others.wait(status("d", 1.02), 1s), 150ms);
}

TEST(Neighbours, WhoTakesNobodyComesAfterThoseWhoDo) {
  Neighbours others;
  others.hear(participant(1), status("a", 1.5, false), 1s);
  EXPECT_EQ(others.wait(status("b", 0.2), 1s), 0ns);
  others.hear(participant(1), status("a", 0.0, true), 1s);
  EXPECT_EQ(others.wait(status("b", 0.0, false), 1s), 150ms);
}

TEST(Neighbours, WhoFallsSilentIsForgotten) {
  Neighbours others;
  others.hear(participant(1), status("a", 1.5), 1s);
  EXPECT_EQ(others.wait(status("b", 0.2), 2s), 150ms);
  EXPECT_EQ(others.wait(status("b", 0.2), 2s + 1ms), 0ns);
}

TEST(Neighbours, ManyThatLieCostAMomentAndNoMemory) {
  Neighbours others;
  for (int i = 0; i < 200; ++i) others.hear(participant(static_cast<std::uint8_t>(i)), status("liar", 1000), 1s);
  EXPECT_EQ(others.wait(status("b", 0.2), 1s), 600ms);
  others.hear(participant(250), status("honest", 1.0), 3s);
  EXPECT_EQ(others.wait(status("b", 0.2), 3s), 150ms) << "there is a place again";
}

}  // namespace
}  // namespace gatefield::service
