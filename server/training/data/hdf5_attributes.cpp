#include "server/training/data/hdf5_attributes.h"

#include <utility>

#include "server/training/data/dataset_schema.h"
#include "server/training/data/hdf5_library.h"

namespace gatefield::training::hdf5 {
namespace {

bool write_number(hid_t object, const char* name, hid_t stored, hid_t native, const void* value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, stored, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.ok() && H5Awrite(attribute, native, value) >= 0;
}

struct Attribute {
  Handle attribute;
  Handle type;
  H5T_class_t kind;
};

Result<Attribute> find_attribute(const std::filesystem::path& file, hid_t object, const std::string& label,
                                 const char* name, const char* expected) {
  if (H5Aexists(object, name) <= 0)
    return file_error(file, "attribute " + label + name + " is missing, expected " + expected);
  Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const Handle space(attribute.ok() ? H5Aget_space(attribute) : -1, H5Sclose);
  if (!space.ok() || H5Sget_simple_extent_npoints(space) != 1)
    return file_error(file, "attribute " + label + name + " is no single value, expected " + expected);
  Handle type(H5Aget_type(attribute), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type);
  return Attribute{std::move(attribute), std::move(type), kind};
}

}  // namespace

bool write_u64(hid_t object, const char* name, std::uint64_t value) {
  return write_number(object, name, H5T_STD_U64LE, H5T_NATIVE_UINT64, &value);
}
bool write_i32(hid_t object, const char* name, std::int32_t value) {
  return write_number(object, name, H5T_STD_I32LE, H5T_NATIVE_INT32, &value);
}
bool write_f64(hid_t object, const char* name, double value) {
  return write_number(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value);
}

bool write_text(hid_t object, const char* name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const char* text = value.c_str();
  return attribute.ok() && H5Awrite(attribute, type, &text) >= 0;
}

Result<std::uint64_t> read_whole(const std::filesystem::path& file, hid_t object, const char* name) {
  const auto found = find_attribute(file, object, "", name, "a whole number");
  if (!found) return found.failure();
  std::uint64_t value = 0;
  if (found->kind != H5T_INTEGER || H5Aread(found->attribute, H5T_NATIVE_UINT64, &value) < 0)
    return file_error(file, std::string("attribute ") + name + " can't be read as a whole number");
  return value;
}

Result<double> read_number(const std::filesystem::path& file, hid_t object, const std::string& label,
                           const char* name) {
  const auto found = find_attribute(file, object, label, name, "a number");
  if (!found) return found.failure();
  double value = 0.0;
  if ((found->kind != H5T_INTEGER && found->kind != H5T_FLOAT) ||
      H5Aread(found->attribute, H5T_NATIVE_DOUBLE, &value) < 0)
    return file_error(file, "attribute " + label + name + " can't be read as a number");
  return value;
}

Result<std::string> read_text(const std::filesystem::path& file, hid_t object, const char* name) {
  constexpr std::size_t kLongest = 1 << 20;
  const auto found = find_attribute(file, object, "", name, "a text");
  if (!found) return found.failure();
  const Error unreadable = file_error(file, std::string("attribute ") + name + " can't be read as a text");
  if (found->kind != H5T_STRING) return unreadable;
  if (H5Tis_variable_str(found->type) > 0) {
    char* text = nullptr;
    const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, H5Tget_cset(found->type));
    if (H5Aread(found->attribute, type, &text) < 0) return unreadable;
    std::string value = text != nullptr ? text : "";
    H5free_memory(text);
    return value;
  }
  const std::size_t size = H5Tget_size(found->type);
  if (size > kLongest) return unreadable;
  std::string value(size, '\0');
  if (H5Aread(found->attribute, found->type, value.data()) < 0) return unreadable;
  return value.substr(0, value.find('\0'));
}

}  // namespace gatefield::training::hdf5
