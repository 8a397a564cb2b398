#include "common/config/sensor_noise_file.h"

#include <sstream>

#include "common/base/whole_file.h"
#include "common/config/scenario.pb.h"
#include "common/config/text_file.h"

namespace gatefield::config {

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
  return noise;
}

Result<scene::SensorNoise> load_sensor_noise(const std::filesystem::path& file) {
  SensorNoiseSpec spec;
  if (auto status = load_text(file, &spec); !status) return status.failure();
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
