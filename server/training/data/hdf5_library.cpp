#include "server/training/data/hdf5_library.h"

namespace gatefield::training::hdf5 {
namespace {

std::recursive_mutex& library() {
  static std::recursive_mutex mutex;
  return mutex;
}

std::string& last_error() {
  thread_local std::string text;
  return text;
}

/// Called by the library when a call fails; kept at once, since the next successful call forgets it.
herr_t keep_error(hid_t stack, void* /*unused*/) {
  return H5Ewalk2(
      stack, H5E_WALK_UPWARD,
      [](unsigned n, const H5E_error2_t* error, void* /*unused*/) -> herr_t {
        if (n == 0 && error->desc != nullptr) last_error() = error->desc;
        return 0;
      },
      nullptr);
}

}  // namespace

Library::Library() : lock_(library()) {
  last_error().clear();
  H5Eset_auto2(H5E_DEFAULT, keep_error, nullptr);
}

std::string reason() { return last_error().empty() ? "unknown" : last_error(); }

}  // namespace gatefield::training::hdf5
