#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/clock.h"
#include "common/protocol/messages.h"
#include "server/kernels/decoder/decoder.h"
#include "server/perception/depth_encoder.h"
#include "server/perception/gate_estimate.h"
#include "server/planner/field.h"

namespace gatefield::perception {

/// The learned field in the world frame: a decoder with its latent and capture pose folded in.
class DecodedField final : public planner::Field {
 public:
  kernels::FoldedDecoder decoder;
  /// Speaks in the decoder's place. Evaluation programs put it in, to compare with; gatefield-server has none.
  std::shared_ptr<const planner::Field> stand_in;
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

/// The part of the gate memory that does not ask where a pose comes from: per waypoint the filtered pose of its gate.
/// Thread-safe: no.   Real-time safe: bounded, allocation only in the constructor.
class GateRecords {
 public:
  explicit GateRecords(const Course& course);
  ~GateRecords();

  /// As the course has it: centre and passing direction.
  const planner::GateBelief& nominal(std::uint32_t waypoint) const noexcept;
  /// The belief once seen, the nominal waypoint before. World frame.
  Eigen::Vector3d expected_center_W(std::uint32_t waypoint) const noexcept;
  bool seen(std::uint32_t waypoint) const noexcept;

  /// Takes in what a frame measured, its axis turned into the course's passing direction first. On success the gate's
  /// centre, axis, spread and stamp are new, and its field is the caller's to set.
  /// @param measurement  in and out
  /// @return where the gate is now believed to be (with a roll as measured); empty: too far from the waypoint, or an
  ///         outlier
  std::optional<Eigen::Isometry3d> take(std::uint32_t waypoint, GateMeasurement* measurement, Stamp capture) noexcept;

  RememberedGate& gate(std::uint32_t waypoint) noexcept;
  /// Copies what is known of the two gates into the snapshot.
  void snapshot(std::uint32_t target, std::uint32_t next, MemorySnapshot* out) const;

 private:
  struct Record;
  std::vector<std::unique_ptr<Record>> records_;
};

/// Gate memory (paper, "spatial consistency"): per waypoint the newest valid latent with its capture pose, its age, and
/// centre and axis of the opening, fitted to decoder values and filtered over frames. Never sees a true pose.
/// Thread-safe: no (perception thread).   Real-time safe: bounded, allocation only when a gate is first seen.
class GateMemory {
 public:
  /// @param bundle   outlives this
  /// @param decoder  the bundle's, prepared by the back end that computes the fields
  GateMemory(const model::Bundle& bundle, std::shared_ptr<const kernels::PreparedDecoder> decoder,
             const Course& course);

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
  const model::Bundle* bundle_;
  std::shared_ptr<const kernels::PreparedDecoder> decoder_;
  std::vector<GateShape> shapes_;  ///< nominal, of each waypoint's gate
  GateRecords records_;
  DecodedField raw_;  ///< scratch: the newest latent as captured, before it is aligned with the estimate
};

}  // namespace gatefield::perception
