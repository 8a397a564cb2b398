#pragma once

#include <filesystem>

#include "common/base/result.h"

namespace gatefield::training {

/// Writes a folder as import_recordings() reads it, from rendered images: `frames` frames (at least 2) of an approach
/// to two gates with a 424 x 240 camera. Shows the format; also what the tests read back. Errors: too few frames;
/// folder or file can't be written. Thread-safe: yes.
Status write_example_recording(const std::filesystem::path& folder, int frames);

}  // namespace gatefield::training
