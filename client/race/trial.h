#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/race/campaign.h"
#include "common/base/result.h"

namespace gatefield::race {

/// One flight of a campaign.
struct Trial {
  const Cell* cell = nullptr;
  double speed_m_s = 0.0;
  std::uint64_t seed = 1;                       ///< of the true world
  std::optional<std::uint64_t> planner_seed{};  ///< in place of the cell's, for all that a person asks for at once

  /// What the planner is told: the one above, the cell's, or the one that goes with the world's.
  std::uint64_t seed_of_planner() const noexcept;
  /// What names it among all trials, see trial_name().
  std::string name() const;
  /// For files: "<cell>-<speed>-<seed>".
  std::string file_name() const;
};

/// What names a trial: "<cell> at <speed> m/s, seed <seed>".
std::string trial_name(const std::string& cell, double speed_m_s, std::uint64_t seed);

/// What server a cell needs: one per model, and for the baselines one per cell.
std::string server_key(const Cell& cell);
/// The same for a trial: true poses are of one world, so that their server is another one for each seed.
std::string server_key(const Trial& trial);

/// Part `index` (from 1) of `count` of a campaign.
struct Shard {
  int index = 1, count = 1;
};

/// "3/16". Errors: a sentence without the option's name.
Result<Shard> parse_shard(const std::string& text);

struct Selection {
  Shard shard;
  std::optional<SeedRange> seeds;  ///< in place of the cells'; one of a single seed keeps it: that flight is meant
  std::optional<std::uint64_t> planner_seed{};  ///< in place of the cells'

  SeedRange seeds_of(const Cell& cell) const {
    return cell.seeds.count() == 1 ? cell.seeds : seeds.value_or(cell.seeds);
  }
};

/// The trials of a campaign in the order of flight: servers one after the other (see server_key()), the first seed of
/// every cell and speed, then the second, and so on, so that a campaign that is stopped has flown about as many of
/// each. The shards of a campaign hold every trial exactly once, and each about as many of every cell.
std::vector<Trial> trials_of(const Campaign& campaign, const Selection& selection = {});

}  // namespace gatefield::race
