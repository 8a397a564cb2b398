#include "server/planner/profile_file.h"

#include "common/config/text_file.h"
#include "server/planner/profile.pb.h"
#include "server/planner/profile_fields.h"

namespace gatefield::planner {

Result<Profile> load_profile(const std::filesystem::path& file) {
  ProfileConfig config;
  if (Status status = config::load_text(file, &config); !status) return Error{status.error()};

  Profile profile;
  profile.name = config.name();
  const auto* schema = config.GetDescriptor();
  const auto* reflection = config.GetReflection();
  for (const IntegerField& field : kIntegerFields)
    if (const auto* entry = schema->FindFieldByName(field.name); reflection->HasField(config, entry))
      profile.*field.member = reflection->GetInt32(config, entry);
  for (const NumberField& field : kNumberFields)
    if (const auto* entry = schema->FindFieldByName(field.name); reflection->HasField(config, entry))
      profile.*field.member = reflection->GetDouble(config, entry);
  for (const SwitchField& field : kSwitchFields)
    if (const auto* entry = schema->FindFieldByName(field.name); reflection->HasField(config, entry))
      profile.*field.member = reflection->GetBool(config, entry);
  if (config.has_progress_metric())
    profile.progress_metric =
        config.progress_metric() == SQUARED_DISTANCE ? ProgressMetric::kSquaredDistance : ProgressMetric::kDistance;
  if (config.noise_sigma_n_s_size() != 0) {
    if (config.noise_sigma_n_s_size() != static_cast<int>(profile.noise_sigma_n_s.size()))
      return Error{file.string() + ": noise_sigma_n_s has " + std::to_string(config.noise_sigma_n_s_size()) +
                   " entries, expected 4 (collective, roll, pitch, yaw)"};
    for (std::size_t i = 0; i < profile.noise_sigma_n_s.size(); ++i)
      profile.noise_sigma_n_s[i] = config.noise_sigma_n_s(static_cast<int>(i));
  }
  if (Status status = validate(profile); !status) return Error{file.string() + ": " + status.error()};
  return profile;
}

}  // namespace gatefield::planner
