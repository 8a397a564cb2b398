#pragma once

#include <span>
#include <string_view>

#include "common/base/result.h"
#include "common/model/bundle.h"
#include "common/model/two_look.h"

/// Which networks belong together. Everything that differs between trained models stands in a Design; networks.cpp
/// builds from it, export.cpp writes from it, a checkpoint says its name.
namespace gatefield::training {

inline constexpr int kCropFeatureSize = 24;  ///< rows and columns after the second look's first layer

enum class EncoderKind {
  kPlain,    ///< one look at the whole image
  kTwoLook,  ///< a coarse centre from the whole image, then a crop in metres around it
};

struct Design {
  std::string_view name;
  std::string_view says;  ///< one line for people
  EncoderKind encoder = EncoderKind::kTwoLook;
  model::DecoderKind decoder = model::DecoderKind::kHyper;
  int latent_z = 128;  ///< z, without the centre
  int crop_size = 96;  ///< two looks: samples along the crop's side, a multiple of kCropFeatureSize

  bool plain() const noexcept { return encoder == EncoderKind::kPlain; }
  /// The hyper decoder works on p - centre, so the encoder tells a centre: two looks as a correction, plain outright.
  bool has_center() const noexcept { return decoder == model::DecoderKind::kHyper; }
  /// What the decoder is conditioned on.
  int latent_size() const noexcept { return latent_z + (has_center() ? 3 : 0); }
  /// Of the validity in the loss. Two looks need more of it: a crop that shows no gate looks much like one that does.
  double validity_weight() const noexcept { return plain() ? 0.2 : 0.5; }
  model::CropShape crop() const noexcept {
    return {.half_width_m = model::CropShape{}.half_width_m, .size = crop_size};
  }
};

/// All designs, the first being the default.
std::span<const Design> designs() noexcept;

/// Error: no such design; names those that there are.
Result<Design> find_design(std::string_view name);

}  // namespace gatefield::training
