#include "server/operations/process_figures.h"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <thread>
#include <vector>

namespace gatefield::operations {
namespace {

TEST(ProcessFigures, AreOfThisProcess) {
  const ProcessFigures figures = process_figures();
  EXPECT_GT(figures.resident_bytes, 1e6);
  EXPECT_GT(figures.virtual_bytes, figures.resident_bytes);
  EXPECT_GE(figures.threads, 1u);
  EXPECT_GE(figures.open_files, 3u);
  EXPECT_GT(figures.most_files, figures.open_files);
  const double now_s = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  EXPECT_LE(figures.start_unix_s, now_s + 2.0);
  EXPECT_GE(figures.start_unix_s, now_s - 3600.0);
}

TEST(ProcessFigures, CountWhatIsTaken) {
  const ProcessFigures before = process_figures();
  std::vector<char> memory(64 << 20, 1);
  std::ifstream file("/proc/self/maps");
  std::mutex mutex;
  std::unique_lock held(mutex);
  std::thread thread([&] { const std::lock_guard lock(mutex); });
  const ProcessFigures after = process_figures();
  held.unlock();
  thread.join();
  EXPECT_GT(after.resident_bytes - before.resident_bytes, 60 << 20) << memory.back();
  EXPECT_EQ(after.open_files, before.open_files + 1);
  EXPECT_EQ(after.threads, before.threads + 1);
  EXPECT_GE(after.cpu_s, before.cpu_s);
}

}  // namespace
}  // namespace gatefield::operations
