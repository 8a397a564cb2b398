#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/result.h"

/// Files that are read and written as a whole. Every error is kUnreadable, names the file in its sentence and in
/// Error::file, and says why. Thread-safe: yes, also against other programs.   Real-time safe: no.
namespace gatefield {

/// The content, byte for byte. Pipes and /proc are read to their end.
/// Errors: not there, a folder, not to be read, or larger than `max_bytes`.
Result<std::string> read_file(const std::filesystem::path& file, std::uintmax_t max_bytes = UINTMAX_MAX);

/// How sure a file must be when write_file() returns.
enum class Durability {
  kProgram,  ///< survives the end of this program
  kPower,    ///< survives a power cut: it is on the disk (fsync), and so is its name
};

/// Makes or replaces a file, whole or not at all: nobody ever sees half of it, and an old one stays when writing fails.
/// (The content goes into a file beside it, which is then renamed.) The folder is made when it is not there. A link
/// keeps its place, what it points to is replaced; the new file has the permissions of the old one. What is no file (a
/// pipe, /dev/stdout) is written into. Errors: a folder that this user may not write to, or no room on the disk.
Status write_file(const std::filesystem::path& file, std::string_view content,
                  Durability durability = Durability::kProgram);

}  // namespace gatefield
