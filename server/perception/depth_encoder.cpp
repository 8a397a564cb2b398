#include "server/perception/depth_encoder.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>
#include <string>

#include "common/model/two_look.h"

namespace gatefield::perception {
namespace {

/// The second look is taken again when it moved the centre by more than this: around its own middle the crop tells more
/// (docs/training.md).
constexpr double kLookAgain_m = 0.05;
/// Added to the true error before the logarithm in training, so that zero can be told.
constexpr float kErrorFloor_m = 0.005f;

CameraModel network_camera(const model::Manifest& manifest) {
  CameraModel camera = camera_from_fov(manifest.image_width_px, manifest.image_height_px, manifest.horizontal_fov_rad,
                                       manifest.vertical_fov_rad);
  camera.min_depth_m = manifest.min_depth_m;
  camera.max_depth_m = manifest.max_depth_m;
  return camera;
}

bool same_intrinsics(const CameraModel& a, const CameraModel& b) {
  const auto close = [](double x, double y) { return std::abs(x - y) < 0.05; };  // pixels
  return a.width_px == b.width_px && a.height_px == b.height_px && close(a.fx_px, b.fx_px) && close(a.fy_px, b.fy_px) &&
         close(a.cx_px, b.cx_px) && close(a.cy_px, b.cy_px);
}

cv::Mat tensor(std::vector<int> shape) { return {std::move(shape), CV_32F, cv::Scalar(0)}; }

std::span<float> numbers(cv::Mat& mat) { return {mat.ptr<float>(), mat.total()}; }

cv::dnn::Net read_network(const std::filesystem::path& file) {
  cv::dnn::Net net = cv::dnn::readNetFromONNX(file.string());
  net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  return net;
}

/// Runs a network; empty when OpenCV fails or the output isn't `size` finite numbers.
std::optional<std::vector<float>> run(cv::dnn::Net* net, std::size_t size) {
  const cv::Mat out = net->forward();
  if (out.type() != CV_32F || out.total() != size || !out.isContinuous()) return std::nullopt;
  std::vector<float> values(out.ptr<float>(), out.ptr<float>() + size);
  if (!std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); })) return std::nullopt;
  return values;
}

float sigmoid(float x) { return 1.0f / (1.0f + std::exp(-x)); }

/// Reads the tail that both encoders share: validity logit, log predicted error.
Encoding encoding_from(std::vector<float> latent, float validity_logit, float log_error) {
  Encoding out;
  out.latent = std::move(latent);
  out.center_C = Eigen::Vector3f::Zero();
  out.validity = sigmoid(validity_logit);
  out.predicted_error_m = std::max(0.0f, std::exp(std::min(log_error, 5.0f)) - kErrorFloor_m);
  return out;
}

/// What both kinds have in common: the image as the network's own camera would have seen it.
class EncoderBase : public DepthEncoder {
 public:
  explicit EncoderBase(const model::Manifest& manifest) : manifest_(manifest), camera_(network_camera(manifest)) {}

  std::optional<Encoding> encode(std::span<const float> depth_m, const CameraModel& camera,
                                 const std::optional<Eigen::Vector3d>& prior_C) final {
    try {
      if (camera.width_px <= 0 || camera.height_px <= 0 ||
          depth_m.size() != static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px)) {
        return std::nullopt;
      }
      if (same_intrinsics(camera, camera_)) {
        image_.assign(depth_m.begin(), depth_m.end());
      } else {
        model::resample_nearest(depth_m, camera, camera_, &image_);
      }
      // The session's camera may see nearer or farther than the network ever did.
      const auto low = static_cast<float>(camera_.min_depth_m);
      const auto high = static_cast<float>(camera_.max_depth_m);
      bool any = false;
      for (float& z : image_) {
        if (!(z >= low && z <= high)) z = 0.0f;
        any = any || z > 0.0f;
      }
      if (!any) return std::nullopt;
      return encode_image(prior_C);
    } catch (const std::exception&) {
      return std::nullopt;  // OpenCV's exceptions stop here; a frame that can't be encoded is a frame without a gate
    }
  }

 protected:
  virtual std::optional<Encoding> encode_image(const std::optional<Eigen::Vector3d>& prior_C) = 0;

  const model::Manifest manifest_;
  const CameraModel camera_;
  std::vector<float> image_;  ///< metres, 0 = no return, of camera_
};

class TwoLookEncoder final : public EncoderBase {
 public:
  explicit TwoLookEncoder(const model::Bundle& bundle)
      : EncoderBase(bundle.manifest()),
        shape_(model::look_shape(camera_.width_px, camera_.height_px)),
        crop_{manifest_.crop_half_width_m, manifest_.crop_size_px},
        first_(read_network(bundle.folder() / "look1.onnx")),
        second_(read_network(bundle.folder() / "look2.onnx")),
        input_(tensor({1, model::kLookChannels, shape_.height, shape_.width})),
        anchors_(tensor({1, model::kAnchorChannels, shape_.anchor_height(), shape_.anchor_width()})),
        cut_(tensor({1, model::kCropChannels, crop_.size, crop_.size})),
        context_(tensor({1, model::kCropContext})) {}

