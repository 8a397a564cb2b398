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
/// How far OpenCV's single precision may be from the bundle's test case, as part of the largest number.
constexpr float kSameAnswer = 2e-3f;
constexpr std::size_t kMaxWords = 300;  ///< letters of OpenCV's explanation

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

/// Runs a network; empty when OpenCV fails or the output isn't `size` finite numbers.
std::optional<std::vector<float>> run(cv::dnn::Net* net, std::size_t size) {
  const cv::Mat out = net->forward();
  if (out.type() != CV_32F || out.total() != size || !out.isContinuous()) return std::nullopt;
  std::vector<float> values(out.ptr<float>(), out.ptr<float>() + size);
  if (!std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); })) return std::nullopt;
  return values;
}

/// What OpenCV's explanation comes down to: it goes over several lines, with places in OpenCV's source.
///   error: (-2:...) in function 'handleNode' > Node [Pow@ai.onnx]:(onnx_node!x) parse error: ... error: (-213:...)
///   Unsupported Pow op in function 'parsePow'      becomes      node 'x' (Pow): Unsupported Pow op
std::string words_of(const std::exception& error) {
  std::string text = error.what();
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, ' ');
  const auto between = [&](const std::string& before, const std::string& after) -> std::string {
    const std::size_t begin = text.find(before);
    if (begin == std::string::npos) return "";
    const std::size_t end = text.find(after, begin + before.size());
    return end == std::string::npos ? "" : text.substr(begin + before.size(), end - begin - before.size());
  };
  const std::string type = between("Node [", "@"), name = between("(onnx_node!", ")");
  if (const std::size_t last = text.rfind("error: ("); last != std::string::npos) {
    const std::size_t begin = text.find(") ", last);
    if (begin != std::string::npos) text = text.substr(begin + 2);
  }
  text = text.substr(0, std::min(text.find(" in function '"), kMaxWords));
  return (type.empty() ? "it: " : "node '" + name + "' (" + type + "): ") + text;
}

/// Loads a network of the bundle, and lets it compute the bundle's test case: OpenCV reads some graphs in its own way.
Result<cv::dnn::Net> load(const model::Bundle& bundle, const std::string& name) {
  const auto wrong = [&](const std::string& what) { return Error{(bundle.folder() / name).string() + ": " + what}; };
  const auto& networks = bundle.networks();
  const auto network =
      std::find_if(networks.begin(), networks.end(), [&](const model::Network& n) { return n.file == name; });
  if (network == networks.end()) return wrong("is not part of the bundle");
  cv::dnn::Net net;
  try {
    net = cv::dnn::readNetFromONNX(network->bytes->data(), network->bytes->size());
    net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    for (const model::NetworkTensor& input : network->inputs) {
      cv::Mat blob = tensor(input.shape);
      std::copy(input.values.begin(), input.values.end(), numbers(blob).begin());
      net.setInput(blob, input.name);
    }
  } catch (const std::exception& error) {
    return wrong("OpenCV can't load " + words_of(error));
  }
  const std::vector<float>& expected = network->output.values;
  std::optional<std::vector<float>> answer;
  try {
    answer = run(&net, expected.size());
  } catch (const std::exception& error) {
    return wrong("OpenCV can't run " + words_of(error));
  }
  if (!answer) return wrong("OpenCV doesn't give " + std::to_string(expected.size()) + " finite numbers for it");
  float largest = 1.0f;
  for (const float value : expected) largest = std::max(largest, std::abs(value));
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (std::abs((*answer)[i] - expected[i]) > kSameAnswer * largest) {
      return wrong("OpenCV computes something else than the file says: " + std::to_string((*answer)[i]) +
                   " as element " + std::to_string(i) + " of '" + network->output.name + "', expected " +
                   std::to_string(expected[i]) + "; write the network with other operators or another opset_version");
    }
  }
  return net;
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
  TwoLookEncoder(const model::Manifest& manifest, cv::dnn::Net first, cv::dnn::Net second)
      : EncoderBase(manifest),
        shape_(model::look_shape(camera_.width_px, camera_.height_px)),
        crop_{manifest_.crop_half_width_m, manifest_.crop_size_px},
        first_(std::move(first)),
        second_(std::move(second)),
        input_(tensor({1, model::kLookChannels, shape_.height, shape_.width})),
        anchors_(tensor({1, model::kAnchorChannels, shape_.anchor_height(), shape_.anchor_width()})),
        cut_(tensor({1, model::kCropChannels, crop_.size, crop_.size})),
        context_(tensor({1, model::kCropContext})) {}

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
  PlainEncoder(const model::Manifest& manifest, cv::dnn::Net net)
      : EncoderBase(manifest), net_(std::move(net)), input_(tensor({1, 2, camera_.height_px, camera_.width_px})) {}

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

}  // namespace

Result<std::unique_ptr<DepthEncoder>> DepthEncoder::create(const model::Bundle& bundle) {
  try {
    cv::setNumThreads(1);  // the perception thread has one core; a pool of OpenCV's own would take the planner's
    if (bundle.manifest().encoder_kind == "two_look") {
      Result<cv::dnn::Net> first = load(bundle, "look1.onnx");
      if (!first) return Error{first.error()};
      Result<cv::dnn::Net> second = load(bundle, "look2.onnx");
      if (!second) return Error{second.error()};
      return std::unique_ptr<DepthEncoder>(
          new TwoLookEncoder(bundle.manifest(), std::move(first).value(), std::move(second).value()));
    }
    Result<cv::dnn::Net> net = load(bundle, "encoder.onnx");
    if (!net) return Error{net.error()};
    return std::unique_ptr<DepthEncoder>(new PlainEncoder(bundle.manifest(), std::move(net).value()));
  } catch (const std::exception& error) {
    return Error{bundle.folder().string() + ": OpenCV can't set up " + words_of(error)};
  }
}

}  // namespace gatefield::perception
