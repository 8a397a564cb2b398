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

/// Writes it for the manifest.txt and the *.onnx* (networks, their weights and test vectors) of the folder.
Status write_checksums(const std::filesystem::path& folder);

/// For people: the line for a shell that does the same.
std::string checksums_command(const std::filesystem::path& folder);

/// The content of SHA256SUMS, to hold files against. What is listed beyond them is not looked at.
class Checksums {
 public:
  /// @param folder  stands in messages, which name the file and the next step
  static Result<Checksums> parse(const std::filesystem::path& folder, const std::string& text);
  /// Errors: a file that isn't listed, or has changed.
  Status hold(const std::string& name, const std::string& bytes) const;

 private:
  std::filesystem::path folder_;
  std::map<std::string, std::string> listed_;  // hash by name
};

}  // namespace gatefield::model