  /// True when both networks run and give what is expected.
  bool works() {
    numbers(context_)[2] = 0.5f;
    return look_at_image().has_value() && run_second().has_value();
  }

 protected:
  std::optional<Encoding> encode_image(const std::optional<Eigen::Vector3d>& prior_C) override {
    Eigen::Vector3d center_C;
    if (prior_C.has_value()) {
      center_C = *prior_C;
    } else {
      model::first_look_input(image_, camera_, numbers(input_), numbers(anchors_));
      const auto seen = look_at_image();
      if (!seen) return std::nullopt;
      center_C = *seen;
      // The nearest gate can be so near that its centre comes out at the camera's own place.
      center_C.z() = std::max(center_C.z(), model::kCropMinDepth_m);
    }
    auto code = look_around(center_C);
    if (!code) return std::nullopt;
    Eigen::Vector3d moved_C = corrected(center_C, *code);
    if ((moved_C - center_C).norm() > kLookAgain_m) {
      if (auto again = look_around(moved_C); again.has_value()) {
        center_C = moved_C;
        moved_C = corrected(center_C, *again);
        code = std::move(again);
      }
    }
    const auto z_n = static_cast<std::size_t>(manifest_.latent_size - 3);
    const Eigen::Vector3f center = moved_C.cast<float>();
    std::vector<float> latent = {center.x(), center.y(), center.z()};
    latent.insert(latent.end(), code->begin() + 3, code->begin() + 3 + static_cast<std::ptrdiff_t>(z_n));
    Encoding out = encoding_from(std::move(latent), (*code)[3 + z_n], (*code)[4 + z_n]);
    out.center_C = center;
    return out;
  }

 private:
  static Eigen::Vector3d corrected(const Eigen::Vector3d& center_C, const std::vector<float>& code) {
    return center_C + Eigen::Vector3d(code[0], code[1], code[2]);
  }

  std::optional<Eigen::Vector3d> look_at_image() {
    first_.setInput(input_, "input");
    first_.setInput(anchors_, "anchors");
    const auto center = run(&first_, 3);
    if (!center) return std::nullopt;
    return Eigen::Vector3d((*center)[0], (*center)[1], (*center)[2]);
  }

  std::optional<std::vector<float>> look_around(const Eigen::Vector3d& center_C) {
    if (!center_C.allFinite() || center_C.z() < model::kCropMinDepth_m || center_C.norm() > 1e3) return std::nullopt;
    if (model::crop_input(image_, camera_, crop_, center_C, numbers(cut_), numbers(context_)) == 0) return std::nullopt;
    return run_second();
  }

  std::optional<std::vector<float>> run_second() {
    second_.setInput(cut_, "crop");
    second_.setInput(context_, "context");
    return run(&second_, static_cast<std::size_t>(manifest_.latent_size) + 2);
  }

  model::LookShape shape_;
  model::CropShape crop_;
  cv::dnn::Net first_;
  cv::dnn::Net second_;
  cv::Mat input_;
  cv::Mat anchors_;
  cv::Mat cut_;
  cv::Mat context_;
};

/// One look at the whole image; a prior can't steer it.
class PlainEncoder final : public EncoderBase {
 public:
  explicit PlainEncoder(const model::Bundle& bundle)
      : EncoderBase(bundle.manifest()),
        net_(read_network(bundle.folder() / "encoder.onnx")),
        input_(tensor({1, 2, camera_.height_px, camera_.width_px})) {}

  bool works() { return look().has_value(); }

 protected:
  std::optional<Encoding> encode_image(const std::optional<Eigen::Vector3d>&) override {
    model::plain_input(image_, numbers(input_));
    const auto code = look();
    if (!code) return std::nullopt;
    const auto z_n = static_cast<std::size_t>(manifest_.latent_size);
    return encoding_from({code->begin(), code->begin() + static_cast<std::ptrdiff_t>(z_n)}, (*code)[z_n],
                         (*code)[z_n + 1]);
  }

 private:
  std::optional<std::vector<float>> look() {
    net_.setInput(input_, "image");
    return run(&net_, static_cast<std::size_t>(manifest_.latent_size) + 2);
  }

  cv::dnn::Net net_;
  cv::Mat input_;
};

template <typename Encoder>
Result<std::unique_ptr<DepthEncoder>> make(const model::Bundle& bundle) {
  auto encoder = std::make_unique<Encoder>(bundle);
  if (!encoder->works()) {
    return Error{bundle.folder().string() + ": the encoder's networks load but don't give " +
                 std::to_string(bundle.manifest().latent_size + 2) + " finite numbers for an empty image"};
  }
  return std::unique_ptr<DepthEncoder>(std::move(encoder));
}

}  // namespace

Result<std::unique_ptr<DepthEncoder>> DepthEncoder::create(const model::Bundle& bundle) {
  try {
    cv::setNumThreads(1);  // the perception thread has one core; a pool of OpenCV's own would take the planner's
    return bundle.manifest().encoder_kind == "two_look" ? make<TwoLookEncoder>(bundle) : make<PlainEncoder>(bundle);
  } catch (const std::exception& error) {
    const std::string what = error.what();
    return Error{bundle.folder().string() + ": OpenCV can't load the encoder: " + what.substr(0, what.find('\n'))};
  }
}

}  // namespace gatefield::perception
