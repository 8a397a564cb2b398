#include "client/race/options.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <thread>

#include "client/race/single_cell.h"
#include "common/config/locate.h"
#include "common/config/vehicle.h"
#include "common/dds/network_arguments.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;

/// The server that was built or installed with this program.
std::string default_server(const std::string& name) {
  std::error_code failure;
  const fs::path beside = fs::read_symlink("/proc/self/exe", failure).parent_path() / name;
  return fs::exists(beside, failure) ? beside.string() : name;
}

/// What every subcommand that flies has: where to, on how many workers, and what is kept.
void declare_flying(CLI::App* app, Arguments* a, bool out_required) {
  auto* out = app->add_option("--out,-o", a->out, "Folder of the results; one that has some already is gone on with")
                  ->type_name("FOLDER");
  if (out_required) out->required();
  app->add_option("--workers,-j", a->workers,
                  "Trials at a time, each with a core and a server of its own; 0 = one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app->add_flag("--dry-run", a->dry_run, "Only say what would be flown");
  app->add_option("--paths", a->paths, "Flights of each cell and speed whose path is kept; lost ones always are")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  app->add_option("--pictures", a->pictures, "Lost flights of each cell and speed that are drawn")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  app->add_flag("--allow-mixed", a->allow_mixed,
                "Go on with results although programs, scenario, profile or model have changed since");
  app->add_option("--server-program", a->server_program,
                  "gatefield-server to start (default: the one beside this program)")
      ->type_name("FILE")
      ->group("Server");
  app->add_option("--profiles", a->profiles, "Folder of planner profiles for servers of our own (default: the shipped)")
      ->type_name("FOLDER")
      ->group("Server");
  app->add_option("--isa", a->isa, "Instruction set for servers of our own (default: the best of the machine)")
      ->group("Server");
  app->add_option("--attempts", a->attempts, "Attempts at a trial whose server is lost")
      ->check(CLI::Range(1, 100))
      ->capture_default_str()
      ->group("Server");
  app->add_option("--trial-limit", a->trial_limit_s, "Longest time for an attempt, in seconds of the wall clock")
      ->check(CLI::Range(1.0, 86400.0))
      ->capture_default_str()
      ->group("Server");
}

void declare_run(CLI::App* app, Arguments* a, bool out_required) {
  declare_flying(app, a, out_required);
  app->add_option("--shard", a->shard, "Only this part of the trials, e.g. 3/16; parts may share a folder")
      ->type_name("INDEX/COUNT");
  app->add_option("--seed,--seeds", a->seeds,
                  "Seeds of the true world in place of the campaign's, e.g. 1-20; a cell of a single seed keeps it")
      ->type_name("FIRST-LAST");
  app->add_option("--planner-seed", a->planner_seed,
                  "Seed of the planner's sampling in every trial (default: the campaign's, else it goes with the "
                  "trial's seed)");
  app->add_option("--hull", a->hull,
                  "By what contact is judged: discs (those of the propellers, as they are turned, and the body's "
                  "sphere) or sphere alone (default: the campaign's, else the scenario's)")
      ->transform(CLI::CheckedTransformer(config::hull_names(), CLI::ignore_case));
  app->add_option("--limit", a->limit, "At most so many trials in this run; 0 = all")->capture_default_str();
  app->add_flag("--no-report", a->no_report, "No tables and pictures at the end (gatefield-race report makes them)");
  app->add_option("--server", a->server, "Name of a server on the network, in place of servers of our own")
      ->group("Server");
  app->add_option("--domain", a->domain, "DDS domain of that server")
      ->check(CLI::Range(0, 232))
      ->capture_default_str()
      ->group("Server");
  dds::add_network_options(app, &a->network);
}

}  // namespace

Result<RunRequest> request_of(const Arguments& a) {
  RunRequest request;
  request.set_folder(a.out);
  if (!a.shard.empty()) {
    const auto shard = parse_shard(a.shard);
    if (!shard) return shard.failure().within("--shard: ");
    request.selection.shard = *shard;
  }
  if (!a.seeds.empty()) {
    const auto seeds = parse_seeds(a.seeds);
    if (!seeds) return seeds.failure().within("--seeds: ");
    request.selection.seeds = *seeds;
  }
  request.selection.planner_seed = a.planner_seed;
  if (a.limit > 0) request.limit = a.limit;
  request.allow_mixed = a.allow_mixed;
  request.paths = a.paths;
  request.pictures = a.pictures;
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  request.runner.workers = a.workers > 0 ? a.workers : static_cast<int>(cores);
  request.runner.attempts = a.attempts;
  request.runner.trial_limit = std::chrono::seconds(std::lround(a.trial_limit_s));
  request.server.program = a.server_program.empty() ? default_server("gatefield-server") : a.server_program;
  request.server.baseline_program = default_server("gatefield-baseline-server");
  request.server.name = a.server;
  request.server.domain = a.domain;
  if (!a.network.security.empty())
    return Error::invalid("--security", a.network.security,
                          "none: each flight has a name of its own, in a domain of this host's own");
  request.server.network = a.network;
  request.server.network_words = dds::network_arguments(a.network);
  request.server.isa = a.isa;
  request.server.profiles = a.profiles;
  if (a.profiles.empty()) {
    const auto folder = config::config_folder();
    if (!folder) return folder.failure();
    request.server.profiles = *folder / "profiles";
  }
  return request;
}

