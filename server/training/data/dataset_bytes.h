#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "common/base/result.h"

/// Bytes at places of a file, past libhdf5. Not for use outside of this folder. Thread-safe: yes, on different places.
namespace gatefield::training {

/// "data set <file>: <what>: <errno in words>"
Error system_error(const std::filesystem::path& file, const std::string& what);

/// Closes what open() gave.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  int number() const { return number_; }
  bool ok() const { return number_ >= 0; }

 private:
  int number_;
};

/// Writes all of it, whatever interrupts. @return false with errno
bool write_at(int descriptor, std::uint64_t at, const void* data, std::size_t size);
/// Reads all of it; false as well when the file is too short.
bool read_at(int descriptor, std::uint64_t at, void* data, std::size_t size);
/// Bytes of the open file.
Result<std::uint64_t> size_of(const std::filesystem::path& file, int descriptor);

}  // namespace gatefield::training
