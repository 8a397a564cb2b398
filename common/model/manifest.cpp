#include <google/protobuf/text_format.h>

#include <cmath>
#include <numbers>

#include "common/base/whole_file.h"
#include "common/config/text_file.h"
#include "common/model/bundle.h"
#include "common/model/manifest.pb.h"

namespace gatefield::model {
namespace {

/// Ranges of what a camera and a gate can be; sizes of networks are held against the files by Bundle::read.
Status check(const Manifest& manifest) {
  const auto expect = [](bool good, const char* field, double value, const char* expected) -> Status {
    if (good) return {};
    return Error::invalid(field, std::to_string(value), expected);
  };
  const auto between = [](double value, double low, double high) {
    return std::isfinite(value) && value > low && value < high;
  };
  for (const Status& status : {expect(between(manifest.horizontal_fov_rad, 0.1, std::numbers::pi), "horizontal_fov_rad",
                                      manifest.horizontal_fov_rad, "0.1 to 3.14"),
                               expect(between(manifest.vertical_fov_rad, 0.1, std::numbers::pi), "vertical_fov_rad",
                                      manifest.vertical_fov_rad, "0.1 to 3.14"),
                               expect(between(manifest.min_depth_m, 0.0, 100.0), "min_depth_m", manifest.min_depth_m,
                                      "more than 0, less than 100"),
                               expect(between(manifest.max_depth_m, manifest.min_depth_m, 100.0), "max_depth_m",
                                      manifest.max_depth_m, "more than min_depth_m, less than 100"),
                               expect(between(manifest.cone_angle_rad, 0.0, 1.5), "cone_angle_rad",
                                      manifest.cone_angle_rad, "more than 0, less than 1.5"),
                               expect(between(manifest.gate_inner_half_m, 0.05, 10.0), "gate_inner_half_m",
                                      manifest.gate_inner_half_m, "0.05 to 10"),
                               expect(between(manifest.crop_half_width_m, 0.1, 10.0), "crop_half_width_m",
                                      manifest.crop_half_width_m, "0.1 to 10"),
                               expect(manifest.validity_threshold >= 0.0 && manifest.validity_threshold <= 1.0,
                                      "validity_threshold", manifest.validity_threshold, "0 to 1")}) {
    if (!status.ok()) return status;
  }
  return {};
}

}  // namespace

std::string manifest_text(const Manifest& manifest) {
  proto::Manifest message;
  message.set_name(manifest.name);
  message.set_encoder_kind(manifest.encoder_kind);
  message.set_decoder_kind(manifest.decoder_kind == DecoderKind::kHyper ? proto::Manifest::HYPER
                                                                        : proto::Manifest::CONCATENATED);
  message.set_latent_size(manifest.latent_size);
  message.set_encoding_octaves(manifest.encoding_octaves);
  message.set_position_scale_m(manifest.position_scale_m);
  message.set_image_width_px(manifest.image_width_px);
  message.set_image_height_px(manifest.image_height_px);
  message.set_horizontal_fov_rad(manifest.horizontal_fov_rad);
  message.set_vertical_fov_rad(manifest.vertical_fov_rad);
  message.set_min_depth_m(manifest.min_depth_m);
  message.set_max_depth_m(manifest.max_depth_m);
  message.set_cone_angle_rad(manifest.cone_angle_rad);
  message.set_gate_inner_half_m(manifest.gate_inner_half_m);
  message.set_crop_half_width_m(manifest.crop_half_width_m);
  message.set_crop_size_px(manifest.crop_size_px);
  message.set_validity_threshold(manifest.validity_threshold);
  std::string text;
  google::protobuf::TextFormat::PrintToString(message, &text);  // fails for messages of unknown types only
  return "# Model bundle of Gatefield; the fields are explained in common/model/manifest.proto.\n" + text;
}

Status write_manifest(const Manifest& manifest, const std::filesystem::path& file) {
  return write_file(file, manifest_text(manifest));
}

namespace {

Result<Manifest> manifest_of(const proto::Manifest& message, const std::filesystem::path& file) {
  Manifest manifest;
  manifest.name = message.name();
  manifest.encoder_kind = message.encoder_kind();
  manifest.decoder_kind =
      message.decoder_kind() == proto::Manifest::HYPER ? DecoderKind::kHyper : DecoderKind::kConcatenated;
  manifest.latent_size = message.latent_size();
  manifest.encoding_octaves = message.encoding_octaves();
  manifest.position_scale_m = message.position_scale_m();
  manifest.image_width_px = message.image_width_px();
  manifest.image_height_px = message.image_height_px();
  manifest.horizontal_fov_rad = message.horizontal_fov_rad();
  manifest.vertical_fov_rad = message.vertical_fov_rad();
  manifest.min_depth_m = message.min_depth_m();
  manifest.max_depth_m = message.max_depth_m();
  manifest.cone_angle_rad = message.cone_angle_rad();
  manifest.gate_inner_half_m = message.gate_inner_half_m();
  manifest.crop_half_width_m = message.crop_half_width_m();
  manifest.crop_size_px = message.crop_size_px();
  manifest.validity_threshold = message.validity_threshold();
  if (const Status checked = check(manifest); !checked) return config::in_file(file, checked.failure());
  return manifest;
}

}  // namespace

Result<Manifest> read_manifest(const std::filesystem::path& file) {
  proto::Manifest message;
  if (const Status loaded = config::load_text(file, &message); !loaded) return loaded.failure();
  return manifest_of(message, file);
}

Result<Manifest> parse_manifest(const std::string& text, const std::filesystem::path& file) {
  proto::Manifest message;
  if (const Status parsed = config::parse_text(text, file.string(), &message); !parsed) return parsed.failure();
  return manifest_of(message, file);
}

}  // namespace gatefield::model
