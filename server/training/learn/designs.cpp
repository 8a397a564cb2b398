#include "server/training/learn/designs.h"

#include <algorithm>
#include <array>

namespace gatefield::training {
namespace {

using model::DecoderKind;

constexpr std::array kDesigns = {
    Design{"two-look", "two looks, crop of 96 x 96 samples, hyper decoder, z of 128", EncoderKind::kTwoLook,
           DecoderKind::kHyper, 128, 96},
    Design{"two-look-z64", "the same with z of 64", EncoderKind::kTwoLook, DecoderKind::kHyper, 64, 96},
    Design{"two-look-48", "two looks, crop of 48 x 48 samples, hyper decoder, z of 128", EncoderKind::kTwoLook,
           DecoderKind::kHyper, 128, 48},
    Design{"paper", "as published: one look, concatenated decoder with positional encoding, z of 128",
           EncoderKind::kPlain, DecoderKind::kConcatenated, 128},
    Design{"plain-hyper", "one look that also tells the centre, hyper decoder, z of 128", EncoderKind::kPlain,
           DecoderKind::kHyper, 128},
};

}  // namespace

std::span<const Design> designs() noexcept { return kDesigns; }

Result<Design> find_design(std::string_view name) {
  const auto found = std::find_if(kDesigns.begin(), kDesigns.end(), [&](const Design& d) { return d.name == name; });
  if (found != kDesigns.end()) return *found;
  std::string known;
  for (const Design& design : kDesigns) known += (known.empty() ? "'" : ", '") + std::string(design.name) + "'";
  return Error::invalid("design", std::string("'").append(name) + "'", "one of " + known, ErrorCode::kUnknownName);
}

}  // namespace gatefield::training
