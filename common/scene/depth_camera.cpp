#include "common/scene/depth_camera.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

namespace gatefield::scene {
namespace {

constexpr std::size_t kFaces = 6;

/// One device for the whole process: making one takes longer than building a world. Never released, as worlds may
/// outlive any owner.
RTCDevice device() {
  static const RTCDevice shared = [] {
    // One thread: worlds are small, and callers who want more cores build several worlds side by side.
    const RTCDevice made = rtcNewDevice("threads=1,set_affinity=0");
    if (made == nullptr) {
      std::fprintf(stderr, "depth camera: Embree gives no device (error %d)\n",
                   static_cast<int>(rtcGetDeviceError(nullptr)));
      std::abort();
    }
    return made;
  }();
  return shared;
}

struct Surface {
  Eigen::Vector3f normal_W;
  Reflectance reflectance;
};

/// Writes a box as six quads, four corners each, and says how each face stands.
void append_quads(const Box& box, float* vertices, std::uint32_t* indices, std::uint32_t first_vertex,
                  Surface* surfaces) {
  const Eigen::Matrix3d axes = box.X_WO.linear();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p_O((corner & 1) != 0 ? box.half_m.x() : -box.half_m.x(),
                              (corner & 2) != 0 ? box.half_m.y() : -box.half_m.y(),
                              (corner & 4) != 0 ? box.half_m.z() : -box.half_m.z());
    const Eigen::Vector3d p_W = box.X_WO * p_O;
    for (int axis = 0; axis < 3; ++axis) vertices[3 * corner + axis] = static_cast<float>(p_W[axis]);
  }
  static constexpr std::uint32_t kCorners[kFaces][4] = {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                                        {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}};
  for (std::size_t face = 0; face < kFaces; ++face) {
    for (std::size_t k = 0; k < 4; ++k) indices[4 * face + k] = first_vertex + kCorners[face][k];
    surfaces[face] = {axes.col(static_cast<Eigen::Index>(face / 2)).cast<float>(), box.reflectance};
  }
}

template <int N>
struct Packet;
template <>
struct Packet<16> {
  using RayHit = RTCRayHit16;
  static void intersect(const int* valid, RTCScene scene, RTCIntersectContext* context, RayHit* rays) {
    rtcIntersect16(valid, scene, context, rays);
  }
};
template <>
struct Packet<8> {
  using RayHit = RTCRayHit8;
  static void intersect(const int* valid, RTCScene scene, RTCIntersectContext* context, RayHit* rays) {
    rtcIntersect8(valid, scene, context, rays);
  }
};
template <>
struct Packet<4> {
  using RayHit = RTCRayHit4;
  static void intersect(const int* valid, RTCScene scene, RTCIntersectContext* context, RayHit* rays) {
    rtcIntersect4(valid, scene, context, rays);
  }
};

}  // namespace

struct DepthCamera::Scene {
  RTCScene scene = nullptr;
  std::vector<Surface> surfaces;  ///< by primitive
  bool has_floor = false;
  float floor_z_m = 0.0f;
  Reflectance floor_reflectance = 0.0f;

  Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  ~Scene() {
    if (scene != nullptr) rtcReleaseScene(scene);
  }

