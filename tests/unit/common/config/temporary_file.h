#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace gatefield::config {

/// A text file that goes away with the object.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text, const std::string& name = "file.txt")
      : folder_(std::filesystem::temp_directory_path() /
                ("gatefield-test-" + std::to_string(getpid()) + "-" + std::to_string(next()))) {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / name) << text;
    path_ = folder_ / name;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  const std::filesystem::path& path() const { return path_; }

 private:
  static int next() {
    static int count = 0;
    return count++;
  }
  std::filesystem::path folder_;
  std::filesystem::path path_;
};

inline std::string read_all(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// `text` with the first `from` replaced by `to`; an empty string when it isn't there, so that a test notices.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  return at == std::string::npos ? std::string() : text.replace(at, from.size(), to);
}

}  // namespace gatefield::config
