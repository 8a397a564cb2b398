#include "common/scene/stereo_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "common/base/multiversion.h"
#include "common/scene/texture.h"

namespace gatefield::scene {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3f;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// Where nothing is hit: an even grey.
constexpr float kNothing = 0.3f;
/// The mean that the automatic exposure aims at, of full scale.
constexpr float kMeanGrey = 0.40f;
/// The pattern's dots sit in the cells of a grid over x / z and y / z: about 90 x 60 in view.
constexpr float kCell = 0.021f;
constexpr float kDotRadius = 0.0034f;
/// The projector stands between the imagers.
constexpr double kProjectorShare = 0.6;

/// One face of a box, or the floor, ready for painting: (s, t) = rows * p_W + offsets.
struct Face {
  Vector3f row_s, row_t;
  float offset_s = 0.0f, offset_t = 0.0f;
  Vector3f normal_W;
  Material material;
};

Face make_face(const Isometry3d& X_WO, int axis, std::uint32_t side, const Material& material) {
  const double per_m = 1.0 / static_cast<double>(material.stretch);
  const Eigen::Matrix3d R_OW = X_WO.linear().transpose();
  const Vector3d p_OW = -R_OW * X_WO.translation();
  const int s = (axis + 1) % 3;
  const int t = (axis + 2) % 3;
  Face face;
  face.row_s = (per_m * R_OW.row(s)).transpose().cast<float>();
  face.row_t = (per_m * R_OW.row(t)).transpose().cast<float>();
  face.offset_s = static_cast<float>(per_m * p_OW[s]);
  face.offset_t = static_cast<float>(per_m * p_OW[t]);
  face.normal_W = X_WO.linear().col(axis).cast<float>();
  face.material = material;
  face.material.seed += 0x632BE5ABu * side;  // no face repeats another one
  return face;
}

/// Buffers that keep their size between calls, one set per thread.
struct Scratch {
  DepthImage depth;
  FaceImage faces;
  TexturePoints points;
  std::vector<float> noise;
  std::vector<float> light;  ///< by point: light that falls on the surface times albedo
  std::vector<float> contrast;
  std::vector<std::uint32_t> painted;  ///< by ray: its point
  std::array<std::vector<float>, 2> picture;
};

/// Light of the projector's dots in a direction, 0 to 1. Each cell has one dot, somewhere in it.
inline float dot_at(float x, float y) noexcept {
  const float cell_x = std::floor(x / kCell);
  const float cell_y = std::floor(y / kCell);
  std::uint32_t hash = static_cast<std::uint32_t>(static_cast<std::int32_t>(cell_x)) * 0x8DA6B343u ^
                       static_cast<std::uint32_t>(static_cast<std::int32_t>(cell_y)) * 0xD8163841u;
  hash ^= hash >> 16;
  hash *= 0x7FEB352Du;
  hash ^= hash >> 15;
  hash *= 0x846CA68Bu;
  hash ^= hash >> 16;
  constexpr float kMargin = 2.0f * kDotRadius / kCell;
  const float at_x = kMargin + (1.0f - 2.0f * kMargin) * static_cast<float>(hash & 0xFFFFu) * 0x1p-16f;
  const float at_y = kMargin + (1.0f - 2.0f * kMargin) * static_cast<float>(hash >> 16) * 0x1p-16f;
  const float dx = (x / kCell - cell_x - at_x) * (kCell / kDotRadius);
  const float dy = (y / kCell - cell_y - at_y) * (kCell / kDotRadius);
  // About exp(-r^2 / 2): (1 - r^2 / 16)^8.
  const float t = std::max(1.0f - (dx * dx + dy * dy) / 16.0f, 0.0f);
  const float t2 = t * t;
  return t2 * t2 * t2 * t2;
}

/// Photon noise, read noise and gain, then 8 bits. Four bytes of random bits added up are normal enough (variance of a
/// byte: 65535 / 12).
GATEFIELD_MULTIVERSION void expose(const float* light, std::size_t pixels, float gain, float electrons, float read_e,
                                   std::uint32_t key0, std::uint32_t key1, std::uint8_t* grey) {
  constexpr float kPerSigma = 1.0f / 147.8013f;
  const float per_e = gain / electrons;
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto block = philox({static_cast<std::uint32_t>(i), 0, 0, 0}, {key0, key1});
    const std::uint32_t bits = block[0];
    const auto sum =
        static_cast<std::int32_t>((bits & 255u) + ((bits >> 8) & 255u) + ((bits >> 16) & 255u) + (bits >> 24));
    const float normal = (static_cast<float>(sum) - 510.0f) * kPerSigma;
    const float signal_e = std::max(light[i], 0.0f) * electrons;
    const float value = (signal_e + std::sqrt(signal_e + read_e * read_e) * normal) * per_e;
    grey[i] =
        static_cast<std::uint8_t>(static_cast<std::int32_t>(std::min(std::max(value * 255.0f + 0.5f, 0.0f), 255.0f)));
  }
}

