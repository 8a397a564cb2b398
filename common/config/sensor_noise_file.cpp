#include "common/config/sensor_noise_file.h"

#include <algorithm>
#include <sstream>

#include "common/base/whole_file.h"
#include "common/config/scenario.pb.h"
#include "common/config/text_file.h"

namespace gatefield::config {
namespace {

scene::ActiveStereoNoise to_active_stereo(const ActiveStereoSpec& spec) {
  scene::ActiveStereoNoise noise;
  const auto& reflection = *ActiveStereoSpec::GetReflection();
  for (const scene::ActiveStereoField& field : scene::active_stereo_fields()) {
    const auto* described = ActiveStereoSpec::GetDescriptor()->FindFieldByName(field.name);
    if (reflection.HasField(spec, described)) noise.*field.value = reflection.GetDouble(spec, described);
  }
  if (spec.cloud_size() > 0) noise.clouds.clear();
  for (const auto& cloud : spec.cloud()) noise.clouds.push_back({cloud.at_m(), cloud.small_px(), cloud.large_px()});
  return noise;
}

}  // namespace

Status validate(const SensorNoiseSpec& spec) {
  if (!spec.has_active_stereo()) return {};
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  SensorNoiseSpec::GetReflection()->ListFields(spec, &fields);
  for (const auto* field : fields) {
    if (field->name() == "active_stereo" || field->name() == "scale") continue;
    return Error{"active_stereo and " + std::string(field->name()) +
                     " are both set, expected no field beside active_stereo but scale: it replaces them",
                 ErrorCode::kInvalid, "noise." + std::string(field->name())};
  }
  return {};
}

scene::SensorNoise to_sensor_noise(const SensorNoiseSpec& spec) {
  scene::SensorNoise noise;
  if (spec.has_baseline_m()) noise.baseline_m = spec.baseline_m();
  if (spec.has_disparity_noise_px()) noise.disparity_noise_px = spec.disparity_noise_px();
  if (spec.has_disparity_step_px()) noise.disparity_step_px = spec.disparity_step_px();
  if (spec.has_bleed_probability()) noise.bleed_probability = spec.bleed_probability();
  if (spec.has_shadow_probability()) noise.shadow_probability = spec.shadow_probability();
  if (spec.has_hole_rate_per_image()) noise.hole_rate_per_image = spec.hole_rate_per_image();
  if (spec.has_hole_radius_px()) noise.hole_radius_px = spec.hole_radius_px();
  if (spec.has_speckle_probability()) noise.speckle_probability = spec.speckle_probability();
  if (spec.has_incidence_loss()) noise.incidence_loss = spec.incidence_loss();
  if (spec.has_reflectance_loss()) noise.reflectance_loss = spec.reflectance_loss();
  if (spec.has_scale()) noise.scale = spec.scale();
  if (spec.has_active_stereo()) noise.active_stereo = to_active_stereo(spec.active_stereo());
  return noise;
}

Result<scene::SensorNoise> load_sensor_noise(const std::filesystem::path& file) {
  SensorNoiseSpec spec;
  if (auto status = load_text(file, &spec); !status) return status.failure();
  if (auto status = validate(spec); !status) return in_file(file, status.failure());
  const scene::SensorNoise noise = to_sensor_noise(spec);
  if (auto status = validate(noise); !status) return in_file(file, status.failure());
  return noise;
}

Status save_sensor_noise(const std::filesystem::path& file, const scene::SensorNoise& noise,
                         const std::vector<NoiseRemark>& remarks) {
  std::ostringstream text;
  text.precision(6);
  const auto remark = [&](const std::string& field) {
    for (const NoiseRemark& each : remarks) {
      if (each.field == field) text << "# " << each.text << '\n';
    }
  };
  const auto put = [&](const char* field, double value) {
    remark(field);
    text << field << ": " << value << '\n';
  };
  remark("");
  if (noise.active_stereo) {
    const scene::ActiveStereoNoise& stereo = *noise.active_stereo;
    put("scale", noise.scale);
    text << "active_stereo {\n";
    const auto told = [&](const std::string& field) {
      return std::ranges::any_of(remarks, [&](const NoiseRemark& each) { return each.field == field; });
    };
    for (const scene::ActiveStereoField& field : scene::active_stereo_fields()) {
      if (told(field.name)) {
        remark(field.name);
      } else {
        text << "# " << field.does << " (" << field.source << ")\n";
      }
      text << field.name << ": " << stereo.*field.value << '\n';
    }
    remark("cloud");
    for (const auto& cloud : stereo.clouds)
      text << "cloud { at_m: " << cloud.at_m << " small_px: " << cloud.small_px << " large_px: " << cloud.large_px
           << " }\n";
    text << "}\n";
    return write_file(file, text.str());
  }
  put("baseline_m", noise.baseline_m);
  put("disparity_noise_px", noise.disparity_noise_px);
  put("disparity_step_px", noise.disparity_step_px);
  put("bleed_probability", noise.bleed_probability);
  put("shadow_probability", noise.shadow_probability);
  put("hole_rate_per_image", noise.hole_rate_per_image);
  put("hole_radius_px", noise.hole_radius_px);
  put("speckle_probability", noise.speckle_probability);
  put("incidence_loss", noise.incidence_loss);
  put("reflectance_loss", noise.reflectance_loss);
  put("scale", noise.scale);
  return write_file(file, text.str());
}

}  // namespace gatefield::config
