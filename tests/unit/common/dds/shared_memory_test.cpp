#include "common/dds/shared_memory.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace gatefield::dds {
namespace {

namespace fs = std::filesystem;

class Segments : public ::testing::Test {
 protected:
  Segments() : folder_(fs::temp_directory_path() / ("gatefield-segments-" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~Segments() override { fs::remove_all(folder_); }
  void put(const std::string& name) { std::ofstream(folder_ / name) << "x"; }
  bool there(const std::string& name) const { return fs::exists(folder_ / name); }

  fs::path folder_;
};

TEST_F(Segments, OfTheDeadAreRemovedAndThoseOfTheLivingStay) {
  const std::string dead = "fastrtps_0123456789abcdef", living = "fastrtps_fedcba9876543210";
  const std::string port = "fastrtps_port7411", heard = "fastrtps_port7413";
  for (const std::string& name : {dead, living, port, heard}) {
    put(name);
    put(name + "_el");
  }
  put("sem." + port + "_mutex");
  const int lock = open((folder_ / (living + "_el")).c_str(), O_RDONLY);
  const int ear = open((folder_ / (heard + "_el")).c_str(), O_RDONLY);
  ASSERT_EQ(flock(lock, LOCK_EX | LOCK_NB), 0);
  ASSERT_EQ(flock(ear, LOCK_SH | LOCK_NB), 0);
  EXPECT_EQ(remove_dead_segments(folder_), 5);
  EXPECT_FALSE(there(dead) || there(dead + "_el") || there(port) || there("sem." + port + "_mutex"));
  EXPECT_TRUE(there(living) && there(living + "_el") && there(heard) && there(heard + "_el"));
  close(lock);
  close(ear);
}

TEST_F(Segments, FilesOfOthersStay) {
  for (const char* name : {"fastrtps_notes", "fastrtps_port", "fastrtps_portx", "sem.other", "fastrtps_0123"})
    put(name);
  EXPECT_EQ(remove_dead_segments(folder_), 0);
}

TEST(SharedMemory, OfAnotherFolderOrUserIsOutOfReach) {
  const SharedMemory shared({});
  eprosima::fastrtps::rtps::Locator_t locator = shared.locator(7411);
  EXPECT_EQ(locator.port, 7411u);
  EXPECT_TRUE(shared.within_reach(locator));
  locator.address[9] ^= 1;
  EXPECT_FALSE(shared.within_reach(locator));
}

}  // namespace
}  // namespace gatefield::dds
