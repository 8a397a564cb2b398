#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "common/base/result.h"

/// SHA256SUMS of a model bundle: a line "<hash>  <name>" for each file, as sha256sum writes and checks it. Finds files
/// that were damaged on a disk or on the way, not those that somebody wants to be taken for others.
/// Thread-safe: yes.   Real-time safe: no.
namespace gatefield::model {

inline constexpr const char* kChecksumsFile = "SHA256SUMS";

/// 64 lower-case hexadecimal digits.
Result<std::string> sha256(const std::string& bytes);

/// The content of SHA256SUMS for these files, sorted by name.
/// @param files  content by name
Result<std::string> checksums_text(const std::map<std::string, std::string>& files);

/// Writes it for the manifest.txt and the *.onnx of the folder.
Status write_checksums(const std::filesystem::path& folder);

/// For people: the line for a shell that does the same.
std::string checksums_command(const std::filesystem::path& folder);

/// Holds files against the content of SHA256SUMS. Each has to be listed; what is listed beyond them is not looked at.
/// @param folder  stands in messages, which name the file and the next step
Status check_checksums(const std::filesystem::path& folder, const std::string& text,
                       const std::map<std::string, const std::string*>& files);

}  // namespace gatefield::model
