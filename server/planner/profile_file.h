#pragma once

#include <filesystem>

#include "server/planner/profile.h"

namespace gatefield::planner {

/// Reads and validates one profile (protobuf text format, its fields are those of the tables in profile.h).
/// The error names file and line, or the field, its value and its range.
Result<Profile> load_profile(const std::filesystem::path& file);

}  // namespace gatefield::planner
