#include "common/dds/program_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fastdds/dds/log/Log.hpp>
#include <string>
#include <thread>

#include "common/base/logging.h"
#include "common/dds/library_log.h"

namespace gatefield::dds {
namespace {

using eprosima::fastdds::dds::Log;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// What a program of this log level says while the library complains of `what`.
std::string said(const std::string& level, const std::string& what) {
  ::testing::internal::CaptureStderr();
  log::start("program_log_test", level);
  log_library_lines();
  Log::QueueLog(what, {__FILE__, __LINE__, __func__, "TEST"}, Log::Kind::Error);
  Log::Flush();
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // the next line's turn
  return ::testing::internal::GetCapturedStderr();
}

TEST(ProgramLog, LinesOfTheLibraryFollowTheLogLevel) {
  limit_library_log();
  EXPECT_THAT(said("off", "first"), IsEmpty());
  EXPECT_THAT(said("error", "second"), IsEmpty()) << "they are warnings";
  EXPECT_THAT(said("warn", "third"), HasSubstr("program_log_test warning the DDS library says: third"));
  set_library_log({});
}

}  // namespace
}  // namespace gatefield::dds
