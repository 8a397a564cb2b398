#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/race/campaign.h"
#include "client/race/tune/budget.h"
#include "client/race/tune/profile_sheet.h"
#include "client/race/tune/space.h"

namespace gatefield::race {

inline constexpr std::uint64_t kFirstEvaluationSeed = 1001;  ///< from here on seeds are for evaluation alone

/// A field that a person wants to have looked for; what is not said follows from the base.
struct WantedField {
  std::string name;
  std::optional<double> min, max;
  std::optional<bool> logarithmic;
};

/// What is looked for, on which races: a file of tune.proto, read and checked.
struct Tune {
  std::string title;
  std::string base_profile;
  Campaign races;  ///< their seeds are the lab's; profile and speeds as the file says
  std::vector<WantedField> fields;
  std::optional<int> candidates;
  std::uint64_t seeds_per_generation = 4;
  double spread = 0.2;
  std::uint64_t seed = 1;
  SeedRange fresh_seeds;
  Budget budget;

  /// Trials of one profile for each seed: cells times their speeds.
  std::size_t races_per_seed() const noexcept;
};

/// What a person says on the command line, in place of the file or beside it.
struct TuneOrder {
  Budget budget;                  ///< where one is set, the file's is not taken
  bool evaluation_seeds = false;  ///< may be flown
};

/// Reads a file (schema: tune.proto) with all that its races name, and checks what can be checked without the base.
/// Errors: the sentence names file, line, field, value and what was expected; seeds of the evaluation are refused.
Result<Tune> load_tune(const std::filesystem::path& file, const TuneOrder& order = {});

/// The fields that are looked for, with their ranges: the file's, else the usual ones.
/// Errors: as Space::make().
Result<Space> space_of(const Tune& tune, const ProfileSheet& base);

}  // namespace gatefield::race
