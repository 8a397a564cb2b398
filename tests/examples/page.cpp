#include "tests/examples/page.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>

namespace gatefield::test {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) {
    std::fprintf(stderr, "%s can't be read\n", file.c_str());
    std::abort();
  }
  return {std::istreambuf_iterator<char>(in), {}};
}

std::map<std::string, std::string> shown_files(const std::filesystem::path& page) {
  std::istringstream in(text_of(page));
  constexpr std::string_view kFence = "```";
  std::map<std::string, std::string> files;
  std::string line;
  std::string name;
  bool inside = false;
  while (std::getline(in, line)) {
    if (line.starts_with(kFence)) {
      inside = !inside;
      name = inside ? line.substr(kFence.size()) : "";
    } else if (inside && name.find('.') != std::string::npos) {
      files[name] += line + '\n';
    }
  }
  return files;
}

void write_files(const std::map<std::string, std::string>& files, const std::filesystem::path& folder) {
  for (const auto& [name, text] : files) {
    std::filesystem::create_directories((folder / name).parent_path());
    std::ofstream(folder / name) << text;
  }
}

}  // namespace gatefield::test
