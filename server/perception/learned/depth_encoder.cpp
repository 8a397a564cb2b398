#include "server/perception/learned/depth_encoder.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>
#include <stdexcept>
#include <string>

#include "common/base/logging.h"
#include "common/model/two_look.h"
#include "server/perception/learned/network.h"

namespace gatefield::perception {
namespace {

/// The second look is taken again when it moved the centre by more than this: around its own middle the crop tells more
/// (docs/training.md).
constexpr double kLookAgain_m = 0.05;
/// Added to the true error before the logarithm in training, so that zero can be told.
constexpr float kErrorFloor_m = 0.005f;
/// How far single precision may be from the bundle's test case, as part of the largest number.
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

class OpenCvNetwork final : public LoadedNetwork {
 public:
  OpenCvNetwork(const cv::dnn::Net& net, const model::Network& network) : net_(net) {
    for (const model::NetworkTensor& input : network.inputs)
      blobs_.emplace(input.name, cv::Mat(input.shape, CV_32F, cv::Scalar(0)));
  }
  std::span<float> input(const std::string& name) override {
    cv::Mat& blob = blobs_.at(name);
    return {blob.ptr<float>(), blob.total()};
  }
  std::optional<std::vector<float>> run(std::size_t size) override {
    for (const auto& [name, blob] : blobs_) net_.setInput(blob, name);
    const cv::Mat out = net_.forward();
    if (out.type() != CV_32F || out.total() != size || !out.isContinuous()) return std::nullopt;
    std::vector<float> values(out.ptr<float>(), out.ptr<float>() + size);
    if (!std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); })) return std::nullopt;
    return values;
  }

 private:
  cv::dnn::Net net_;
  std::map<std::string, cv::Mat> blobs_;
};

/// A network of the bundle by the fastest means that gives the bundle's test case.
Result<std::unique_ptr<LoadedNetwork>> load(const model::Bundle& bundle, const std::string& name) {
  const std::string file = (bundle.folder() / name).string();
  const auto& networks = bundle.networks();
  const auto network =
      std::find_if(networks.begin(), networks.end(), [&](const model::Network& n) { return n.file == name; });
  if (network == networks.end()) return Error{file + ": is not part of the bundle"};
  auto fast = onednn_network(*network);
  std::string why_not = fast ? disagreement(*fast.value(), *network) : fast.error();
  if (fast && why_not.empty()) return fast;
  if (onednn_built_in()) log::info(file + ": runs through OpenCV, since " + why_not);
  auto other = opencv_network(*network);
  if (!other) return other.failure().within(file + ": ");
  try {
    if (why_not = disagreement(*other.value(), *network); !why_not.empty()) return Error{file + ": OpenCV " + why_not};
  } catch (const std::exception& error) {
    return Error{file + ": OpenCV can't run " + words_of(error)};
  }
  return other;
}

float sigmoid(float x) { return 1.0f / (1.0f + std::exp(-x)); }