GATEFIELD_MULTIVERSION void paint(const float* __restrict contrast, const float* __restrict noise, std::size_t points,
                                  float* __restrict light) {
  for (std::size_t i = 0; i < points; ++i) {
    light[i] *= std::min(std::max(1.0f + contrast[i] * noise[i], 0.1f), 2.5f);
  }
}

/// Half the size of the window that a disparity is refined over.
constexpr int kReachU = 4;
constexpr int kReachV = 3;

/// The matcher's costs hardly tell where between two pixels a match lies, so its disparities crowd at whole pixels.
/// This moves one to where the window of the left picture fits the right one best (B. Lucas, T. Kanade, "An iterative
/// image registration technique", IJCAI 1981, along the row alone):
///   d <- d - sum r I_L' / sum I_L'^2,  r = I_L(u) - I_R(u - d) - mean.
/// Only pixels that the matcher put within one pixel of the start take part, so that no window mixes two objects.
/// @return the refined disparity, or the start where the window says nothing
float refine(const cv::Mat& left, const cv::Mat& right, const cv::Mat& disparity, int u, int v, float start_px) {
  constexpr int kSize = (2 * kReachU + 1) * (2 * kReachV + 1);
  const int start = static_cast<int>(std::lround(start_px * 16.0f));
  const int most_left = static_cast<int>(start_px) + 3;  // room for the right picture's window
  if (u - kReachU - most_left < 0 || u + kReachU + 2 >= left.cols) return start_px;
  std::array<float, kSize> value;
  std::array<float, kSize> slope;
  std::array<const float*, kSize> other;  // the right picture at this column
  int count = 0;
  float slope_square = 0.0f;
  for (int row = std::max(v - kReachV, 0); row <= std::min(v + kReachV, left.rows - 1); ++row) {
    const auto* const from = disparity.ptr<std::int16_t>(row);
    const auto* const l = left.ptr<float>(row);
    const auto* const r = right.ptr<float>(row);
    for (int column = u - kReachU; column <= u + kReachU; ++column) {
      if (std::abs(from[column] - start) > 16) continue;
      const auto i = static_cast<std::size_t>(count++);
      value[i] = l[column];
      slope[i] = 0.5f * (l[column + 1] - l[column - 1]);
      slope_square += slope[i] * slope[i];
      other[i] = r + column;
    }
  }
  if (count < kSize / 4 || slope_square < 1.0f) return start_px;
  float d_px = start_px;
  for (int iteration = 0; iteration < 4; ++iteration) {
    const float floor_px = std::floor(-d_px);
    const auto whole = static_cast<std::ptrdiff_t>(floor_px);
    const float part = -d_px - floor_px;
    float sum = 0.0f;
    float sum_slope = 0.0f;
    float product = 0.0f;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const float seen = other[i][whole] + part * (other[i][whole + 1] - other[i][whole]);
      const float residual = value[i] - seen;
      sum += residual;
      sum_slope += slope[i];
      product += residual * slope[i];
    }
    const float step_px = -(product - sum * sum_slope / static_cast<float>(count)) / slope_square;
    d_px += step_px;
    if (!(std::abs(d_px - start_px) <= 1.0f)) return start_px;
    if (std::abs(step_px) < 0.01f) break;
  }
  return d_px;
}

}  // namespace

