#include "common/base/whole_file.h"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <thread>
#include <vector>

namespace gatefield {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

class WholeFile : public testing::Test {
 protected:
  WholeFile() { fs::create_directories(folder_); }
  ~WholeFile() override { fs::remove_all(folder_); }

  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  const fs::path folder_ = fs::temp_directory_path() / ("gatefield-whole-file-" + std::to_string(::getpid()));
  const fs::path file_ = folder_ / "file";
};

TEST_F(WholeFile, GivesBackWhatWasWritten) {
  const std::string content("a\0b\r\n\xff", 6);
  for (const Durability durability : {Durability::kProgram, Durability::kPower}) {
    ASSERT_TRUE(write_file(file_, content, durability).ok());
    EXPECT_EQ(read_file(file_).value(), content);
  }
  ASSERT_TRUE(write_file(file_, "").ok());
  EXPECT_EQ(read_file(file_).value(), "");
  EXPECT_EQ(entries(), 1u) << "nothing is left beside it";
}

TEST_F(WholeFile, AFileWithoutASizeIsReadToItsEnd) {
  EXPECT_THAT(read_file("/proc/self/status").value(), HasSubstr("Pid:"));
}

TEST_F(WholeFile, SaysWhyItCantBeRead) {
  for (const fs::path& bad : {folder_ / "nothing", folder_}) {
    const auto content = read_file(bad);
    ASSERT_FALSE(content.ok());
    EXPECT_THAT(content.error(), StartsWith(bad.string() + ": can't be read ("));
    EXPECT_EQ(content.failure().code, ErrorCode::kUnreadable);
    EXPECT_EQ(content.failure().file, bad.string());
  }
}

TEST_F(WholeFile, ALargerOneThanAskedForIsRefused) {
  ASSERT_TRUE(write_file(file_, "12345").ok());
  EXPECT_TRUE(read_file(file_, 5).ok());
  EXPECT_THAT(read_file(file_, 4).error(), HasSubstr("larger than 4 bytes"));
}

TEST_F(WholeFile, SaysWhyItCantBeWrittenAndLeavesNothing) {
  ASSERT_TRUE(write_file(file_, "a file is no folder").ok());
  for (const fs::path& bad : {file_ / "file", folder_}) {
    const Status status = write_file(bad, "x");
    ASSERT_FALSE(status.ok());
    EXPECT_THAT(status.error(), StartsWith(bad.string() + ": can't be written ("));
    EXPECT_EQ(status.failure().code, ErrorCode::kUnreadable);
  }
  EXPECT_EQ(entries(), 1u);
}

TEST_F(WholeFile, TheFolderIsMade) {
  ASSERT_TRUE(write_file(folder_ / "a" / "b" / "file", "x").ok());
  EXPECT_EQ(read_file(folder_ / "a" / "b" / "file").value(), "x");
}

TEST_F(WholeFile, ALinkStaysAndPermissionsStay) {
  ASSERT_TRUE(write_file(file_, "old").ok());
  ::chmod(file_.c_str(), 0640);
  fs::create_symlink(file_, folder_ / "link");
  ASSERT_TRUE(write_file(folder_ / "link", "new").ok());
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(read_file(file_).value(), "new");
  EXPECT_EQ(fs::status(file_).permissions(), fs::perms(0640));
}

TEST_F(WholeFile, ADeviceIsWrittenIntoAndStaysOne) {
  ASSERT_TRUE(write_file("/dev/null", "x").ok());
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(WholeFile, ReadersNeverSeeHalfOfIt) {
  ASSERT_TRUE(write_file(file_, std::string(100'000, 'a')).ok());
  std::atomic<bool> done{false};
  std::vector<std::thread> writers;
  for (const char c : {'a', 'b', 'c'})
    writers.emplace_back([&, c] {
      for (int i = 0; i < 50; ++i) EXPECT_TRUE(write_file(file_, std::string(100'000, c)).ok());
    });
  std::thread reader([&] {
    while (!done) {
      const auto content = read_file(file_);
      ASSERT_TRUE(content.ok()) << content.error();
      ASSERT_EQ(*content, std::string(100'000, content->front()));
    }
  });
  for (std::thread& writer : writers) writer.join();
  done = true;
  reader.join();
  EXPECT_EQ(entries(), 1u);
}

}  // namespace
}  // namespace gatefield
