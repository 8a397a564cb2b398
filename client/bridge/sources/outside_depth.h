#pragma once

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "client/bridge/sources/admission.h"
#include "client/bridge/sources/options.h"
#include "client/flight/doorbell.h"
#include "client/flight/ports.h"
#include "common/base/mailbox.h"
#include "common/geometry/camera.h"
#include "common/protocol/ros.h"

namespace gatefield::bridge::sources {

/// Makes frames of depth images. The camera, with its mounting, is the vehicle file's; an image of another size is
/// refused. Millimetres go on as they are where the camera counts in them, and as metres where it does not; of metres
/// what is not finite or not in front of the camera becomes 0, "no return".
/// Thread-safe: messages come on one thread at a time, next() is called on another.
class OutsideDepth final : public flight::DepthSource {
 public:
  /// @pre validate(options), validate(camera)
  OutsideDepth(const DepthOptions& options, const CameraModel& camera);

  /// @pre ros::validate(image)
  /// Takes the image, and leaves an earlier one's memory in it.
  void on_image(const Moment& moment, ros::Image& image, std::uint64_t program);
  void on_rejected(const Error& why) { admission_.refuse(Refusal::kMalformed, why); }

  std::optional<flight::DepthFrame> next(std::chrono::nanoseconds timeout) override;

  const Admission& admission() const noexcept { return admission_; }

 private:
  struct Frame {
    Stamp capture{0};
    ros::Image image;
  };

  const CameraModel camera_;
  Admission admission_;
  Mailbox<Frame> mailbox_;
  flight::Doorbell doorbell_;
  std::variant<std::vector<std::uint16_t>, std::vector<float>> pixels_;  // of the frame that was given last
};

}  // namespace gatefield::bridge::sources
