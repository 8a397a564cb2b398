#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/dds_domain.h"
#include "tests/support/process.h"

namespace gatefield::test {

inline const std::filesystem::path kPrograms = std::filesystem::path(GATEFIELD_BINARY_DIR) / "bin";
inline const std::filesystem::path kDeploy = std::filesystem::path(GATEFIELD_SOURCE_DIR) / "deploy";

/// A folder of this test's own, emptied before it begins.
inline std::filesystem::path fresh_folder(const std::string& name) {
  auto folder = std::filesystem::temp_directory_path() / ("gatefield-" + name + "-" + std::to_string(getpid()));
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

/// Server and simulators in a DDS domain of this process, with the model that the repository ships.
class Programs {
 public:
  explicit Programs(const std::string& name) : folder_(fresh_folder(name)) {}
  ~Programs() { std::filesystem::remove_all(folder_); }

  std::vector<std::string> server_arguments() const {
    return {"--domain",   domain(),
            "--model",    (kDeploy / "models/race").string(),
            "--profiles", (kDeploy / "config/profiles").string()};
  }
  /// @param extra  added at the end
  Process server(const std::string& log, const std::vector<std::string>& extra = {}) const {
    return Process((kPrograms / "gatefield-server").string(), with(server_arguments(), extra), file(log));
  }
  Process simulator(const std::string& log, const std::vector<std::string>& extra) const {
    return Process((kPrograms / "gatefield-sim").string(), with({"--domain", domain()}, extra), file(log));
  }
  std::filesystem::path file(const std::string& name) const { return folder_ / name; }
  std::string domain() const { return std::to_string(own_domain()); }

 private:
  static std::vector<std::string> with(std::vector<std::string> base, const std::vector<std::string>& extra) {
    base.insert(base.end(), extra.begin(), extra.end());
    return base;
  }
  std::filesystem::path folder_;
};

}  // namespace gatefield::test
