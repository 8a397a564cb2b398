#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"

/// Where files that people name are found. Thread-safe: yes.   Real-time safe: no.
namespace gatefield::config {

/// The folder with vehicles/, courses/, scenarios/ and profiles/: $GATEFIELD_CONFIG if set, else
/// <program>/../share/gatefield/config of an installed program, else deploy/config of the source tree it was built
/// from. Errors: kUnreadable, with the places that were looked at.
Result<std::filesystem::path> config_folder();

/// Finds what a person means by `name` on a command line or in another file: a path as it stands (relative to `base`
/// when it is relative and exists there, else to the working folder), or the short name of a shipped file: "circle" is
/// <config_folder>/courses/circle.txt for kind "courses".
/// Errors: kUnknownName for a short name, the sentence lists where it looked and which names exist; kUnreadable for a
/// path that is no file.
Result<std::filesystem::path> find_config(const std::string& kind, const std::string& name,
                                          const std::filesystem::path& base = {});

}  // namespace gatefield::config
