// libFuzzer over the text files that people write: the first letter says which kind the rest is.

#include <sys/mman.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "common/config/course.h"
#include "common/config/frame.h"
#include "common/config/vehicle.h"
#include "common/model/bundle.h"
#include "common/model/checksums.h"
#include "server/planner/profile_file.h"

namespace {

template <typename T>
void expect_words(const gatefield::Result<T>& result) {
  if (result.ok() || (!result.error().empty() && result.error().size() < 20'000)) return;
  std::cerr << "a refusal without or with too many words: " << result.error().size() << '\n';
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gatefield;
  if (size == 0) return 0;
  static const int memory = memfd_create("text", 0);  // a disk would bound the runs
  static const std::filesystem::path file = "/proc/self/fd/" + std::to_string(memory);
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  if (data[0] == 'm') {
    expect_words(model::parse_manifest(text, "manifest.txt"));
    return 0;
  }
  if (data[0] == 's') {
    const auto sums = model::Checksums::parse("folder", text);
    const Status verdict = sums.ok() ? sums->hold("manifest.txt", "what the sums are held against") : sums.failure();
    expect_words(verdict.ok() ? Result<int>(0) : Result<int>(verdict.failure()));
    return 0;
  }
  std::ofstream(file, std::ios::binary | std::ios::trunc) << text;
  switch (data[0]) {
    case 'c':
      expect_words(config::load_track(file));
      break;
    case 'v':
      expect_words(config::load_vehicle(file));
      break;
    case 'p':
      expect_words(planner::load_profile(file));
      break;
    case 'f':
      expect_words(config::load_frame(file));
      break;
    default:
      break;
  }
  return 0;
}
