#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/base/whole_file.h"

namespace gatefield::race {

/// As write_file(), and leaves alone what is there with the same content. Several programs may put the same file at
/// once.
Status put_file(const std::filesystem::path& file, std::string_view content);

/// 64-bit FNV-1a, to tell contents apart (no protection against malice).
class Fingerprint {
 public:
  void add(const void* data, std::size_t size) noexcept {
    for (std::size_t i = 0; i < size; ++i)
      value_ = (value_ ^ static_cast<const unsigned char*>(data)[i]) * 0x100000001b3ull;
  }
  void add(std::string_view text) noexcept {
    add(text.data(), text.size());
    const std::uint64_t size = text.size();  // so that "a", "bc" is not "ab", "c"
    add(&size, sizeof size);
  }
  std::uint64_t value() const noexcept { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ull;
};

/// Short name of this machine, of [A-Za-z0-9_-].
std::string host_name();

}  // namespace gatefield::race
