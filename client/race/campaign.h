#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/scenario.h"

namespace gatefield::race {

/// The link between vehicle and server, as the simulator plays it.
struct Link {
  double each_way_ms = 0.0;
  double jitter_ms = 0.0;
  double loss = 0.0;
  double outage_s = 0.0;
};

/// What somebody reached elsewhere in such a cell.
struct Published {
  std::string who;
  double speed_m_s = 0.0;
  std::optional<double> success_percent;
};

struct Goal {
  double speed_m_s = 0.0;
  double success_percent = 0.0;
};

inline constexpr std::uint64_t kMaxSeeds = 100'000;  ///< of one range

struct SeedRange {
  std::uint64_t first = 1, last = 1;
  std::uint64_t count() const noexcept { return last - first + 1; }
};

/// What sees the gates, see campaign.proto.
enum class Perception { kLearned, kNone, kClassical, kTruePose };
inline constexpr Perception kPerceptions[] = {Perception::kNone, Perception::kClassical, Perception::kLearned,
                                              Perception::kTruePose};  ///< from the least to the most
/// "LEARNED", ...: as in files.
const char* name(Perception perception) noexcept;
/// "learned field", ...: for people.
const char* words(Perception perception) noexcept;

/// Trials that differ in the seed alone, at each of several speeds.
struct Cell {
  std::string name;
  std::string title;
  config::Scenario scenario;  ///< complete; its seed is the trial's to set, the planner's where it is said
  std::optional<int> laps;    ///< told to the scenario already
  std::vector<double> speeds_m_s;
  std::string profile;
  std::string model;  ///< as written; an existing folder is absolute
  Perception perception = Perception::kLearned;
  std::string beside;  ///< name of the cell that this one is compared with; empty: none
  Link link;
  SeedRange seeds;
  bool rollouts = false;  ///< the first trial at each speed is drawn with its rollouts
  std::string figure;
  std::string series;
  std::vector<Published> published;
  std::optional<Goal> goal;

  /// The scenario as a file, with course, vehicle and noise named "<name>.course.txt" and so on beside it.
  std::string scenario_text;
  std::filesystem::path noise_file;  ///< empty: the scenario names none
};

enum class Against { kSpeed, kDelay, kJitter, kLoss, kPosition, kYaw, kTilt };

struct Figure {
  std::string name;
  std::string title;
  Against against = Against::kSpeed;
};

struct Campaign {
  std::string title;
  std::vector<Cell> cells;
  std::vector<Figure> figures;     ///< every one that a cell names, in order of appearance
  std::vector<std::string> notes;  ///< what was taken otherwise than written (config::Vehicle::notes)

  const Cell* find(const std::string& name) const noexcept;
};

/// Reads a campaign (schema: campaign.proto) with every scenario, course and vehicle that it names, and checks all.
/// The sentence names file, line, cell, field, value and what was expected.
/// @param hull  by what contact is judged, in place of what cells and scenarios say
/// Thread-safe: yes.   Real-time safe: no.
Result<Campaign> load_campaign(const std::filesystem::path& file, std::optional<config::HullKind> hull = {});

/// Leaves in `folder` all that is needed to fly and to report it elsewhere: campaign.txt, and per cell cells/<name>.txt
/// with its course, vehicle and noise. load_campaign(folder / "campaign.txt") gives the same cells. Files that are
/// there with the same content are left alone. Errors: a file that can't be read or written.
Status save_campaign(const Campaign& campaign, const std::filesystem::path& folder);

/// The value that a figure shows the cell at.
double abscissa(const Cell& cell, double speed_m_s, Against against) noexcept;

/// "1001-1100" or "7". Errors: a sentence without the option's name.
Result<SeedRange> parse_seeds(const std::string& text);

}  // namespace gatefield::race
