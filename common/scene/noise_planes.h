#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/random.h"

/// Random numbers for every pixel of an image at once: bits, normals, fields of normals that neighbours share. Counters
/// of philox, so the same key gives the same image on every machine. Not for use outside of this folder.
/// Thread-safe: yes.   Real-time safe: no (results grow).
namespace gatefield::scene {

inline constexpr std::uint32_t kNormalBits = 12;
inline constexpr std::size_t kNormals = std::size_t{1} << kNormalBits;

/// Standard normal quantiles, indexed by random bits: a normal number for the price of a look-up (tails end at 3.7
/// sigma). Each entry is the inverse of the distribution function at the middle of its slice, by bisection; scaled to
/// variance 1.
const std::array<float, kNormals>& normal_table();

/// Four planes of random bits, one from each word of the generator's blocks, so that the loop vectorises.
/// @param plane  counter of its own for each use of one key
void fill_bits(std::uint32_t key0, std::uint32_t key1, std::uint32_t plane, std::size_t blocks, std::uint32_t* plane0,
               std::uint32_t* plane1, std::uint32_t* plane2, std::uint32_t* plane3);

/// White normals blurred by a Gaussian, row-major, mean 0 and variance 1: two pixels r apart are correlated by
/// exp(-r^2 / (4 sigma^2)). Below 0.2 px it is white.
/// @param sigma_px  of the blur, at most 200
void draw_field(std::array<std::uint32_t, 2> key, std::uint32_t plane, int width_px, int height_px, double sigma_px,
                std::vector<float>* field);

/// Poisson number by Knuth's product of uniforms; fine for the few holes of an image.
int poisson(double mean, Random* random);

}  // namespace gatefield::scene
