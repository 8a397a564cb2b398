#pragma once

#include <hdf5.h>

#include <mutex>
#include <string>
#include <utility>

/// libhdf5 as this folder uses it: one thread at a time, silent, handles that close themselves. Not for use outside of
/// this folder.
namespace gatefield::training::hdf5 {

/// Closes what an H5*open or H5*create gave.
class Handle {
 public:
  Handle(hid_t id, herr_t (*closer)(hid_t)) : id_(id), close_(closer) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle& operator=(Handle&&) = delete;

  bool ok() const { return id_ >= 0; }
  operator hid_t() const { return id_; }  // NOLINT(google-explicit-constructor): used like the number that it holds
  /// False when closing failed, which is when HDF5 writes.
  bool close() { return close_(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Holds the library for one call of ours (it need not be built thread-safe) and keeps it from printing. Made first
/// thing in every function that calls it.
class Library {
 public:
  Library();

 private:
  std::scoped_lock<std::recursive_mutex> lock_;
};

/// The innermost of the library's errors since this thread's last Library was made; "unknown" without any.
std::string reason();

}  // namespace gatefield::training::hdf5
