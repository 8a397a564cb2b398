#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace gatefield::test {

/// The files that a page shows: of each block whose fence names a file (```my/hall.txt), name and text. A page's examples are
/// tested as a reader would copy them.
/// Aborts the test program when the page can't be read.
std::map<std::string, std::string> shown_files(const std::filesystem::path& page);

/// Writes them below `folder`, each under its name.
void write_files(const std::map<std::string, std::string>& files, const std::filesystem::path& folder);

}  // namespace gatefield::test
