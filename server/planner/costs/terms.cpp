#include "server/planner/costs/altitude.h"
#include "server/planner/costs/body_rate.h"
#include "server/planner/costs/crossing.h"
#include "server/planner/costs/field_clearance.h"
#include "server/planner/costs/passed_frame.h"
#include "server/planner/costs/progress.h"
#include "server/planner/costs/speed.h"
#include "server/planner/costs/visibility.h"

namespace gatefield::planner {
namespace {

template <typename Term>
std::unique_ptr<const CostTerm> make(const Profile& profile) {
  return std::make_unique<Term>(profile);
}

/// A term and the weight without which it isn't made.
struct Entry {
  double Profile::*weight;
  std::unique_ptr<const CostTerm> (*make)(const Profile&);
};

/// All terms, in the order in which they are added up; a line each.
// clang-format off
constexpr Entry kTerms[] = {
    {&Profile::progress_weight, make<ProgressCost>},
    {&Profile::visibility_weight, make<VisibilityCost>},
    {&Profile::field_weight, make<FieldClearanceCost>},
    {&Profile::crossing_weight, make<CrossingCost>},
    {&Profile::crossing_weight, make<PassedFrameCost>},
    {&Profile::speed_weight, make<SpeedCost>},
    {&Profile::body_rate_weight, make<BodyRateCost>},
    {&Profile::altitude_weight, make<AltitudeCost>},
};
// clang-format on

}  // namespace

std::vector<std::unique_ptr<const CostTerm>> make_terms(const Profile& profile) {
  std::vector<std::unique_ptr<const CostTerm>> terms;
  for (const Entry& entry : kTerms)
    if (profile.*entry.weight > 0) terms.push_back(entry.make(profile));
  return terms;
}

}  // namespace gatefield::planner
