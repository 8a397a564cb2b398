#pragma once

#include <filesystem>
#include <string>

#include "server/planner/profile.h"

namespace gatefield::planner {

/// Reads and validates one profile (protobuf text format, its fields are those of the tables in profile.h).
/// The error names file and line, or the field, its value and its range.
Result<Profile> load_profile(const std::filesystem::path& file);

/// The profile as such a file, with every field in a line of its own and the range of a number behind it:
///   temperature: 0.1  # 1e-06 to 1000000
/// (an array's field stands there once for each entry). Programs that know no profiles read these lines
/// (client/race/tune/profile_sheet.h). load_profile() of it gives the same profile, bit by bit.
std::string to_text(const Profile& profile);

}  // namespace gatefield::planner