Status validate(const StereoOptions& options) {
  const auto check = [](const char* field, double value, double low, double high, const char* expected) -> Status {
    if (value >= low && value <= high) return {};
    return Error::invalid(std::string("stereo.") + field, std::to_string(value), expected);
  };
  for (const Status& status :
       {check("upsampling", options.upsampling, 1, 8, "1 to 8"),
        check("baseline_m", options.baseline_m, 0.005, 1.0, "0.005 to 1 m"),
        check("margin_px", options.margin_px, 0, 1000, "0 to 1000 px"),
        check("blur_px", options.blur_px, 0.0, 5.0, "0 to 5 px"),
        check("vignetting", options.vignetting, 0.0, 1.0, "0 to 1"),
        check("white_e", options.white_e, 10.0, 1e6, "10 to 1e6 electrons"),
        check("read_noise_e", options.read_noise_e, 0.0, 1e4, "0 to 10000 electrons"),
        check("gain_difference", options.gain_difference, -0.5, 0.5, "-0.5 to 0.5"),
        check("shift_x_px", options.shift_x_px, -10.0, 10.0, "-10 to 10 px"),
        check("shift_y_px", options.shift_y_px, -10.0, 10.0, "-10 to 10 px"),
        check("roll_rad", options.roll_rad, -0.1, 0.1, "-0.1 to 0.1 rad"),
        check("focal_error", options.focal_error, -0.1, 0.1, "-0.1 to 0.1"),
        check("ambient", options.ambient, 0.0, 10.0, "0 to 10"),
        check("lamp", options.lamp, 0.0, 10.0, "0 to 10"),
        check("pattern", options.pattern, 0.0, 10.0, "0 to 10"),
        check("block_px", options.block_px, 1, 21, "1 to 21 px"),
        check("uniqueness_percent", options.uniqueness_percent, 0, 100, "0 to 100"),
        check("texture", options.texture, 0.0, 100.0, "0 to 100"),
        check("speckle_px", options.speckle_px, 0, 100'000, "0 to 100000 px"),
        check("min_valid", options.min_valid, 1, options.upsampling * options.upsampling, "1 to upsampling^2")}) {
    if (!status.ok()) return status;
  }
  if (options.block_px % 2 == 0) {
    return Error::invalid("stereo.block_px", std::to_string(options.block_px), "an odd number");
  }
  return {};
}

struct StereoCamera::Scene {
  DepthCamera rays;
  StereoOptions options;
  std::vector<Face> faces;  ///< six per box; the floor comes last
  int floor = 0;

  Scene(const World& world, const StereoOptions& with, std::uint64_t texture_seed) : rays(world), options(with) {
    std::uint32_t object = 0;
    const auto add = [&](const Box& box, const Material& material) {
      for (std::uint32_t side = 0; side < 6; ++side) {
        faces.push_back(make_face(box.X_WO, static_cast<int>(side / 2), side, material));
      }
    };
    for (const Box& box : world.boxes) add(box, draw_material(texture_seed, object++, box.reflectance));
    for (const Gate& gate : world.gates) {
      const Material material = draw_material(texture_seed, object++, gate.reflectance);
      std::uint32_t piece = 0;
      for (const Box& box : frame_boxes(gate)) {
        Material own = material;  // one paint for the whole gate, no piece repeats another one
        own.seed += 0x2545F491u * piece++;
        add(box, own);
      }
    }
    floor = static_cast<int>(faces.size());
    faces.push_back(
        make_face(Isometry3d::Identity(), 2, 0, draw_material(texture_seed, object, world.floor_reflectance)));
  }

  /// One imager's picture before noise. @return mean of the picture
  float look(const CameraModel& imager, const Isometry3d& X_WC, double projector_x_m, Scratch* scratch,
             std::vector<float>* picture) const;
};

float StereoCamera::Scene::look(const CameraModel& imager, const Isometry3d& X_WC, double projector_x_m,
                                Scratch* scratch, std::vector<float>* picture) const {
  // Two rays a pixel along the row, so that the borders of objects land between pixels as they do on a sensor.
  CameraModel fine = imager;
  fine.width_px *= 2;
  fine.fx_px *= 2;
  fine.cx_px *= 2;
  fine.min_depth_m = 0.01;
  fine.max_depth_m = 60.0;
  rays.render(fine, X_WC, &scratch->depth, nullptr, &scratch->faces);

  // A pixel whose rays meet one surface is painted once, at its centre; else once per ray.
  const std::size_t rays_n = scratch->depth.depth_m.size();
  scratch->points.resize(rays_n);
  scratch->light.resize(rays_n);
  scratch->contrast.resize(rays_n);
  scratch->painted.resize(rays_n);
  const Matrix3f R_WC = X_WC.linear().cast<float>();
  const Vector3f p_WC = X_WC.translation().cast<float>();
  const auto ambient = static_cast<float>(options.ambient);
  const auto lamp = static_cast<float>(options.lamp);
  const auto pattern = static_cast<float>(options.pattern);
  const auto projector_m = static_cast<float>(projector_x_m);
  const auto per_fx = static_cast<float>(1.0 / imager.fx_px);
  const auto per_fy = static_cast<float>(1.0 / imager.fy_px);
  std::uint32_t count = 0;
  const auto add = [&](std::int32_t which, float x, float y, float z_m) {
    const std::uint32_t i = count++;
    if (which == FaceImage::kNoFace) {
      scratch->points.s_m[i] = scratch->points.t_m[i] = 0.0f;
      scratch->points.footprint_m[i] = 1.0f;
      scratch->points.persistence[i] = 0.5f;
      scratch->points.seed[i] = 0;
      scratch->light[i] = kNothing * ambient;
      scratch->contrast[i] = 0.0f;
      return;
    }
    const Face& face = faces[static_cast<std::size_t>(which == FaceImage::kFloorFace ? floor : which)];
    const Vector3f to_W = R_WC * Vector3f(x, y, 1.0f);
    const Vector3f p_W = p_WC + z_m * to_W;
    const float length = std::sqrt(1.0f + x * x + y * y);
    const float along = face.normal_W.dot(to_W);
    const float cosine = std::min(std::abs(along) / length, 1.0f);
    const float up = along > 0.0f ? -face.normal_W.z() : face.normal_W.z();  // of the side that is seen
    const float near_m = std::max(z_m * length, 0.3f);
    float beam = lamp;
    if (pattern > 0.0f && z_m < 8.0f) beam += pattern * dot_at(x - projector_m / z_m, y);
    const float light = ambient * (0.75f + 0.25f * up) + beam * cosine / (near_m * near_m);

    scratch->points.s_m[i] = face.row_s.dot(p_W) + face.offset_s;
    scratch->points.t_m[i] = face.row_t.dot(p_W) + face.offset_t;
    scratch->points.footprint_m[i] =
        z_m * per_fy / (std::sqrt(std::sqrt(std::max(cosine, 0.01f))) * face.material.stretch);
    scratch->points.persistence[i] = face.material.persistence;
    scratch->points.seed[i] = face.material.seed;
    scratch->light[i] = light * face.material.albedo;
    scratch->contrast[i] = face.material.contrast;
  };
  for (int v = 0; v < imager.height_px; ++v) {
    const float y = (static_cast<float>(v) + 0.5f - static_cast<float>(imager.cy_px)) * per_fy;
    const std::size_t row = static_cast<std::size_t>(v) * static_cast<std::size_t>(fine.width_px);
    for (int u = 0; u < imager.width_px; ++u) {
      const float x = (static_cast<float>(u) + 0.5f - static_cast<float>(imager.cx_px)) * per_fx;
      const std::size_t first = row + 2 * static_cast<std::size_t>(u);
      const std::int32_t* const which = scratch->faces.face.data() + first;
      const float* const z_m = scratch->depth.depth_m.data() + first;
      if (which[0] == which[1]) {
        // 1 / z is linear over a plane.
        add(which[0], x, y, which[0] == FaceImage::kNoFace ? 0.0f : 2.0f * z_m[0] * z_m[1] / (z_m[0] + z_m[1]));
        scratch->painted[first] = scratch->painted[first + 1] = count - 1;
      } else {
        for (std::size_t k = 0; k < 2; ++k) {
          add(which[k], x + (k == 0 ? -0.25f : 0.25f) * per_fx, y, z_m[k]);
          scratch->painted[first + k] = count - 1;
        }
      }
    }
  }
  scratch->noise.resize(count);
  fractal_noise(scratch->points, scratch->noise);
  paint(scratch->contrast.data(), scratch->noise.data(), count, scratch->light.data());

  const auto width = static_cast<std::size_t>(imager.width_px);
  const auto height = static_cast<std::size_t>(imager.height_px);
  picture->resize(width * height);
  const double corner = std::hypot(0.5 * imager.width_px / imager.fx_px, 0.5 * imager.height_px / imager.fy_px);
  const auto vignetting = static_cast<float>(options.vignetting / (corner * corner));
  double sum = 0.0;
  for (std::size_t v = 0; v < height; ++v) {
    const auto y = static_cast<float>((static_cast<double>(v) + 0.5 - imager.cy_px) / imager.fy_px);
    const std::uint32_t* const row = scratch->painted.data() + 2 * v * width;
    for (std::size_t u = 0; u < width; ++u) {
      const auto x = static_cast<float>((static_cast<double>(u) + 0.5 - imager.cx_px) / imager.fx_px);
      const float value = 0.5f * (scratch->light[row[2 * u]] + scratch->light[row[2 * u + 1]]) *
                          std::max(1.0f - vignetting * (x * x + y * y), 0.0f);
      (*picture)[v * width + u] = value;
      sum += static_cast<double>(value);
    }
  }
  if (options.blur_px > 0.0) {
    cv::Mat wrapped(imager.height_px, imager.width_px, CV_32F, picture->data());
    const int size = 2 * std::max(1, static_cast<int>(std::ceil(2.5 * options.blur_px))) + 1;
    cv::GaussianBlur(wrapped, wrapped, {size, size}, options.blur_px, options.blur_px, cv::BORDER_REPLICATE);
  }
  return static_cast<float>(sum / static_cast<double>(width * height));
}

StereoCamera::StereoCamera(const World& world, const StereoOptions& options, std::uint64_t texture_seed)
    : scene_(std::make_unique<Scene>(world, options, texture_seed)) {}
StereoCamera::~StereoCamera() = default;
StereoCamera::StereoCamera(StereoCamera&&) noexcept = default;
StereoCamera& StereoCamera::operator=(StereoCamera&&) noexcept = default;

void StereoCamera::render(const CameraModel& camera, const Isometry3d& X_WC, Random* random, DepthImage* measured,
                          StereoPictures* pictures) const {
  const StereoOptions& options = scene_->options;
  static thread_local Scratch scratch;

  // The imagers: as the matcher believes them to be (left), and as the right one is.
  const int up = options.upsampling;
  CameraModel left = camera;
  left.width_px = camera.width_px * up + options.margin_px;
  left.height_px = camera.height_px * up;
  left.fx_px = camera.fx_px * up;
  left.fy_px = camera.fy_px * up;
  left.cx_px = camera.cx_px * up + options.margin_px;
  left.cy_px = camera.cy_px * up;
  CameraModel right = left;
  right.fx_px *= 1.0 + options.focal_error;
  right.fy_px *= 1.0 + options.focal_error;
  right.cx_px -= options.shift_x_px;  // a smaller column in the right image is a larger disparity
  right.cy_px += options.shift_y_px;
  Isometry3d X_LR = Isometry3d::Identity();
  X_LR.translation().x() = options.baseline_m;
  X_LR.linear() = Eigen::AngleAxisd(options.roll_rad, Vector3d::UnitZ()).toRotationMatrix();

  const double projector_m = kProjectorShare * options.baseline_m;
  const float mean = scene_->look(left, X_WC, projector_m, &scratch, &scratch.picture[0]);
  scene_->look(right, X_WC * X_LR, projector_m - options.baseline_m, &scratch, &scratch.picture[1]);

  // Exposure: shorter when it is bright; amplified, noise included, when it is dark.
  const float wanted = std::clamp(kMeanGrey / std::max(mean, 1e-3f), 0.05f, 16.0f);
  const float electrons = static_cast<float>(options.white_e) * std::min(wanted, 1.0f);

  const double nearest_px = left.fx_px * options.baseline_m / camera.min_depth_m;
  const int disparities = 16 * std::max(1, static_cast<int>(std::ceil((nearest_px + 1.0) / 16.0)));
  // The matcher gives nothing in its first `disparities` columns; what the imagers lack of them is filled by
  // repetition.
  const int pad_px = std::max(0, disparities - options.margin_px);
  std::array<cv::Mat, 2> grey;
  for (std::size_t side = 0; side < 2; ++side) {
    const std::uint32_t key0 = random->bits();
    const std::uint32_t key1 = random->bits();
    cv::Mat picture(left.height_px, left.width_px, CV_8U);
    const float gain = wanted * (side == 0 ? 1.0f : 1.0f + static_cast<float>(options.gain_difference));
    expose(scratch.picture[side].data(), scratch.picture[side].size(), gain, electrons,
           static_cast<float>(options.read_noise_e), key0, key1, picture.data);
    cv::copyMakeBorder(picture, grey[side], 0, 0, pad_px, 0, cv::BORDER_REPLICATE);
  }

  // Where the left image holds nothing but noise, matches are chance. Noise is known from the exposure.
  cv::Mat textured;
  if (options.texture > 0.0) {
    cv::Mat gradient;
    cv::Mat mean_square;
    cv::Mat brightness;
    cv::Mat around;
    cv::Sobel(grey[0], gradient, CV_32F, 1, 0, 1);  // I(u + 1) - I(u - 1)
    const cv::Size window(9, 7);
    cv::boxFilter(gradient.mul(gradient), mean_square, CV_32F, window);
    cv::boxFilter(grey[0], around, CV_32F, window);
    // Grey levels: sigma^2 = g (I + g read^2) + 1 / 12 with g grey levels an electron.
    const double per_e = 255.0 * static_cast<double>(wanted) / static_cast<double>(electrons);
    const double constant = per_e * per_e * options.read_noise_e * options.read_noise_e + 1.0 / 12.0;
    textured = mean_square > 2.0 * options.texture * (per_e * around + constant);
  }

  const int block = options.block_px;
  const auto matcher = cv::StereoSGBM::create(0, disparities, block, 8 * block * block, 32 * block * block, 1, 31,
                                              options.uniqueness_percent, 0, 0, cv::StereoSGBM::MODE_SGBM);
  cv::Mat disparity;
  matcher->compute(grey[0], grey[1], disparity);
  if (!textured.empty()) disparity.setTo(-16, ~textured);
  if (options.speckle_px > 0) cv::filterSpeckles(disparity, -16, options.speckle_px, 32);

  // Sixteenths of a pixel; negative = none. Matches outside of what the right imager saw are made of padding.
  const auto width = static_cast<std::size_t>(camera.width_px);
  const auto height = static_cast<std::size_t>(camera.height_px);
  const int first_px = pad_px + options.margin_px;
  measured->width_px = camera.width_px;
  measured->height_px = camera.height_px;
  measured->depth_m.assign(width * height, 0.0f);
  if (pictures != nullptr) {
    pictures->width_px = camera.width_px * up;
    pictures->height_px = left.height_px;
    const auto pixels = static_cast<std::size_t>(pictures->width_px) * static_cast<std::size_t>(pictures->height_px);
    pictures->left.resize(pixels);
    pictures->right.resize(pixels);
    pictures->disparity_px.resize(pixels);
    for (int v = 0; v < pictures->height_px; ++v) {
      for (int u = 0; u < pictures->width_px; ++u) {
        const auto i =
            static_cast<std::size_t>(v) * static_cast<std::size_t>(pictures->width_px) + static_cast<std::size_t>(u);
        pictures->left[i] = grey[0].at<std::uint8_t>(v, first_px + u);
        pictures->right[i] = grey[1].at<std::uint8_t>(v, first_px + u);
        pictures->disparity_px[i] = static_cast<float>(disparity.at<std::int16_t>(v, first_px + u)) / 16.0f;
      }
    }
  }

  std::array<cv::Mat, 2> exact;
  for (std::size_t side = 0; side < 2; ++side) grey[side].convertTo(exact[side], CV_32F);
  const auto scale_m_px = static_cast<float>(left.fx_px * options.baseline_m);
  const auto min_m = static_cast<float>(camera.min_depth_m);
  const auto max_m = static_cast<float>(camera.max_depth_m);
  std::array<std::int16_t, 64> block_values;
  for (std::size_t v = 0; v < height; ++v) {
    for (std::size_t u = 0; u < width; ++u) {
      std::size_t valid = 0;
      for (int dv = 0; dv < up; ++dv) {
        const auto* const row = disparity.ptr<std::int16_t>(static_cast<int>(v) * up + dv);
        for (int du = 0; du < up; ++du) {
          const int column = first_px + static_cast<int>(u) * up + du;
          const std::int16_t d = row[column];
          if (d >= 0 && column - d / 16 >= pad_px) block_values[valid++] = d;
        }
      }
      if (valid < static_cast<std::size_t>(options.min_valid)) continue;
      auto* const middle = block_values.data() + valid / 2;
      std::nth_element(block_values.data(), middle, block_values.data() + valid);
      const int median = *middle;
      int sum = 0;
      int around = 0;
      for (std::size_t k = 0; k < valid; ++k) {
        if (std::abs(block_values[k] - median) > 8) continue;
        sum += block_values[k];
        ++around;
      }
      const float matched_px = static_cast<float>(sum) / (16.0f * static_cast<float>(around));
      const float disparity_px = refine(exact[0], exact[1], disparity, first_px + static_cast<int>(u) * up + up / 2,
                                        static_cast<int>(v) * up + up / 2, matched_px);
      if (disparity_px <= 0.0f) continue;
      const float z_m = scale_m_px / disparity_px;
      if (z_m >= min_m && z_m <= max_m) measured->depth_m[v * width + u] = z_m;
    }
  }
}

}  // namespace gatefield::scene
