#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "client/simulator/hull.h"
#include "client/simulator/plant.h"
#include "common/base/clock.h"
#include "common/scene/world.h"

namespace gatefield::simulator {

enum class Outcome {
  kRunning,
  kFinished,  ///< every gate of every lap, nothing touched
  kTouchedGate,
  kTouchedFloor,
  kTouchedClutter,
  kMissedGate,      ///< flew past the expected gate, outside its frame
  kWrongGate,       ///< flew through another gate than the expected one
  kWrongDirection,  ///< flew through the expected gate from behind
  kOutOfBounds,     ///< left the flight volume
  kTimeLimit,
  kStalled,               ///< did not get on: stood still, or passed no gate for a long time
  kLostControl,           ///< numbers ran away: the state is no longer finite
  kLinkLost,              ///< no server answered any more (told by the simulation)
  kFlightControllerLost,  ///< the firmware in the loop hung or disarmed (told by the simulation)
  kInterrupted,           ///< a person ended it (told by the simulation)
};

/// One word per outcome, for tables: "finished", "touched_gate", ...
const char* name(Outcome outcome) noexcept;

struct Rules {
  int laps = 1;
  Eigen::AlignedBox3d flight_volume;
  Hull hull;
  Stamp time_limit = std::chrono::seconds(120);
  double miss_distance_m = 3.0;   ///< this far beyond the gate's plane, having passed it by, is a miss
  double pass_by_radius_m = 3.0;  ///< crossing the plane this near the axis counts as passing the gate by
  double stall_distance_m = 0.5;  ///< within stall_time, a vehicle that races moves at least this far
  Stamp stall_time = std::chrono::seconds(5);
  Stamp longest_gate_time = std::chrono::seconds(20);  ///< and passes a gate at least this often
  double run_out_m = 0.3;  ///< so far behind the last gate contact is judged, farther where the hull reaches farther
  Stamp run_out_time = std::chrono::seconds(2);  ///< who stays nearer touches nothing any more after this
  double new_attempt_m = 0.5;                    ///< so far before a gate's plane another attempt at it begins
};

/// A gate passed as it should be.
struct Pass {
  Stamp time{0};  ///< since the start of the race
  int lap = 0;
  int waypoint = 0;       ///< which passage of the lap it was
  double offset_m = 0.0;  ///< transverse distance from the gate's axis
  double speed_m_s = 0.0;
  int misses = 0;  ///< how often it had been flown past before, outside its frame
  /// Smallest distance from the hull to this gate's frame from coming near it to leaving it.
  double clearance_m = std::numeric_limits<double>::infinity();
};

/// Judges a race from the true gates and the true path of the vehicle's centre. Pure: no clock, no physics.
///
/// A lap is every passage once, in order; after the last one of a lap comes the first one again, whether the course is
/// closed or open. Per update, the segment from the last to the new position is held against the plane of each gate
/// that stands there (x = 0 in G). Through the opening means transverse distance < inner_half_m: of the expected gate
/// the way the passage goes it is a pass, the other way the wrong direction, of any other gate the wrong gate. Touched
/// is whatever the physics reports, and what the hull touches as it is turned: its sphere the frames (all else is the
/// physics', which has that sphere), its discs frames, obstacles and floor. With the last gate passed the race has its
/// time, and is won once the vehicle is clear of that gate without a contact. After the race is decided, updates change
/// nothing.
///
/// A gate that is flown past outside its frame is missed. Who turns around in time may still pass it, and win; the gate
/// counts as missed all the same.
///
/// Waypoints are numbered by their place in the lap, from 0 (in sentences from 1: "gate 3" is the third to be passed).
/// A gate that several waypoints pass is called by the one that is next when it is that one, else by the one just
/// passed, else by the first. Thread-safe: no.   Real-time safe: yes, but for the sentence.
class Referee {
 public:
  /// @param world     true gates, each once
  /// @param passages  of a lap, at least one; their gates are in the world
  /// @param p_WB      where the vehicle starts
  Referee(scene::World world, std::vector<scene::Passage> passages, const Rules& rules, const Eigen::Vector3d& p_WB);

  /// @param time   since the start of the race, rising
  /// @param state  position, attitude and velocity count
  void update(Stamp time, const QuadrotorState& state, const std::optional<Contact>& contact);

  /// Ends the race from outside (kLinkLost, kFlightControllerLost, kInterrupted); no effect when it is decided already.
  void stop(Outcome outcome, Stamp time) noexcept;

  Outcome outcome() const noexcept { return outcome_; }
  bool decided() const noexcept { return outcome_ != Outcome::kRunning; }
  /// What happened, for people: "finished: 12 of 12 gates in 9.41 s", "touched gate 2 in lap 1 at 3.20 s ...".
  std::string sentence() const;

  const std::vector<Pass>& passes() const noexcept { return passes_; }
  /// Per finished lap; the first one counts from the start of the race.
  std::vector<double> lap_times_s() const;
  int expected_waypoint() const noexcept;  ///< place in the lap of the passage that is next
  /// The waypoint (or the obstacle, when it touched one) that the race was lost to, by index; -1: none was.
  int culprit() const noexcept { return culprit_; }
  int lap() const noexcept;  ///< from 0
  int gates_total() const noexcept;
  /// True from the last passage on: the race has its time, and what is left is to get clear of the gate.
  bool passed_all() const noexcept { return static_cast<int>(passes_.size()) >= gates_total(); }
  int missed_gates() const noexcept;  ///< passages whose gate was flown past, whether it was passed later or not
  int retries() const noexcept;       ///< how often a gate that was passed in the end had been flown past before
  /// Of a race that is won, when the last gate was passed; else of the last update.
  Stamp end_time() const noexcept { return time_; }
  /// Smallest distance so far from the vehicle's hull to a gate's frame, metres (infinite while there was none within 5
  /// m).
  double clearance_m() const noexcept { return clearance_m_; }

 private:
  /// The time that the vehicle spends near a gate.
  struct Encounter {
    double clearance_m = std::numeric_limits<double>::infinity();
    std::optional<std::size_t> pass;  ///< the passage that was made in it
  };

  void judge_planes(Stamp time, const Eigen::Vector3d& p_WB, const Eigen::Vector3d& v_WB);
  void judge_frames(const Eigen::Vector3d& p_WB, const PlacedHull& hull);
  void judge_surroundings(const PlacedHull& hull);
  void judge_run_out(Stamp time, const Eigen::Vector3d& p_WB);
  void judge_progress(Stamp time, const Eigen::Vector3d& p_WB);
  void decide(Outcome outcome, int culprit = -1) noexcept;
  const scene::Passage& expected() const noexcept;
  int waypoint_of(std::size_t gate) const noexcept;

  scene::World world_;
  std::vector<scene::Passage> passages_;
  std::vector<std::vector<scene::Box>> frames_;
  std::vector<Encounter> encounters_;  ///< by gate
  Rules rules_;
  Eigen::Vector3d last_p_WB_;
  Eigen::Vector3d anchor_p_WB_;  ///< where it was when it last moved on
  Stamp anchor_time_{0};
  Stamp last_pass_time_{0};
  Stamp time_{0};
  bool passed_by_ = false;  ///< crossed the expected gate's plane beside it, the way the passage goes
  int misses_ = 0;          ///< of the expected gate
  bool attempt_missed_ = false;
  std::vector<Pass> passes_;
  Outcome outcome_ = Outcome::kRunning;
  int culprit_ = -1;
  double clearance_m_ = std::numeric_limits<double>::infinity();
};

}  // namespace gatefield::simulator
