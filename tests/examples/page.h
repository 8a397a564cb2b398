#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace gatefield::test {

/// A file's text. Aborts the test program when it can't be read.
std::string text_of(const std::filesystem::path& file);

/// The files that a page shows: of each block whose fence names a file (```my/hall.txt), name and text. A page's examples
/// are tested as a reader would copy them. Errors: as text_of().
std::map<std::string, std::string> shown_files(const std::filesystem::path& page);

/// Writes them below `folder`, each under its name.
void write_files(const std::map<std::string, std::string>& files, const std::filesystem::path& folder);

}  // namespace gatefield::test
