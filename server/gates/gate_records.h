#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/course/course.h"
#include "server/gates/gate_estimate.h"
#include "server/gates/passages.h"

namespace gatefield::gates {

/// What is remembered of one gate, as a value that crosses threads. Copying it counts one reference and allocates
/// nothing. Whoever drops the last reference to a field frees it: snapshots are filled, and so emptied of what they
/// held before, by the thread that looks; the thread that plans only reads them.
struct RememberedGate {
  bool seen = false;
  Stamp stamp{0};  ///< capture of the field in use
  Eigen::Vector3d center_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_W = Eigen::Vector3d::UnitX();  ///< in the gate's own direction (Passages)
  double center_sigma_m = 1.0;
  double axis_sigma_rad = 1.0;
  std::shared_ptr<const Field> field;  ///< null until seen
};

/// The gates that matter now: what perception hands to the planner.
struct Snapshot {
  std::uint64_t frame = 0;                  ///< sequence of the newest depth frame taken into account (valid or not)
  std::array<std::uint32_t, 2> waypoint{};  ///< the target and the one after it, when the frame was looked at
  std::array<RememberedGate, 2> gates;      ///< theirs
};

/// What is known of a gate before somebody looks for it.
struct Expectation {
  std::uint32_t gate = 0;                              ///< number of the physical gate
  GateShape shape;                                     ///< nominal
  Eigen::Vector3d center_W = Eigen::Vector3d::Zero();  ///< the belief once seen, the nominal waypoint before
  Eigen::Vector3d axis_W = Eigen::Vector3d::UnitX();   ///< likewise, in the waypoint's passing direction
  bool seen = false;
};

/// Memory of the course's gates (paper, "spatial consistency"): one record for each physical gate, whichever waypoints
/// pass it and in whichever direction. Poses come from outside and are filtered over frames; fields too, and only the
/// newest is kept. Never sees a true pose, and knows no network.
/// Thread-safe: no (perception).   Real-time safe: all but the constructor, and as far as freeing a field is.
class GateRecords {
 public:
  explicit GateRecords(const Course& course);

  const Passages& passages() const noexcept { return passages_; }
  Expectation expectation(std::uint32_t waypoint) const noexcept;
  /// The belief once seen, the nominal waypoint before. World frame.
  Eigen::Vector3d expected_center_W(std::uint32_t waypoint) const noexcept { return expectation(waypoint).center_W; }
  bool seen(std::uint32_t waypoint) const noexcept { return record(waypoint).gate.seen; }

  /// Takes in what a frame measured of this waypoint's gate, its axis turned into the passing direction first. On
  /// success the gate's centre, axis, spread and stamp are new; the field is the caller's to set.
  /// @param measurement  in and out
  /// @return where the gate is now believed to be (with a roll as measured); empty: too far from the waypoint, or an
  ///         outlier
  std::optional<Eigen::Isometry3d> take(std::uint32_t waypoint, GateMeasurement* measurement, Stamp capture) noexcept;
  /// What the newest sight says around the gate. @pre take() just succeeded
  void set_field(std::uint32_t waypoint, std::shared_ptr<const Field> field) noexcept {
    record(waypoint).gate.field = std::move(field);
  }

  /// Copies what is known of the two waypoints' gates into the snapshot.
  void snapshot(std::uint32_t target, std::uint32_t next, Snapshot* out) const noexcept;

  /// One gate's whole memory.
  struct Record {
    GateEstimate estimate;  ///< in the gate's own direction
    RememberedGate gate;
  };
  /// By physical gate: to be written down, and set to what was. @pre as many as passages().gates()
  const std::vector<Record>& records() const noexcept { return records_; }
  void restore(std::vector<Record> records) { records_ = std::move(records); }

 private:
  const Record& record(std::uint32_t waypoint) const noexcept { return records_[passages_.gate(waypoint)]; }
  Record& record(std::uint32_t waypoint) noexcept { return records_[passages_.gate(waypoint)]; }

  Passages passages_;
  std::vector<Record> records_;
};

}  // namespace gatefield::gates
