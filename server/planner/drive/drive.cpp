#include "server/planner/drive/drive.h"

namespace gatefield::planner {

std::unique_ptr<Drive> Drive::make(const Profile& profile, const QuadrotorModel& model, const Actuation& actuation) {
  if (actuation.kind == Actuation::Kind::kBodyRates) return make_rate_drive(profile, model, actuation);
  return make_rotor_drive(profile, model);
}

}  // namespace gatefield::planner
