#include "server/planner/costs/altitude.h"
#include "server/planner/costs/body_rate.h"
#include "server/planner/costs/crossing.h"
#include "server/planner/costs/field_clearance.h"
#include "server/planner/costs/left_frame.h"
#include "server/planner/costs/progress.h"
#include "server/planner/costs/speed.h"
#include "server/planner/costs/visibility.h"

namespace gatefield::planner {

std::vector<std::unique_ptr<const CostTerm>> make_terms(const Profile& profile) {
  std::vector<std::unique_ptr<const CostTerm>> terms;
  if (profile.progress_weight > 0) terms.push_back(std::make_unique<ProgressCost>(profile));
  if (profile.visibility_weight > 0) terms.push_back(std::make_unique<VisibilityCost>(profile));
  if (profile.field_weight > 0) terms.push_back(std::make_unique<FieldClearanceCost>(profile));
  if (profile.crossing_weight > 0) terms.push_back(std::make_unique<CrossingCost>(profile));
  if (profile.crossing_weight > 0) terms.push_back(std::make_unique<LeftFrameCost>(profile));
  if (profile.speed_weight > 0) terms.push_back(std::make_unique<SpeedCost>(profile));
  if (profile.body_rate_weight > 0) terms.push_back(std::make_unique<BodyRateCost>(profile));
  if (profile.altitude_weight > 0) terms.push_back(std::make_unique<AltitudeCost>(profile));
  return terms;
}

}  // namespace gatefield::planner
