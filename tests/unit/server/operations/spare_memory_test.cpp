#include "server/operations/spare_memory.h"

#include <gtest/gtest.h>

namespace gatefield::operations {
namespace {

using namespace std::chrono_literals;

service::Figures at(Stamp made, std::uint64_t sessions_begun, std::size_t vehicles = 0) {
  service::Figures figures;
  figures.made = made;
  figures.sessions_begun = sessions_begun;
  figures.vehicles.resize(vehicles);
  return figures;
}

TEST(SpareMemory, IsGivenBackOnceAfterVehiclesHaveGone) {
  SpareMemory memory;
  EXPECT_FALSE(memory.look(at(1s, 1, 1)));
  EXPECT_FALSE(memory.look(at(20s, 1))) << "they have only just gone";
  EXPECT_FALSE(memory.look(at(21s, 1)));
  EXPECT_TRUE(memory.look(at(22s, 1)));
  EXPECT_FALSE(memory.look(at(23s, 1))) << "nothing has happened since";
}

TEST(SpareMemory, StaysWhileSomebodyFlies) {
  SpareMemory memory;
  for (int i = 0; i < 60; ++i) EXPECT_FALSE(memory.look(at(i * 1s, 3, 1)));
  EXPECT_FALSE(memory.look(at(60s, 3)));
  EXPECT_FALSE(memory.look(at(61s, 4, 1))) << "another one came in between";
  EXPECT_FALSE(memory.look(at(63s, 4)));
  EXPECT_TRUE(memory.look(at(65s, 4)));
}

TEST(SpareMemory, StaysWhileAVehicleCouldBeTakenOver) {
  SpareMemory memory;
  service::Figures standing_by = at(1s, 0);
  standing_by.stands_by_for = 1;
  EXPECT_FALSE(memory.look(standing_by));
  standing_by.made = 10s;
  standing_by.sessions_begun = 1;
  EXPECT_FALSE(memory.look(standing_by));
}

TEST(SpareMemory, OfAServerThatNobodyCameToIsLeftAlone) {
  SpareMemory memory;
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(memory.look(at(i * 1s, 0)));
}

}  // namespace
}  // namespace gatefield::operations
