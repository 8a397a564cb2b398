#include "server/operations/process_figures.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "common/base/whole_file.h"

namespace gatefield::operations {
namespace {

std::string proc(const char* file) {
  const auto text = read_file(std::filesystem::path("/proc") / file);
  return text.ok() ? *text : std::string();
}

/// Seconds since 1970 at which the machine was started.
double boot_unix_s() {
  const std::string text = proc("stat");
  const std::size_t at = text.find("\nbtime ");
  return at == std::string::npos ? 0.0 : std::strtod(text.c_str() + at + 7, nullptr);
}

}  // namespace

ProcessFigures process_figures() {
  ProcessFigures figures;
  // Behind the name, which may have blanks and brackets of its own (man 5 proc: fields 3 and up of /proc/[pid]/stat).
  const std::string stat = proc("self/stat");
  std::istringstream words(stat.substr(std::min(stat.size(), stat.rfind(')') + 1)));
  const std::vector<std::string> field{std::istream_iterator<std::string>(words), {}};
  constexpr std::size_t kUserTime = 11, kSystemTime = 12, kThreads = 17, kStart = 19, kVirtual = 20, kResident = 21;
  if (field.size() > kResident) {
    const auto number = [&field](std::size_t index) { return std::strtod(field[index].c_str(), nullptr); };
    const auto ticks_s = static_cast<double>(sysconf(_SC_CLK_TCK));
    figures.cpu_s = (number(kUserTime) + number(kSystemTime)) / ticks_s;
    figures.start_unix_s = boot_unix_s() + number(kStart) / ticks_s;
    figures.threads = static_cast<std::uint64_t>(number(kThreads));
    figures.virtual_bytes = number(kVirtual);
    figures.resident_bytes = number(kResident) * static_cast<double>(sysconf(_SC_PAGESIZE));
  }
  std::error_code failed;
  for (auto entry = std::filesystem::directory_iterator("/proc/self/fd", failed);
       !failed && entry != std::filesystem::directory_iterator(); entry.increment(failed))
    ++figures.open_files;
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) figures.most_files = limit.rlim_cur;
  return figures;
}

}  // namespace gatefield::operations
