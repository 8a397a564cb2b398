#pragma once

#include <hdf5.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/base/result.h"

/// Attributes of a data set's file: single values with a name. The caller holds the library (hdf5_library.h). Not for
/// use outside of this folder.
namespace gatefield::training::hdf5 {

// Make an attribute of an open object; false with reason().
bool write_u64(hid_t object, const char* name, std::uint64_t value);
bool write_i32(hid_t object, const char* name, std::int32_t value);
bool write_f64(hid_t object, const char* name, double value);
/// Of variable length, which h5py gives back as str.
bool write_text(hid_t object, const char* name, const std::string& value);

// Read one, converted from whatever number or text it is stored as.
// Errors: missing, no single value or of another kind, with the name and what was expected.
Result<std::uint64_t> read_whole(const std::filesystem::path& file, hid_t object, const char* name);
/// @param label  stands before the name in messages: "/camera."
Result<double> read_number(const std::filesystem::path& file, hid_t object, const std::string& label, const char* name);
Result<std::string> read_text(const std::filesystem::path& file, hid_t object, const char* name);

}  // namespace gatefield::training::hdf5
