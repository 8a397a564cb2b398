#include "common/config/locate.h"

#include <algorithm>
#include <cstdlib>
#include <system_error>
#include <vector>

namespace gatefield::config {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code failure;
  return fs::exists(path, failure) && !fs::is_directory(path, failure);
}

std::string shipped_names(const fs::path& folder) {
  std::error_code failure;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder, failure))
    if (entry.path().extension() == ".txt") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  std::string list;
  for (const auto& name : names) list += (list.empty() ? "" : ", ") + name;
  return list.empty() ? "none" : list;
}

}  // namespace

Result<fs::path> config_folder() {
  std::error_code failure;
  if (const char* set = std::getenv("GATEFIELD_CONFIG"); set != nullptr && *set != '\0') {
    if (fs::is_directory(set, failure)) return fs::path(set);
    return Error{"GATEFIELD_CONFIG is '" + std::string(set) +
                     "', expected an existing folder with vehicles, courses, scenarios and profiles",
                 ErrorCode::kUnreadable};
  }
  const fs::path program = fs::read_symlink("/proc/self/exe", failure);
  const fs::path installed = program.parent_path().parent_path() / "share/gatefield/config";
  if (fs::is_directory(installed, failure)) return installed;
  const fs::path source = GATEFIELD_SOURCE_CONFIG_FOLDER;
  if (fs::is_directory(source, failure)) return source;
  return Error{"no configuration folder: looked at " + installed.string() + " and " + source.string() +
                   ", expected one of them or GATEFIELD_CONFIG to name it",
               ErrorCode::kUnreadable};
}

Result<fs::path> find_config(const std::string& kind, const std::string& name, const fs::path& base) {
  if (name.empty())
    return Error{"an empty name for one of the " + kind + ", expected a file or a short name", ErrorCode::kUnknownName};
  const fs::path given(name);
  if (given.is_relative() && !base.empty() && is_file(base / given)) return (base / given).lexically_normal();
  if (is_file(given)) return given;
  const bool short_name = given.filename() == given && given.extension() != ".txt";
  std::error_code failure;
  const bool folder_there = fs::is_directory(given, failure);
  const auto is_folder = [&] { return Error{"is a folder, expected a text file", ErrorCode::kUnreadable}.at(name); };
  if (!short_name && folder_there) return is_folder();
  if (!short_name) return Error{"does not exist, expected a text file", ErrorCode::kUnreadable}.at(name);
  const auto folder = config_folder();
  if (!folder) return folder.failure();
  // A folder of that name is no reason to miss what ships: results are often called as the campaign is.
  const fs::path shipped = *folder / kind / (name + ".txt");
  if (is_file(shipped)) return shipped;
  if (folder_there) return is_folder();
  return Error{"'" + name + "' is neither a file nor one of the " + kind + " in " + (*folder / kind).string() +
                   ", expected a path or one of: " + shipped_names(*folder / kind),
               ErrorCode::kUnknownName};
}

}  // namespace gatefield::config
