#pragma once

#include <array>
#include <cstdint>

#include "common/base/clock.h"
#include "common/protocol/problems.h"

namespace gatefield::pilot {

/// What a control step saw, as far as it tells how the flight is going. Times are of the client's clock.
struct StepFindings {
  Stamp stamp{0};                         ///< of the newest state
  double effective_samples = 0.0;         ///< of the plan; 0: no plan was made
  bool gate_expected = false;             ///< the target should be in the camera's view, near enough to be seen
  bool gate_seen = false;                 ///< and was seen once at least
  bool course_done = false;               ///< nothing is expected any more
  bool depth_missing = false;             ///< no usable depth frame for long
  bool states_missing = false;            ///< flying on prediction, because states are late
  bool states_rejected = false;           ///< the newest states were refused, or one that leapt
  bool frames_rejected = false;           ///< the newest depth frames were refused
  bool stamps_jumped = false;             ///< a sample lay off the line of the others since the last step
  bool delay_long = false;                ///< the delay is as long as is made up for, or longer
  std::uint64_t deadlines_missed = 0;     ///< since the session began
  protocol::Problems withheld = 0;        ///< why the plan was not sent
  protocol::Problems contradictions = 0;  ///< of StateWatch
  protocol::Problems sensing = 0;         ///< what perception found wrong
};

/// Turns findings of steps into what is told: a problem that has to last before it counts is told when it has, and one
/// that comes and goes stays long enough for a person to read it.
///                          is told                                            stays
///   kGateNotSeen           after kSeeing in which the gate was expected       until the gate is seen
///   kFewEffectiveSamples   after kStarving without a break                    kStays after it was last found
///   of images (sensing)    when found for kSensing                            kStays after it was last found
///   others                 at once                                            kStays after it was last found
/// What images say is not told beside a mistake in the states that puts every image elsewhere: where both are found,
/// the states' comes within kSensing.
/// Thread-safe: no (control step).   Real-time safe: yes.
class Diagnosis {
 public:
  static constexpr Stamp kSeeing = std::chrono::seconds(1);
  static constexpr Stamp kStarving = std::chrono::seconds(1);
  static constexpr Stamp kSensing = std::chrono::milliseconds(250);
  static constexpr Stamp kStays = std::chrono::seconds(1);
  static constexpr Stamp kLongestStep = std::chrono::milliseconds(100);  ///< of a wait: what an outage adds at most
  static constexpr double kFewSamples = 1.5;

  /// @return what is wrong now, for PlannerHealth::problems. Stamps that go back begin the waits anew.
  protocol::Problems step(const StepFindings& findings) noexcept;
  /// The stamps to come have nothing to do with those that came: begins anew but for what was counted.
  void begin_line() noexcept;

 private:
  std::array<Stamp, protocol::kProblems> until_{};
  Stamp last_{-1};
  Stamp expected_for_{0};     ///< how long the target has been expected in view and not been seen
  Stamp starving_since_{-1};  ///< -1: the plan is fed by enough rollouts
  Stamp sensing_since_{-1};   ///< -1: images say nothing
  std::uint64_t deadlines_missed_ = 0;
};

}  // namespace gatefield::pilot
