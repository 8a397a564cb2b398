#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "server/training/learn/designs.h"

namespace gatefield::training {

/// One training run of a recipe.
struct Part {
  std::string_view name;  ///< of its folder, and of its bundle
  std::string_view design;
  std::uint64_t images = 0;  ///< image passes
  double learning_rate = 2e-3;
  double simulation = 1.0;           ///< part of the images from simulation
  double round_part = 0.0;           ///< of the gates there
  double stereo = 0.0;               ///< and from the second sensor
  std::string_view start_from = {};  ///< another part that this one begins with; empty = random weights
  bool freeze_decoders = false;
  bool ships = false;  ///< its bundle goes into the repository; the others are there to compare with
};

/// What `gatefield-train all` makes, from nothing to evaluated bundles.
struct Recipe {
  std::string_view name;
  std::string_view says;
  std::uint64_t held_out = 0;         ///< simulated images to evaluate on; as many with round gates where these count
  std::uint64_t stereo = 0;           ///< pairs of the second sensor to train on
  std::uint64_t stereo_held_out = 0;  ///< pairs in other rooms to evaluate on
  std::uint64_t rooms = 25;           ///< that each of these two sets shows
  int two_gates = 400;                ///< images of two gates at the same distance to evaluate on
  int approaches = 200;               ///< flights toward a gate to evaluate on
  std::vector<Part> parts;            ///< in the order in which they are trained
};

std::span<const Recipe> recipes();

}  // namespace gatefield::training
