#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/simulator/referee.h"
#include "common/config/scenario.h"
#include "common/protocol/messages.h"
#include "common/scene/depth_camera.h"
#include "common/scene/world.h"
#include "gatefield/sdk/client.h"

namespace gatefield::simulator {

/// One line of the run: the truth, what was commanded, and what the planner said of itself.
struct Sample {
  double t_s = 0.0;  ///< since the start of the race
  QuadrotorState state;
  sdk::Setpoint setpoint;
  int expected_waypoint = 0;  ///< what the referee waits for, index into the course
  int lap = 0;
  protocol::PlannerHealth health;  ///< of the newest command
  /// Where things are for whoever goes by the state estimate (Estimator::frame()).
  Eigen::Isometry3d X_EW = Eigen::Isometry3d::Identity();
};

/// One depth frame as the sensor gave it, and where from; kept of the approach to a gate for people to look at.
struct Snapshot {
  scene::DepthImage depth;
  CameraModel camera;
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();  ///< true pose of the camera at capture
  int waypoint = 0;                                        ///< the one ahead, index into the course
  scene::Gate gate;                                        ///< that waypoint's gate as it truly stands, x along the way
  double t_s = 0.0;
};

/// Something that the server found wrong with the flight.
struct HeardProblem {
  double race_time_s = 0.0;  ///< when the client heard of it first
  protocol::Problem problem{};
};

/// What became of the session in mid-race.
struct HeardSession {
  double race_time_s = 0.0;  ///< when the client found it
  sdk::SessionChange change;
};

/// Everything a race leaves behind.
struct Report {
  protocol::Timing timing = protocol::Timing::kLockstep;
  std::uint64_t seed = 1;          ///< of the true world
  std::uint64_t planner_seed = 1;  ///< that the planner was told
  Actuation actuation;             ///< how the vehicle was driven, as told
  config::Mismatch mismatch;       ///< what was otherwise in truth
  std::string world;               ///< parts of a harder world, in words; empty: none
  std::string firmware;            ///< in the loop, and its version; empty: none
  Outcome outcome = Outcome::kRunning;
  std::string sentence;
  std::vector<Pass> passes;
  int gates_total = 0;
  std::vector<double> lap_times_s;
  // Of the race until its last gate; samples go on until the vehicle is clear of that.
  double race_time_s = 0.0;
  double top_speed_m_s = 0.0;
  double mean_speed_m_s = 0.0;
  config::HullKind hull = config::HullKind::kDiscs;  ///< by which contact was judged
  double clearance_m = 0.0;                          ///< smallest distance of that hull to a frame
  int missed_gates = 0;  ///< flown past outside their frames, whether they were passed later or not
  int retries = 0;       ///< how often a gate that was passed in the end had been flown past before
  int culprit = -1;      ///< what the race was lost to: index of the waypoint (of the obstacle, when it touched one)
  QuadrotorState end_state;  ///< where it ended
  int contacts = 0;          ///< 0 or 1: the first contact ends the race
  double fallback_s = 0.0;   ///< time flown without a valid plan
  sdk::LinkStatistics link;
  std::optional<double> link_out_at_s;  ///< lockstep: when the outage that was asked for begins
  double control_period_s = 0.0;

  std::uint64_t control_ticks = 0;  ///< control periods flown
  std::uint64_t late_ticks = 0;  ///< real time: control periods that brought no new plan; lockstep: answer did not come
  /// Lockstep: answers that took so long that the server may have given up waiting for the frame, and that say that
  /// something was missing. A race with such a one may not repeat itself.
  std::uint64_t doubtful_ticks = 0;
  std::uint64_t frames_sent = 0;
  std::uint64_t frames_skipped = 0;  ///< real time: the camera thread was still busy
  double wall_s = 0.0;
  // Real time only: the simulator's own 1 kHz loop.
  std::uint64_t loop_steps = 0;
  std::uint64_t loop_misses = 0;  ///< steps begun more than 1 ms late
  double loop_worst_s = 0.0;

  /// By body rates: how the vehicle followed what it was asked for, as the server found it, and what it was told.
  protocol::IdentifiedDrive identified;
  /// What the server found wrong with the flight, each problem once, in the order of hearing.
  std::vector<HeardProblem> problems;
  /// What became of the session while the race was flown; empty: it held.
  std::vector<HeardSession> sessions;

  std::vector<Sample> samples;  ///< every 10 ms
  std::optional<Snapshot> snapshot;
};

/// The problem for people: "at 1.24 s: the velocity sent is not ...".
std::string in_words(const HeardProblem& heard);
/// The same of the session: "at 1.24 s: server gatefield fell silent: no plan for 1.5 s".
std::string in_words(const HeardSession& heard);

/// How a vehicle is driven and what its drive is in truth, for people: "rotor thrusts", "body rates; thrust x 1.1".
std::string in_words(const Actuation& actuation, const config::Mismatch& mismatch);

/// The summary for people, several lines, ending with a line break; problems and what became of the
/// session come right after the result.
std::string summarize(const Report& report);

/// The run as comma-separated values: a header line with names and units, then one line per sample.
/// Columns: t_s, position px_m.., velocity vx_m_s.., attitude qw.., body rates wx_rad_s.., thrust0_n.., command0_n..
/// (what each rotor gives and is asked for), rate0_n_s.., collective_n, wx_asked_rad_s.. (the setpoint), source (plan
/// or fallback), gate, lap, target, field_m (lowest along the plan), latent_age_s, solve_s, effective_samples,
/// degraded. Written whole or not at all. Errors: the sentence names the file.
Status write_csv(const std::filesystem::path& file, const Report& report);

}  // namespace gatefield::simulator
