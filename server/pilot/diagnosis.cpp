#include "server/pilot/diagnosis.h"

#include <algorithm>

namespace gatefield::pilot {

using protocol::bit;
using protocol::Problem;
using protocol::Problems;
namespace {

/// Mistakes in states that put every image elsewhere, and what images then seem to say.
constexpr Problems kPosesWrong = bit(Problem::kStatesLookNed) | bit(Problem::kQuaternionLooksWFirst) |
                                 bit(Problem::kVelocityLooksBodyFrame) | bit(Problem::kRatesLookWorldFrame);
constexpr Problems kOfImages = bit(Problem::kMountingLooksWrong) | bit(Problem::kDepthUnitLooksWrong);

}  // namespace

void Diagnosis::begin_line() noexcept {
  until_.fill(Stamp{0});
  last_ = Stamp{-1};
  expected_for_ = Stamp{0};
  starving_since_ = sensing_since_ = Stamp{-1};
}

Problems Diagnosis::step(const StepFindings& findings) noexcept {
  const Stamp now = findings.stamp;
  if (now < last_) begin_line();
  const Stamp passed = last_ < Stamp{0} ? Stamp{0} : std::min(now - last_, kLongestStep);
  last_ = now;

  Problems found = findings.withheld | findings.contradictions;
  const auto when = [&](bool condition, Problem problem) {
    if (condition) found |= bit(problem);
  };
  when(findings.depth_missing && !findings.course_done, Problem::kDepthMissing);
  when(findings.states_missing, Problem::kStatesMissing);
  when(findings.states_rejected, Problem::kStatesRejected);
  when(findings.frames_rejected, Problem::kFramesRejected);
  when(findings.stamps_jumped, Problem::kStampsJump);
  when(findings.delay_long, Problem::kDelayLong);
  when(findings.deadlines_missed > deadlines_missed_, Problem::kDeadlinesMissed);
  deadlines_missed_ = findings.deadlines_missed;

  const bool starving = findings.effective_samples > 0.0 && findings.effective_samples <= kFewSamples;
  if (!starving)
    starving_since_ = Stamp{-1};
  else if (starving_since_ < Stamp{0})
    starving_since_ = now;
  when(starving && now - starving_since_ >= kStarving, Problem::kFewEffectiveSamples);

  if (findings.sensing == 0)
    sensing_since_ = Stamp{-1};
  else if (sensing_since_ < Stamp{0})
    sensing_since_ = now;
  if (findings.sensing != 0 && now - sensing_since_ >= kSensing) found |= findings.sensing;

  // Seen, the time begins anew with the next gate; out of view, it stands still.
  if (findings.gate_seen || findings.course_done)
    expected_for_ = Stamp{0};
  else if (findings.gate_expected)
    expected_for_ += passed;

  Problems told = 0;
  for (std::size_t i = 0; i < until_.size(); ++i) {
    if (found >> i & 1) until_[i] = now + kStays;
    if (until_[i] > now) told |= Problems{1} << i;
  }
  if (told & kPosesWrong) told &= ~kOfImages;
  if (expected_for_ >= kSeeing) told |= bit(Problem::kGateNotSeen);
  return told;
}

}  // namespace gatefield::pilot