/// Reads the tail that both encoders share: validity logit, log predicted error.
Encoding encoding_from(std::vector<float> latent, float validity_logit, float log_error) {
  Encoding out;
  out.latent = std::move(latent);
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
    } catch (const std::exception& error) {
      throw std::runtime_error("the encoder can't run " + words_of(error));
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
  TwoLookEncoder(const model::Manifest& manifest, std::unique_ptr<LoadedNetwork> first,
                 std::unique_ptr<LoadedNetwork> second)
      : EncoderBase(manifest),
        shape_(model::look_shape(camera_.width_px, camera_.height_px)),
        crop_{manifest_.crop_half_width_m, manifest_.crop_size_px},
        first_(std::move(first)),
        second_(std::move(second)),
        input_(first_->input("input")),
        anchors_(first_->input("anchors")),
        cut_(second_->input("crop")),
        context_(second_->input("context")) {}

 protected:
  std::optional<Encoding> encode_image(const std::optional<Eigen::Vector3d>& prior_C) override {
    Eigen::Vector3d center_C;
    if (prior_C.has_value()) {
      center_C = *prior_C;
    } else {
      model::first_look_input(image_, camera_, input_, anchors_);
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
    const auto center = first_->run(3);
    if (!center) return std::nullopt;
    return Eigen::Vector3d((*center)[0], (*center)[1], (*center)[2]);
  }

  std::optional<std::vector<float>> look_around(const Eigen::Vector3d& center_C) {
    if (!center_C.allFinite() || center_C.z() < model::kCropMinDepth_m || center_C.norm() > 1e3) return std::nullopt;
    if (model::crop_input(image_, camera_, crop_, center_C, cut_, context_) == 0) return std::nullopt;
    return second_->run(static_cast<std::size_t>(manifest_.latent_size) + 2);
  }

  model::LookShape shape_;
  model::CropShape crop_;
  std::unique_ptr<LoadedNetwork> first_;
  std::unique_ptr<LoadedNetwork> second_;
  std::span<float> input_, anchors_, cut_, context_;
};

/// One look at the whole image; a prior can't steer it.
class PlainEncoder final : public EncoderBase {
 public:
  PlainEncoder(const model::Manifest& manifest, std::unique_ptr<LoadedNetwork> net)
      : EncoderBase(manifest), net_(std::move(net)), input_(net_->input("image")) {}

 protected:
  std::optional<Encoding> encode_image(const std::optional<Eigen::Vector3d>&) override {
    model::plain_input(image_, input_);
    const auto code = look();
    if (!code) return std::nullopt;
    const auto z_n = static_cast<std::size_t>(manifest_.latent_size);
    return encoding_from({code->begin(), code->begin() + static_cast<std::ptrdiff_t>(z_n)}, (*code)[z_n],
                         (*code)[z_n + 1]);
  }

 private:
  std::optional<std::vector<float>> look() { return net_->run(static_cast<std::size_t>(manifest_.latent_size) + 2); }

  std::unique_ptr<LoadedNetwork> net_;
  std::span<float> input_;
};

}  // namespace

Result<std::unique_ptr<LoadedNetwork>> opencv_network(const model::Network& network) {
  try {
    cv::setNumThreads(1);  // the perception thread has one core; a pool of OpenCV's own would take the planner's
    cv::dnn::Net net = cv::dnn::readNetFromONNX(network.bytes->data(), network.bytes->size());
    net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    return std::unique_ptr<LoadedNetwork>(new OpenCvNetwork(net, network));
  } catch (const std::exception& error) {
    return Error{"OpenCV can't load " + words_of(error)};
  }
}

std::string disagreement(LoadedNetwork& candidate, const model::Network& network) {
  for (const model::NetworkTensor& input : network.inputs)
    std::copy(input.values.begin(), input.values.end(), candidate.input(input.name).begin());
  const std::vector<float>& expected = network.output.values;
  const auto answer = candidate.run(expected.size());
  if (!answer) return "doesn't give " + std::to_string(expected.size()) + " finite numbers for it";
  float largest = 1.0f;
  for (const float value : expected) largest = std::max(largest, std::abs(value));
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (std::abs((*answer)[i] - expected[i]) > kSameAnswer * largest) {
      return "computes something else than the file says: " + std::to_string((*answer)[i]) + " as element " +
             std::to_string(i) + " of '" + network.output.name + "', expected " + std::to_string(expected[i]) +
             "; write the network with other operators or another opset_version";
    }
  }
  return "";
}

Result<std::unique_ptr<DepthEncoder>> DepthEncoder::create(const model::Bundle& bundle) {
  try {
    if (bundle.manifest().encoder_kind == "two_look") {
      auto first = load(bundle, "look1.onnx");
      if (!first) return first.failure();
      auto second = load(bundle, "look2.onnx");
      if (!second) return second.failure();
      return std::unique_ptr<DepthEncoder>(
          new TwoLookEncoder(bundle.manifest(), std::move(first).value(), std::move(second).value()));
    }
    auto net = load(bundle, "encoder.onnx");
    if (!net) return net.failure();
    return std::unique_ptr<DepthEncoder>(new PlainEncoder(bundle.manifest(), std::move(net).value()));
  } catch (const std::exception& error) {
    return Error{bundle.folder().string() + ": OpenCV can't set up " + words_of(error)};
  }
}

}  // namespace gatefield::perception
