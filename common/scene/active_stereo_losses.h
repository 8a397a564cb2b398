#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/active_stereo_noise.h"

/// What an active stereo camera loses, step by step; apply_active_stereo() says when. Disparities are the true ones in
/// the sensor's pixels, 0 = none; scale_px is the image's pixels in one of these. Not for use outside of this folder.
/// Thread-safe: yes.   Real-time safe: no.
namespace gatefield::scene {

/// Counters of one image's key: every use has its own.
enum NoisePlane : std::uint32_t { kSmallClouds, kLargeClouds, kRagged, kWhite, kImageDraws, kPatches, kLostRows };

/// Numbers that every pixel has for itself.
struct ImageDraws {
  std::vector<float> ragged;                    ///< unit normal, alike over ragged_px
  std::vector<float> white;                     ///< unit normal
  std::vector<std::uint32_t> bits, other_bits;  ///< 20 upper ones; all 32

  void draw(const ActiveStereoNoise& noise, double scale_px, int width, int height, std::array<std::uint32_t, 2> key);
};

/// Near surfaces grow over what lies behind them.
void fatten(const ActiveStereoNoise& noise, double scale_px, const ImageDraws& draws, int width, int height,
            std::vector<float>* d_px);
/// Holes along jumps.
void lose_edges(const ActiveStereoNoise& noise, double scale_px, const ImageDraws& draws, int width, int height,
                std::span<const float> d_px, std::span<float> depth_m);
/// What the second imager can't see: behind something, or left of its image.
void lose_hidden(const ActiveStereoNoise& noise, double scale_px, const ImageDraws& draws, int width, int height,
                 std::span<const float> d_px, std::span<float> depth_m);
/// Wrong matches, patches on slanting and dark surfaces, lost rows.
void lose_at_random(const ActiveStereoNoise& noise, double scale, double scale_px, const CameraModel& camera,
                    const SurfaceImage& surface, const ImageDraws& draws, std::array<std::uint32_t, 2> key,
                    DepthImage* noisy);

}  // namespace gatefield::scene
