#include "client/race/trial.h"

#include <algorithm>
#include <charconv>

#include "common/base/text.h"

namespace gatefield::race {
namespace {

bool read_whole_number(const std::string& text, int* value) {
  const auto [stopped, code] = std::from_chars(text.data(), text.data() + text.size(), *value);
  return code == std::errc() && stopped == text.data() + text.size();
}

}  // namespace

std::string trial_name(const std::string& cell, double speed_m_s, std::uint64_t seed) {
  return cell + " at " + brief(speed_m_s) + " m/s, seed " + std::to_string(seed);
}

std::uint64_t Trial::seed_of_planner() const noexcept {
  if (planner_seed) return *planner_seed;
  return cell->scenario.planner_seed.value_or(config::default_planner_seed(seed));
}
std::string Trial::name() const { return trial_name(cell->name, speed_m_s, seed); }
std::string Trial::file_name() const { return cell->name + "-" + brief(speed_m_s) + "-" + std::to_string(seed); }

Result<Shard> parse_shard(const std::string& text) {
  Shard shard;
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos || !read_whole_number(text.substr(0, slash), &shard.index) ||
      !read_whole_number(text.substr(slash + 1), &shard.count) || shard.count < 1 || shard.count > 100'000 ||
      shard.index < 1 || shard.index > shard.count)
    return Error{"'" + text + "' is no part of a campaign, expected INDEX/COUNT with 1 <= INDEX <= COUNT, e.g. 3/16",
                 ErrorCode::kInvalid, "shard"};
  return shard;
}

std::string server_key(const Cell& cell) {
  if (cell.perception != Perception::kLearned) return std::string(name(cell.perception)) + " for " + cell.name;
  return cell.rollouts ? cell.model + " with rollouts" : cell.model;
}

std::string server_key(const Trial& trial) {
  const std::string key = server_key(*trial.cell);
  return trial.cell->perception == Perception::kTruePose ? key + ", world " + std::to_string(trial.seed) : key;
}

std::vector<Trial> trials_of(const Campaign& campaign, const Selection& selection) {
  std::vector<std::string> servers;
  std::uint64_t rounds = 0;
  for (const Cell& cell : campaign.cells) {
    const std::string key = server_key(cell);
    if (std::find(servers.begin(), servers.end(), key) == servers.end()) servers.push_back(key);
    rounds = std::max(rounds, selection.seeds_of(cell).count());
  }
  const auto shards = static_cast<std::uint64_t>(selection.shard.count);
  std::vector<Trial> trials;
  for (const std::string& server : servers)
    for (std::uint64_t round = 0; round < rounds; ++round) {
      // A round deals one trial of every cell and speed; the first one goes to another shard in each round.
      std::uint64_t place = round;
      for (const Cell& cell : campaign.cells)
        for (const double speed_m_s : cell.speeds_m_s) {
          const bool mine = place++ % shards + 1 == static_cast<std::uint64_t>(selection.shard.index);
          if (mine && server_key(cell) == server && round < selection.seeds_of(cell).count())
            trials.push_back({&cell, speed_m_s, selection.seeds_of(cell).first + round, selection.planner_seed});
        }
    }
  return trials;
}

}  // namespace gatefield::race
