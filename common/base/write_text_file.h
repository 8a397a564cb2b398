#pragma once

#include <filesystem>
#include <fstream>
#include <string_view>

#include "common/base/result.h"

namespace gatefield {

/// Makes or replaces the file. Errors: its name, when not all of the text could be written.
inline Status write_text_file(const std::filesystem::path& file, std::string_view text) {
  std::ofstream out(file, std::ios::trunc | std::ios::binary);
  out << text;
  out.close();
  if (!out) return Error{file.string() + " can't be written, expected a folder that this user may write to"};
  return {};
}

}  // namespace gatefield
