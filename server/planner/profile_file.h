#pragma once

#include <filesystem>

#include "server/planner/profile.h"

namespace gatefield::planner {

/// Reads and validates one profile (protobuf text format, schema server/planner/profile.proto).
/// The error names file and line, or the field, its value and its range.
Result<Profile> load_profile(const std::filesystem::path& file);

}  // namespace gatefield::planner
