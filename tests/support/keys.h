#pragma once

#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/process.h"

namespace gatefield::test {

/// Authorities and participants that deploy/gatefield-keys makes, in a folder of this process's own that goes with it.
class Keys {
 public:
  explicit Keys(const std::string& name)
      : folder_(std::filesystem::temp_directory_path() / ("gatefield-keys-" + name + "-" + std::to_string(getpid()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    must({"init"});
  }
  ~Keys() { std::filesystem::remove_all(folder_); }
  Keys(const Keys&) = delete;
  Keys& operator=(const Keys&) = delete;

  /// Runs it with these words. @return exit code and what it said
  std::pair<int, std::string> run(std::vector<std::string> words) const {
    words.insert(words.begin(), {"--keys", folder_.string()});
    Process process(std::string(GATEFIELD_SOURCE_DIR) + "/deploy/gatefield-keys", words, folder_ / "said");
    const auto code = process.wait(std::chrono::seconds(60));
    return {code.value_or(-1), process.output()};
  }
  void must(const std::vector<std::string>& words) const {
    if (const auto [code, said] = run(words); code != 0) throw std::runtime_error("gatefield-keys: " + said);
  }
  /// Makes one where it is not there yet. @return its folder, for --security
  std::string make(const std::string& role, const std::string& name) const {
    must({role, name});
    return (folder_ / (role + "s") / name).string();
  }
  std::filesystem::path authority() const { return folder_ / "authority"; }
  std::filesystem::path folder() const { return folder_; }

 private:
  const std::filesystem::path folder_;
};

}  // namespace gatefield::test
