#include "server/training/commands/recipe.h"

namespace gatefield::training {
namespace {

/// Both stages as in the paper, with and without replay of the simulation, and the second one alone.
std::vector<Part> parts(std::uint64_t race, std::uint64_t small, std::uint64_t paper, std::uint64_t second,
                        std::uint64_t round) {
  return {
      {.name = "race", .design = "two-look", .images = race, .ships = true},
      {.name = "race-stereo",
       .design = "two-look",
       .images = second,
       .learning_rate = 5e-4,
       .simulation = 0.5,
       .stereo = 0.5,
       .start_from = "race",
       .freeze_decoders = true,
       .ships = true},
      {.name = "race-round",
       .design = "two-look",
       .images = round,
       .learning_rate = 1e-3,
       .round_part = 0.5,
       .start_from = "race",
       .ships = true},
      {.name = "stereo-no-replay",
       .design = "two-look",
       .images = second,
       .learning_rate = 5e-4,
       .simulation = 0.0,
       .stereo = 1.0,
       .start_from = "race",
       .freeze_decoders = true},
      {.name = "stereo-alone", .design = "two-look", .images = second, .simulation = 0.0, .stereo = 1.0},
      {.name = "race-z64",
       .design = "two-look-z64",
       .images = small,
       .learning_rate = 1e-3,
       .start_from = "race",
       .ships = true},
      {.name = "paper", .design = "paper", .images = paper, .ships = true},
  };
}

}  // namespace

std::span<const Recipe> recipes() {
  static const std::vector<Recipe> all = {
      {.name = "ship",
       .says = "what the repository's models were made with, hours",
       .held_out = 4'000,
       .stereo = 3'000,
       .stereo_held_out = 1'000,
       .parts = parts(1'800'000, 160'000, 600'000, 60'000, 240'000)},
      {.name = "try",
       .says = "minutes, to see it work",
       .held_out = 200,
       .stereo = 80,
       .stereo_held_out = 40,
       .rooms = 2,
       .two_gates = 20,
       .approaches = 4,
       .parts = parts(9'600, 800, 1'600, 800, 800)},
  };
  return all;
}

}  // namespace gatefield::training
