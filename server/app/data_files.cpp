#include "server/app/data_files.h"

#include <algorithm>
#include <system_error>

#include "common/config/locate.h"
#include "server/planner/profile_file.h"

namespace gatefield::app {
namespace fs = std::filesystem;

std::vector<fs::path> data_folder_candidates(const std::string& name) {
  std::vector<fs::path> candidates;
  if (const auto config = config::config_folder(); config.ok()) candidates.push_back(config->parent_path() / name);
  std::error_code error;
  candidates.push_back(fs::current_path(error) / "deploy" / name);
  return candidates;
}

Result<fs::path> find_data_folder(const std::string& name, const std::string& option) {
  std::string searched;
  for (const fs::path& candidate : data_folder_candidates(name)) {
    std::error_code error;
    if (fs::is_directory(candidate, error)) return candidate;
    searched += (searched.empty() ? "" : ", ") + candidate.string();
  }
  return Error{"no folder " + name + " was found (searched " + searched + "), expected one there or " + option +
               " to say where it is"};
}

Result<std::map<std::string, planner::Profile>> load_profiles(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    return Error{"profiles folder " + folder.string() + " is not there, expected a folder of planner profiles (*.txt)"};
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".txt") files.push_back(entry.path());
  if (error) return Error{"profiles folder " + folder.string() + " could not be read: " + error.message()};
  if (files.empty())
    return Error{"profiles folder " + folder.string() + " has no *.txt in it, expected at least one planner profile"};
  std::sort(files.begin(), files.end());
  std::map<std::string, planner::Profile> profiles;
  std::map<std::string, fs::path> origin;
  for (const fs::path& file : files) {
    auto profile = planner::load_profile(file);
    if (!profile) return profile.failure();
    const std::string name = profile->name;
    if (profiles.count(name) != 0)
      return Error{file.string() + ": name is \"" + name + "\", which " + origin[name].string() +
                   " has already, expected a name of its own for each profile"};
    origin[name] = file;
    profiles.emplace(name, std::move(profile).value());
  }
  return profiles;
}

}  // namespace gatefield::app
