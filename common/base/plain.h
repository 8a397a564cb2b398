#pragma once

#include <Eigen/Geometry>

/// Eigen's types for members of structs that cross a library's boundary.
///
/// Eigen aligns Vector4d, Quaterniond and the like as the widest vector unit wants that the code is compiled for: 16
/// bytes for plain x86-64, 32 with -mavx. A struct that holds one then differs between a library and a user of other
/// flags, without an error. These lie like arrays of double, whatever the flags; they convert from and to the aligned
/// types, and the arithmetic is the same. Vector3d and Matrix3d have no alignment of their own and need nothing.
namespace gatefield {

using PlainVector2 = Eigen::Matrix<double, 2, 1, Eigen::DontAlign>;
using PlainVector4 = Eigen::Matrix<double, 4, 1, Eigen::DontAlign>;
using PlainQuaternion = Eigen::Quaternion<double, Eigen::DontAlign>;
using PlainIsometry = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;

static_assert(sizeof(PlainVector4) == 4 * sizeof(double) && alignof(PlainVector4) == alignof(double));
static_assert(sizeof(PlainQuaternion) == 4 * sizeof(double) && alignof(PlainQuaternion) == alignof(double));
static_assert(sizeof(PlainIsometry) == 16 * sizeof(double) && alignof(PlainIsometry) == alignof(double));

}  // namespace gatefield
