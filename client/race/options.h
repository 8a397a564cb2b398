#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/race/campaign.h"
#include "client/race/campaign_run.h"
#include "common/base/result.h"
#include "common/dds/network.h"

/// What a person asks gatefield-race for on its command line.
namespace gatefield::race {

struct Arguments {
  std::string campaign, out, shard, seeds, server, server_program, profiles, isa;
  std::uint32_t domain = 0;
  dds::NetworkOptions network;
  int workers = 0, paths = 10, pictures = 3, attempts = 3;
  std::size_t limit = 0;
  std::optional<std::uint64_t> planner_seed;
  double trial_limit_s = 900.0;
  bool allow_mixed = false, dry_run = false, no_report = false;
  std::vector<std::string> sources;
  std::string scenario = "circle-0.3m", profile = "race", model = "race";
  std::vector<double> speeds_m_s{7.0};
  int laps = 0;
  std::optional<Actuation::Kind> actuation;
  std::optional<config::HullKind> hull;
  std::vector<config::WorldPart> world;
  Link link;
  std::string tune;
  std::size_t trials = 0;
  double minutes = 0.0;
  bool evaluation_seeds = false;
};

/// Tells the command line's parser every subcommand and option, with the words of --help.
void declare(CLI::App* app, Arguments* arguments);

/// The campaign that is named, or the one cell that is asked for. Errors: as load_campaign().
Result<Campaign> campaign_of(const Arguments& arguments);

/// How it shall be flown. Errors: a sentence that begins with the option, or a missing folder.
Result<RunRequest> request_of(const Arguments& arguments);

}  // namespace gatefield::race
