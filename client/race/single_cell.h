#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/race/campaign.h"

namespace gatefield::race {

/// One cell as a person asks for it on a command line, without a file.
struct SingleCell {
  std::string scenario, profile, model;  ///< files, folders (relative to the working folder) or short names
  std::vector<double> speeds_m_s;
  SeedRange seeds;
  std::optional<int> laps;
  Link link;
  std::optional<Actuation::Kind> actuation{};  ///< in place of the scenario's and the vehicle's
  std::optional<config::HullKind> hull{};      ///< in place of the scenario's
  std::vector<config::WorldPart> world{};      ///< in place of the scenario's; none: the scenario's
};

/// A campaign of that cell alone, named after its scenario. Errors: as load_campaign(); the sentences begin with
/// "command line".
Result<Campaign> single_cell_campaign(const SingleCell& asked);

}  // namespace gatefield::race
