#include "client/race/files.h"

#include <unistd.h>

#include <cctype>

namespace gatefield::race {

namespace fs = std::filesystem;

Status put_file(const fs::path& file, std::string_view content) {
  if (const auto there = read_file(file); there && *there == content) return {};
  return write_file(file, content);
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
