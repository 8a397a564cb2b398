#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace gatefield::plot {

/// How another program ended.
struct ProgramEnd {
  enum class Kind {
    kExited,    ///< with `code`
    kKilled,    ///< by signal `code`
    kTooLong,   ///< stopped by us at the limit
    kNotFound,  ///< no such program on the PATH
    kFailed,    ///< could not be started; `words` says why
  };
  Kind kind = Kind::kFailed;
  int code = 0;
  std::string words;  ///< what it said on its error output, at most 2000 characters, without its last line end
};

/// Runs a program in a folder and waits for it, without a shell: arguments reach it as they are. Input is empty, output
/// is thrown away. @pre !arguments.empty(); arguments[0] is looked for on the PATH
/// Thread-safe: yes.   Real-time safe: no.
ProgramEnd run_program(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                       std::chrono::milliseconds limit);

}  // namespace gatefield::plot
