#include "client/bridge/sources/outside_depth.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

#include "common/base/text.h"

namespace gatefield::bridge::sources {
namespace {

constexpr double kMillimetre_m = 0.001;

/// Reads each pixel of an image, with its bytes in this machine's order, row by row.
/// @tparam Word  as wide as a pixel
template <typename Word, typename Take>
void each_pixel(const ros::Image& image, Take&& take) {
  const bool swaps = image.big_endian != (std::endian::native == std::endian::big);
  for (std::uint32_t v = 0; v < image.height; ++v) {
    const std::uint8_t* row = image.data.data() + std::size_t{v} * image.step_bytes;
    for (std::uint32_t u = 0; u < image.width; ++u, row += sizeof(Word)) {
      std::array<std::uint8_t, sizeof(Word)> bytes{};
      std::memcpy(bytes.data(), row, sizeof(Word));
      if (swaps) std::reverse(bytes.begin(), bytes.end());
      take(std::bit_cast<Word>(bytes));
    }
  }
}

/// The alternative, with its memory of earlier rounds where it has been that one.
template <typename Vector, typename Variant>
Vector& emptied(Variant* pixels, std::size_t size) {
  if (!std::holds_alternative<Vector>(*pixels)) pixels->template emplace<Vector>();
  auto& vector = std::get<Vector>(*pixels);
  vector.clear();
  vector.reserve(size);
  return vector;
}

}  // namespace

OutsideDepth::OutsideDepth(const DepthOptions& options, const CameraModel& camera)
    : camera_(camera), admission_(options.time) {}

void OutsideDepth::on_image(const Moment& moment, ros::Image& image, std::uint64_t program) {
  if (std::cmp_not_equal(image.width, camera_.width_px) || std::cmp_not_equal(image.height, camera_.height_px)) {
    const auto size = [](auto width, auto height) { return text(width) + " x " + text(height); };
    admission_.refuse(Refusal::kSize, Error::invalid("image", size(image.width, image.height),
                                                     size(camera_.width_px, camera_.height_px) +
                                                         ", the camera's size in the vehicle file"));
    return;
  }
  const auto capture = admission_.admit(moment, image.header.stamp, program);
  if (!capture) return;
  Frame& frame = mailbox_.slot();
  frame.capture = *capture;
  std::swap(frame.image, image);
  mailbox_.publish();
  doorbell_.ring();
}

std::optional<flight::DepthFrame> OutsideDepth::next(std::chrono::nanoseconds timeout) {
  if (!mailbox_.fresh()) (void)doorbell_.wait_for(timeout);
  const Frame* frame = mailbox_.read();
  if (frame == nullptr) return std::nullopt;
  const ros::Image& image = frame->image;
  const std::size_t size = std::size_t{image.width} * image.height;
  const bool counts_millimetres = std::abs(camera_.metres_per_count - kMillimetre_m) < 1e-9;
  if (ros::pixel_bytes(image.encoding) == sizeof(float)) {
    auto& metres = emptied<std::vector<float>>(&pixels_, size);
    each_pixel<float>(image, [&](float depth) { metres.push_back(std::isfinite(depth) && depth > 0 ? depth : 0.0F); });
  } else if (counts_millimetres) {
    auto& counts = emptied<std::vector<std::uint16_t>>(&pixels_, size);
    each_pixel<std::uint16_t>(image, [&](std::uint16_t count) { counts.push_back(count); });
  } else {
    auto& metres = emptied<std::vector<float>>(&pixels_, size);
    each_pixel<std::uint16_t>(
        image, [&](std::uint16_t count) { metres.push_back(static_cast<float>(kMillimetre_m * count)); });
  }
  flight::DepthFrame given;
  given.capture = frame->capture;
  std::visit([&](const auto& pixels) { given.pixels = std::span(pixels); }, pixels_);
  return given;
}

}  // namespace gatefield::bridge::sources
