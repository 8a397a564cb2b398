#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "client/race/cause.h"
#include "client/race/trial.h"
#include "client/simulator/run_log.h"
#include "common/trace/trace.h"

namespace gatefield::race {

/// Why a race was lost.
enum class Failure {
  kNone,          ///< won
  kTargetGate,    ///< touched the frame of the gate that was next, or of the one just passed
  kOtherObject,   ///< touched another gate, the floor or an obstacle
  kLeftCourse,    ///< left the flight volume
  kPassedBeside,  ///< flew past the gate, outside it
  kWrongGate,     ///< through another gate than the next, or from behind
  kTimeout,       ///< ran out of time, or did not get on
  kLostControl,   ///< the state ran away
  kLostServer,    ///< no answers, in several attempts
};
inline constexpr Failure kFailures[] = {Failure::kTargetGate,   Failure::kOtherObject, Failure::kLeftCourse,
                                        Failure::kPassedBeside, Failure::kWrongGate,   Failure::kTimeout,
                                        Failure::kLostControl,  Failure::kLostServer};

/// "won", "target_gate", ...: for tables of programs.
const char* name(Failure failure) noexcept;
/// "target gate's frame", ...: for people.
const char* words(Failure failure) noexcept;
/// @pre the race is over, and no person ended it
Failure failure_of(const simulator::Report& report) noexcept;

/// What is kept of a trial: one line of trials.csv.
struct TrialResult {
  std::string cell;
  double speed_m_s = 0.0;          ///< the limit
  std::uint64_t seed = 1;          ///< of the true world
  std::uint64_t planner_seed = 1;  ///< of the planner's sampling
  Failure failure = Failure::kNone;
  Cause cause = Cause::kNone;
  double belief_error_m = 0.0;  ///< of the gate's centre before the end of a lost race, see Diagnosis; NaN: none
  double belief_turn_deg = 0.0;
  double seen_before_s = 0.0;
  std::string outcome;  ///< the referee's word
  int gates_passed = 0, gates_total = 0;
  double time_s = 0.0;  ///< of the race
  double top_speed_m_s = 0.0, mean_speed_m_s = 0.0;
  double median_lap_s = 0.0, slowest_lap_s = 0.0;  ///< of the laps finished; NaN: none
  int missed = 0;                                  ///< gates flown past outside their frames, passed later or not
  int retries = 0;                                 ///< how often gates that were passed had been flown past before
  std::string hull;                                ///< by which contact was judged: "discs" or "sphere"
  double clearance_m = 0.0;                        ///< smallest distance of the hull to a frame; NaN: never near one
  std::vector<double> clearances_m;                ///< at each gate passed, to its frame
  int gate = 0;                                    ///< where it ended: the next gate, from 1
  int lap = 0;                                     ///< from 1
  Eigen::Vector3d end_p_W = Eigen::Vector3d::Zero();
  std::uint64_t frame = 0;  ///< sequence of the depth frame that was sent last
  double round_trip_p50_ms = 0.0, round_trip_p99_ms = 0.0, solve_p50_ms = 0.0;  ///< wall clock
  std::uint64_t flight = 0;  ///< fingerprint of the path flown: the same flight has the same
  std::uint64_t setup = 0;   ///< fingerprint of all that decides a flight but cell, speed and seed
  std::uint64_t model = 0;   ///< hash that the server told
  std::string profile, isa, host;
  int attempts = 1;
  double wall_s = 0.0;
  std::string sentence;   ///< what happened, for people
  std::string reproduce;  ///< the command line that flies this trial, to be run in the results' folder

  bool won() const noexcept { return failure == Failure::kNone; }
};

/// @param report  of a race that is over
/// @param trace   what the planner believed; empty: not recorded
TrialResult to_result(const Trial& trial, const simulator::Report& report, const std::vector<trace::Step>& trace = {});

/// The path, bit by bit: state and time of every sample, and the passes; of a race that is won, up to its last gate.
std::uint64_t fingerprint(const simulator::Report& report) noexcept;

/// gatefield-sim with all that this trial needs; scenarios are those that save_campaign() leaves.
std::string reproduce_command(const Trial& trial);

/// What tells trials apart: the name() of the trial that gave this result.
std::string trial_name(const TrialResult& result);

}  // namespace gatefield::race
