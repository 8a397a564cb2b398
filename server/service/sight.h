#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/geometry/camera.h"
#include "common/protocol/messages.h"
#include "server/perception/depth_encoder.h"
#include "server/perception/gate_memory.h"

namespace gatefield::service {

/// The gate memory as a session uses it; tests put a simple one in. See perception::GateMemory for what each call
/// means. Thread-safe: no (perception).
class Memory {
 public:
  virtual ~Memory() = default;
  virtual Eigen::Vector3d expected_center_W(std::uint32_t waypoint) const noexcept = 0;
  virtual bool seen(std::uint32_t waypoint) const noexcept = 0;
  virtual perception::GateMemory::Outcome observe(std::uint32_t waypoint, const perception::Encoding& encoding,
                                                  const Eigen::Isometry3d& X_WC, Stamp capture) = 0;
  virtual void snapshot(std::uint32_t target, std::uint32_t next, perception::MemorySnapshot* out) const = 0;
};

/// The product's memory. See perception::GateMemory for the parameters.
std::unique_ptr<Memory> make_memory(const model::Bundle& bundle,
                                    std::shared_ptr<const kernels::PreparedDecoder> decoder,
                                    const Course& course);

/// Float metres from what came over the wire. Values that are not finite, nearer than the camera's least depth or
/// farther than its largest become 0 (no return).
struct DecodedDepth {
  std::size_t returns = 0;    ///< pixels with a depth within the camera's range
  std::size_t saturated = 0;  ///< pixels at the encoding's largest value or beyond the camera's range
};
/// @pre pixels.size() == width * height * bytes_per_pixel(encoding)
/// @param depth_m  out, resized to width * height
DecodedDepth decode_depth(std::span<const std::uint8_t> pixels, protocol::DepthEncoding encoding,
                          const CameraModel& camera, std::vector<float>* depth_m);

struct SightOptions {
  double validity_threshold = 0.5;  ///< manifest: an encoding below it shows no gate
  /// A second try without prior makes sense for encoders that take one (manifest: "two_look").
  bool takes_prior = true;
  double first_sight_distance_m = 12.0;    ///< look for a gate that was never seen within this distance
  double first_sight_tolerance_m = 1.8;    ///< a gate found without prior this near its waypoint is that gate
  double view_margin_px_per_width = 0.15;  ///< expected centres this far outside the image are still looked for
};

/// The perception step of one vehicle: from a depth frame and the pose at its capture to what the memory knows.
/// For the target and the gate after it, when it should be in view: encode with the expected centre as prior; when that
/// shows nothing and the target was never seen, encode once more without, and take that only near the waypoint.
/// Thread-safe: no (one perception thread at a time).   Real-time safe: no (OpenCV allocates).
class Sight {
 public:
  Sight(const CameraModel& camera, const Course& course, std::unique_ptr<Memory> memory, const SightOptions& options);

  enum class Outcome {
    kLooked,     ///< gates were looked for (and perhaps found)
    kEmpty,      ///< not one pixel has a return: the sensor is blind, covered or in the open
    kSaturated,  ///< every return is beyond the range or at the encoding's end: nothing to see
  };
  /// @param X_WB     pose of the body at the capture
  /// @param target   waypoint to pass now; @param next the one after it (the target itself when there is none)
  Outcome look(std::span<const std::uint8_t> pixels, protocol::DepthEncoding encoding, Stamp capture,
               const Eigen::Isometry3d& X_WB, std::uint32_t target, std::uint32_t next,
               perception::DepthEncoder& encoder);

  const Memory& memory() const noexcept { return *memory_; }

 private:
  void look_for(std::uint32_t waypoint, bool is_target, const Eigen::Isometry3d& X_WC, Stamp capture,
                perception::DepthEncoder& encoder);

  CameraModel camera_;
  Course course_;
  std::unique_ptr<Memory> memory_;
  SightOptions options_;
  std::vector<float> depth_m_;
};

}  // namespace gatefield::service
