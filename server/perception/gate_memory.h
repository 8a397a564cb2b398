#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/clock.h"
#include "common/protocol/messages.h"
#include "server/kernels/decoder/decoder.h"
#include "server/perception/depth_encoder.h"
#include "server/planner/field.h"

namespace gatefield::perception {

/// The learned field in the world frame: a decoder with its latent and capture pose folded in.
class DecodedField final : public planner::Field {
 public:
  kernels::FoldedDecoder decoder;
  void evaluate(std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
                std::span<float> sdf_m) const noexcept override;
};

/// What the memory knows of one gate, as a value that crosses threads (copying reuses memory: no allocation once warm).
struct RememberedGate {
  bool seen = false;
  Stamp stamp{0};  ///< capture of the latent in use
  Eigen::Vector3d center_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_W = Eigen::Vector3d::UnitX();
  double center_sigma_m = 1.0;
  double axis_sigma_rad = 1.0;
  DecodedField field;
};

/// The gates that matter now: what perception hands to the planner.
struct MemorySnapshot {
  std::uint64_t frame = 0;   ///< sequence of the newest depth frame taken into account (valid or not)
  std::uint32_t target = 0;  ///< waypoint index of gates[0]; gates[1] is the one after it
  std::array<RememberedGate, 2> gates;
};

/// Gate memory (paper, "spatial consistency"): per waypoint the newest valid latent with its capture pose, its age, and
/// centre and axis of the opening, fitted to decoder values and filtered over frames. Never sees a true pose.
/// Thread-safe: no (perception thread).   Real-time safe: bounded, allocation only when a gate is first seen.
class GateMemory {
 public:
  GateMemory(const model::Bundle& bundle, const protocol::Course& course);

  /// Where the encoder should look for this waypoint's gate: the belief once seen, the nominal waypoint before. World
  /// frame.
  Eigen::Vector3d expected_center_W(std::uint32_t waypoint) const noexcept;
  bool seen(std::uint32_t waypoint) const noexcept;

  enum class Outcome { kTaken, kNotValid, kPoorFit, kOutlier };
  /// Takes in what a frame said of this waypoint's gate. @param X_WC camera pose at the capture
  Outcome observe(std::uint32_t waypoint, const Encoding& encoding, const Eigen::Isometry3d& X_WC, Stamp capture);

  /// Copies what is known of the two gates into the snapshot.
  void snapshot(std::uint32_t target, std::uint32_t next, MemorySnapshot* out) const;

 private:
  struct Entry;
  const model::Bundle* bundle_;
  protocol::Course course_;
  std::vector<std::shared_ptr<Entry>> entries_;
};

}  // namespace gatefield::perception