Result<Campaign> campaign_of(const Arguments& a) {
  if (!a.campaign.empty()) {
    const auto file = config::find_config("campaigns", a.campaign);
    if (!file) return file.failure();
    return load_campaign(*file, a.hull);
  }
  SingleCell asked{a.scenario, a.profile, a.model, a.speeds_m_s, {1, 20}, {}, a.link, a.actuation};
  asked.hull = a.hull;
  asked.world = a.world;
  if (a.laps > 0) asked.laps = a.laps;
  return single_cell_campaign(asked);
}

void declare(CLI::App* app, Arguments* a) {
  app->description(
      "Flies campaigns of seeded races in lockstep, each through a gatefield-server over DDS, and reports what share "
      "was\n"
      "won, with 95 % intervals, tables and pictures. Interrupted campaigns go on where they were.\n");
  app->footer(
      "\nExamples\n"
      "  gatefield-race run smoke --out out/smoke                    a small campaign that ships, in half a minute\n"
      "  gatefield-race run my/campaign.txt --out out/mine           your own (docs/racing.md)\n"
      "  gatefield-race run paper --shard 3/16 --out out/paper       a sixteenth of the paper's tables\n"
      "  gatefield-race fly --scenario circle-yaw30 --speed 8 10 --seeds 1-20 --out out/yaw     one scenario, no file\n"
      "  gatefield-race tune my/tune.txt --minutes 90 --out out/tune  a profile for my vehicle (docs/tuning.md)\n"
      "  gatefield-race merge host1/out host2/out --out out/all      results of several machines in one report\n"
      "\nExit code\n"
      "  0 all flown   2 bad input   3 no server answers   130 interrupted; the same command goes on\n");
  app->require_subcommand(1);

  CLI::App* run = app->add_subcommand("run", "Fly a campaign, or what is left of it, and report");
  run->add_option("campaign", a->campaign, "Campaign: a file, or a short name of a shipped one")->required();
  declare_run(run, a, true);

  CLI::App* paper = app->add_subcommand("paper", "The same for the campaign that makes the paper's tables and figures");
  declare_run(paper, a, false);

  CLI::App* fly =
      app->add_subcommand("fly", "The same for one scenario, without a file; seeds 1-20 unless told otherwise");
  fly->add_option("--scenario", a->scenario, "Scenario: a file, or a short name of a shipped one")
      ->capture_default_str();
  fly->add_option("--speed", a->speeds_m_s, "Soft speed limits in m/s, one or more")->capture_default_str();
  fly->add_option("--profile", a->profile, "Planner profile of the server")->capture_default_str();
  fly->add_option("--model", a->model, "Model: a folder, or the name of a shipped one")->capture_default_str();
  fly->add_option("--laps", a->laps, "Laps in place of the course's; 0 = the course's")->capture_default_str();
  fly->add_option("--actuation", a->actuation,
                  "How the vehicle is driven: rotor-thrusts or body-rates (default: the scenario's, else the vehicle "
                  "file's)")
      ->transform(CLI::CheckedTransformer(config::actuation_names(), CLI::ignore_case));
  fly->add_option("--world", a->world,
                  "How the truth is harder than the planner's idea of it, in place of the scenario's: hard, or some of "
                  "its parts, drift,battery (docs/hard-world.md)")
      ->delimiter(',')
      ->transform(CLI::CheckedTransformer(config::world_part_names(), CLI::ignore_case));
  fly->add_option("--delay-each-way-ms", a->link.each_way_ms, "Delay of the link, there and again back")
      ->capture_default_str();
  fly->add_option("--jitter-ms", a->link.jitter_ms, "And up to this much more")->capture_default_str();
  fly->add_option("--loss", a->link.loss, "Share of messages lost, each way")->capture_default_str();
  fly->add_option("--outage-s", a->link.outage_s, "Once in each race nothing gets through for so long")
      ->capture_default_str();
  declare_run(fly, a, true);

  CLI::App* tune = app->add_subcommand(
      "tune", "Find a profile for these races on seeds of the lab, or what is left of the search, and compare");
  tune->add_option("tune", a->tune, "What is looked for: a file (docs/tuning.md), or a short name of a shipped one")
      ->required();
  tune->add_option("--trials", a->trials, "Budget in flights, in place of the file's; a larger one goes on farther")
      ->check(CLI::Range(1, 100'000'000));
  tune->add_option("--minutes", a->minutes,
                   "Budget in minutes of the wall clock, in place of the file's or beside --trials")
      ->check(CLI::Range(1.0, 100'000.0));
  tune->add_flag("--evaluation-seeds", a->evaluation_seeds,
                 "Seeds from 1001 on may be flown; nothing that was tuned on them can be judged by them");
  declare_flying(tune, a, true);

  CLI::App* merge = app->add_subcommand("merge", "Put the results of several machines into one folder, and report");
  merge->add_option("source", a->sources, "Folders of results, or trials*.csv files")->required();
  merge->add_option("--out,-o", a->out, "Folder to put them in")->required()->type_name("FOLDER");
  merge->add_flag("--allow-mixed", a->allow_mixed, "Also results of different programs, scenarios, profiles or models");
  merge->add_flag("--no-report", a->no_report, "No tables and pictures");

  CLI::App* report = app->add_subcommand("report", "Make tables and pictures of what was flown");
  report->add_option("folder", a->out, "Folder of results")->required();
}

}  // namespace gatefield::race
