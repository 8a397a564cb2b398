#include "server/training/data/dataset_bytes.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "server/training/data/dataset_schema.h"

namespace gatefield::training {

Error system_error(const std::filesystem::path& file, const std::string& what) {
  return file_error(file, what + ": " + std::strerror(errno));
}

Descriptor::~Descriptor() {
  if (number_ >= 0) ::close(number_);
}

bool write_at(int descriptor, std::uint64_t at, const void* data, std::size_t size) {
  const char* next = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::pwrite(descriptor, next, size, static_cast<off_t>(at));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    next += written;
    at += static_cast<std::uint64_t>(written);
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

bool read_at(int descriptor, std::uint64_t at, void* data, std::size_t size) {
  char* next = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t got = ::pread(descriptor, next, size, static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    next += got;
    at += static_cast<std::uint64_t>(got);
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

Result<std::uint64_t> size_of(const std::filesystem::path& file, int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return system_error(file, "can't be examined");
  return static_cast<std::uint64_t>(status.st_size);
}

}  // namespace gatefield::training
