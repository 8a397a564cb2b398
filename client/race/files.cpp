#include "client/race/files.h"

#include <unistd.h>

#include <atomic>
#include <cctype>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <system_error>

namespace gatefield::race {

namespace fs = std::filesystem;

Result<std::string> get_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  std::error_code failure;
  if (in && !fs::is_directory(file, failure) && (in.peek() == std::ifstream::traits_type::eof() || text << in.rdbuf()))
    return text.str();
  return Error{file.string() + ": can't be read, expected a file that this user may read"};
}

Status put_file(const fs::path& file, std::string_view content) {
  if (const auto there = get_file(file); there && *there == content) return {};
  static std::atomic<unsigned> count{0};
  std::error_code failure;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), failure);
  fs::path part = file;
  for (const std::string& piece : {host_name(), std::to_string(getpid()), std::to_string(++count)}) {
    part += ".";
    part += piece;
  }
  part += ".part";
  {
    std::ofstream out(part, std::ios::binary);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    out.flush();
    if (!out) {
      fs::remove(part, failure);
      return Error{file.string() +
                   ": can't be written, expected a folder that this user may write to, with room on the disk"};
    }
  }
  fs::rename(part, file, failure);
  if (!failure) return {};
  const std::string why = failure.message();
  fs::remove(part, failure);
  return Error{file.string() + ": can't be put in place (" + why + ")"};
}

std::string hex(std::uint64_t value) {
  char text[20];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

std::string host_name() {
  char name[256] = {};
  gethostname(name, sizeof name - 1);
  std::string out;
  for (const char* c = name; *c != '\0' && *c != '.' && out.size() < 24; ++c)
    out += std::isalnum(static_cast<unsigned char>(*c)) != 0 || *c == '-' || *c == '_' ? *c : '_';
  return out.empty() ? "host" : out;
}

}  // namespace gatefield::race