  /// Rays go in tiles of kTileWidth x kTileHeight neighbours. Their direction has z = 1 in the camera frame, so that
  /// the hit's ray parameter is the z-depth itself. The floor is a plane without end: it is intersected here and
  /// shortens the ray.
  template <int N>
  void render(const CameraModel& camera, const Eigen::Isometry3d& X_WC, DepthImage* image, SurfaceImage* surface,
              FaceImage* faces) const {
    constexpr int kTileWidth = 4;
    constexpr int kTileHeight = N / kTileWidth;
    const Eigen::Matrix3f R_WC = X_WC.linear().cast<float>();
    const Eigen::Vector3f p_WC = X_WC.translation().cast<float>();
    const auto min_m = static_cast<float>(camera.min_depth_m);
    const auto max_m = static_cast<float>(camera.max_depth_m);
    const float floor_below_m = p_WC.z() - floor_z_m;

    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;

    alignas(64) typename Packet<N>::RayHit packet;
    alignas(64) int valid[N];
    float* const depth_m = image->depth_m.data();
    for (int v0 = 0; v0 < camera.height_px; v0 += kTileHeight) {
      for (int u0 = 0; u0 < camera.width_px; u0 += kTileWidth) {
        float floor_m[N];
        for (int lane = 0; lane < N; ++lane) {
          const int u = u0 + lane % kTileWidth;
          const int v = v0 + lane / kTileWidth;
          valid[lane] = u < camera.width_px && v < camera.height_px ? -1 : 0;
          const float x = static_cast<float>((u + 0.5 - camera.cx_px) / camera.fx_px);
          const float y = static_cast<float>((v + 0.5 - camera.cy_px) / camera.fy_px);
          const float dir_x = R_WC(0, 0) * x + R_WC(0, 1) * y + R_WC(0, 2);
          const float dir_y = R_WC(1, 0) * x + R_WC(1, 1) * y + R_WC(1, 2);
          const float dir_z = R_WC(2, 0) * x + R_WC(2, 1) * y + R_WC(2, 2);
          packet.ray.org_x[lane] = p_WC.x();
          packet.ray.org_y[lane] = p_WC.y();
          packet.ray.org_z[lane] = p_WC.z();
          packet.ray.dir_x[lane] = dir_x;
          packet.ray.dir_y[lane] = dir_y;
          packet.ray.dir_z[lane] = dir_z;
          const float to_floor_m = -floor_below_m / dir_z;
          floor_m[lane] = has_floor && to_floor_m > 0 ? to_floor_m : std::numeric_limits<float>::infinity();
          packet.ray.tnear[lane] = 0.0f;
          // A little beyond the range, so that 'farther than the limit' is decided on the hit itself.
          packet.ray.tfar[lane] = std::min(floor_m[lane], max_m * 1.001f);
          packet.ray.time[lane] = 0.0f;
          packet.ray.mask[lane] = ~0u;
          packet.ray.id[lane] = 0;
          packet.ray.flags[lane] = 0;
          packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
          packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
        }
        Packet<N>::intersect(valid, scene, &context, &packet);

        for (int lane = 0; lane < N; ++lane) {
          if (valid[lane] == 0) continue;
          const auto pixel =
              static_cast<std::size_t>(v0 + lane / kTileWidth) * static_cast<std::size_t>(camera.width_px) +
              static_cast<std::size_t>(u0 + lane % kTileWidth);
          const bool hit = packet.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
          const float z_m = hit ? packet.ray.tfar[lane] : floor_m[lane];
          const bool in_range = z_m >= min_m && z_m <= max_m;
          depth_m[pixel] = in_range ? z_m : 0.0f;
          if (faces != nullptr) {
            faces->face[pixel] = !in_range ? FaceImage::kNoFace
                                 : hit     ? static_cast<std::int32_t>(packet.hit.primID[lane])
                                           : FaceImage::kFloorFace;
          }
          if (surface == nullptr) continue;
          if (!in_range) {
            surface->cos_incidence[pixel] = 0.0f;
            surface->reflectance[pixel] = 0.0f;
            continue;
          }
          const float dir_x = packet.ray.dir_x[lane];
          const float dir_y = packet.ray.dir_y[lane];
          const float dir_z = packet.ray.dir_z[lane];
          const float length = std::sqrt(dir_x * dir_x + dir_y * dir_y + dir_z * dir_z);
          float along_normal = dir_z;
          float reflectance = floor_reflectance;
          if (hit) {
            const Surface& face = surfaces[packet.hit.primID[lane]];
            along_normal = dir_x * face.normal_W.x() + dir_y * face.normal_W.y() + dir_z * face.normal_W.z();
            reflectance = face.reflectance;
          }
          surface->cos_incidence[pixel] = std::min(std::abs(along_normal) / length, 1.0f);
          surface->reflectance[pixel] = reflectance;
        }
      }
    }
  }
};

DepthCamera::DepthCamera(const World& world) : scene_(std::make_unique<Scene>()) {
  scene_->has_floor = world.has_floor;
  scene_->floor_z_m = static_cast<float>(world.floor_z_m);
  scene_->floor_reflectance = world.floor_reflectance;

  const std::vector<Box> boxes = solid_boxes(world);

  scene_->scene = rtcNewScene(device());
  // Worlds are built once per sample in the data set: a quick build pays there, and a small world traverses fast
  // anyway.
  rtcSetSceneBuildQuality(scene_->scene, RTC_BUILD_QUALITY_LOW);
  if (!boxes.empty()) {
    const RTCGeometry quads = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_QUAD);
    auto* const vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        quads, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 8 * boxes.size()));
    auto* const indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        quads, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(std::uint32_t), kFaces * boxes.size()));
    scene_->surfaces.resize(kFaces * boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      append_quads(boxes[i], vertices + 24 * i, indices + 4 * kFaces * i, static_cast<std::uint32_t>(8 * i),
                   scene_->surfaces.data() + kFaces * i);
    }
    rtcSetGeometryBuildQuality(quads, RTC_BUILD_QUALITY_LOW);
    rtcCommitGeometry(quads);
    rtcAttachGeometry(scene_->scene, quads);
    rtcReleaseGeometry(quads);
  }
  rtcCommitScene(scene_->scene);
}

DepthCamera::~DepthCamera() = default;
DepthCamera::DepthCamera(DepthCamera&&) noexcept = default;
DepthCamera& DepthCamera::operator=(DepthCamera&&) noexcept = default;

void DepthCamera::render(const CameraModel& camera, const Eigen::Isometry3d& X_WC, DepthImage* image,
                         SurfaceImage* surface, FaceImage* faces) const {
  const auto pixels = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
  image->width_px = camera.width_px;
  image->height_px = camera.height_px;
  image->depth_m.resize(pixels);
  if (surface != nullptr) {
    surface->cos_incidence.resize(pixels);
    surface->reflectance.resize(pixels);
  }
  if (faces != nullptr) faces->face.resize(pixels);
  static const bool native16 = rtcGetDeviceProperty(device(), RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
  static const bool native8 = rtcGetDeviceProperty(device(), RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0;
  if (native16) {
    scene_->render<16>(camera, X_WC, image, surface, faces);
  } else if (native8) {
    scene_->render<8>(camera, X_WC, image, surface, faces);
  } else {
    scene_->render<4>(camera, X_WC, image, surface, faces);
  }
}

}  // namespace gatefield::scene
