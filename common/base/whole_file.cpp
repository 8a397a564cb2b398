#include "common/base/whole_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>

namespace gatefield {
namespace {

namespace fs = std::filesystem;

Error wrong(const fs::path& file, const std::string& sentence) {
  return Error{sentence, ErrorCode::kUnreadable}.at(file.string());
}

std::string because(int code) { return std::string(" (") + std::strerror(code) + ")"; }

/// 0, or errno.
int write_all(int descriptor, std::string_view content) noexcept {
  while (!content.empty()) {
    const ssize_t wrote = ::write(descriptor, content.data(), content.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return errno;
    content.remove_prefix(static_cast<std::size_t>(wrote));
  }
  return 0;
}

/// Closes in every case. 0, or errno.
int write_and_close(int descriptor, std::string_view content, bool to_disk) noexcept {
  int failed = write_all(descriptor, content);
  if (failed == 0 && to_disk && ::fsync(descriptor) != 0 && errno != EINVAL && errno != EROFS) failed = errno;
  if (::close(descriptor) != 0 && failed == 0) failed = errno;
  return failed;
}

/// Makes a new file beside `target` that nobody else has; its descriptor, or -1 with errno.
int make_beside(const fs::path& target, mode_t mode, fs::path* part) {
  for (int attempt = 0; attempt < 100; ++attempt) {
    const auto now = static_cast<unsigned long long>(std::chrono::steady_clock::now().time_since_epoch().count());
    *part = target;
    for (const std::string& piece : {std::to_string(::getpid()), std::to_string(now + static_cast<unsigned>(attempt))})
      (*part += ".") += piece;
    *part += ".part";
    const int descriptor = ::open(part->c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    if (descriptor >= 0 || errno != EEXIST) return descriptor;
  }
  return -1;
}

void sync_folder(const fs::path& folder) noexcept {
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);  // not every file system can; the content itself was put on the disk
  ::close(descriptor);
}

}  // namespace

Result<std::string> read_file(const fs::path& file, std::uintmax_t max_bytes) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0)
    return wrong(file, "can't be read" + because(errno) + ", expected a file that this user may read");
  std::string content;
  struct stat about {};
  if (::fstat(descriptor, &about) == 0 && S_ISREG(about.st_mode))
    content.reserve(
        static_cast<std::size_t>(std::min<std::uintmax_t>(static_cast<std::uintmax_t>(about.st_size), max_bytes)));
  int failed = 0;
  char block[1 << 16];
  while (content.size() <= max_bytes) {
    const ssize_t got = ::read(descriptor, block, sizeof block);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) failed = errno;
    if (got <= 0) break;
    content.append(block, static_cast<std::size_t>(got));
  }
  ::close(descriptor);
  if (failed != 0) return wrong(file, "can't be read" + because(failed) + ", expected a file that this user may read");
  if (content.size() > max_bytes)
    return wrong(file, "is larger than " + std::to_string(max_bytes) + " bytes, expected a smaller file");
  return content;
}

Status write_file(const fs::path& file, std::string_view content, Durability durability) {
  const auto refused = [&](int code) {
    return wrong(file, "can't be written" + because(code) +
                           ", expected a folder that this user may write to, with room on the disk");
  };
  std::error_code failure;
  fs::path target = file;
  mode_t mode = 0666;
  struct stat there {};
  if (::stat(file.c_str(), &there) == 0) {
    if (S_ISDIR(there.st_mode)) return refused(EISDIR);
    if (!S_ISREG(there.st_mode)) {
      const int descriptor = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
      const int failed = descriptor < 0 ? errno : write_and_close(descriptor, content, false);
      return failed == 0 ? Status() : Status(refused(failed));
    }
    mode = there.st_mode & 07777;
    target = fs::canonical(file, failure);
    if (failure) return refused(failure.value());
  } else if (file.has_parent_path()) {
    fs::create_directories(file.parent_path(), failure);  // where it fails, the next line says why
  }
  const bool to_disk = durability == Durability::kPower;
  fs::path part;
  const int descriptor = make_beside(target, mode, &part);
  if (descriptor < 0) return refused(errno);
  if (mode != 0666) ::fchmod(descriptor, mode);  // against our umask; where it fails the narrower mode stays
  if (const int failed = write_and_close(descriptor, content, to_disk); failed != 0) {
    fs::remove(part, failure);
    return refused(failed);
  }
  if (::rename(part.c_str(), target.c_str()) != 0) {
    const int failed = errno;
    fs::remove(part, failure);
    return refused(failed);
  }
  if (to_disk) sync_folder(target.parent_path());
  return {};
}

}  // namespace gatefield
