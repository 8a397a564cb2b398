#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/planner/profile.h"

namespace gatefield::app {

/// Where the program looks for a data folder when nothing is said, in this order: beside the configuration folder
/// (config::config_folder(): <prefix>/share/gatefield of an installed program, deploy of the sources), and in ./deploy.
/// @param name  for example "models/race"
std::vector<std::filesystem::path> data_folder_candidates(const std::string& name);

/// The first candidate that exists. The error lists them all, and names the option that says where instead.
Result<std::filesystem::path> find_data_folder(const std::string& name, const std::string& option);

/// Every *.txt of the folder as a planner profile, by name. The error names the file, or the two that share a name.
Result<std::map<std::string, planner::Profile>> load_profiles(const std::filesystem::path& folder);

}  // namespace gatefield::app
