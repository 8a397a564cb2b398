#include "client/race/campaign_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <set>

#include "client/race/files.h"
#include "client/race/flights.h"
#include "client/race/trial_log.h"
#include "client/race/trial_table.h"
#include "client/simulator/belief_picture.h"
#include "client/simulator/flight_picture.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;

Status add_file(const fs::path& file, Fingerprint* print) {
  const auto content = read_file(file);
  if (!content) return content.failure();
  print->add(*content);
  return {};
}

Status add_model(const std::string& name, Fingerprint* print) {
  const auto folder = find_model(name);
  if (!folder) return folder.failure();
  std::vector<fs::path> files;
  std::error_code failure;
  for (const auto& entry : fs::directory_iterator(*folder, failure))
    if (entry.path().extension() == ".onnx" || entry.path().filename() == "manifest.txt") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files)
    if (auto status = add_file(file, print); !status) return status;
  return {};
}

/// A program is read once for as long as it is the same one: a search asks at every generation, and each is tens of
/// megabytes.
Status add_program(const fs::path& program, Fingerprint* print) {
  struct Known {
    fs::file_time_type written;
    std::uint64_t value;
  };
  static std::mutex mutex;
  static std::map<fs::path, Known> known;
  std::error_code failure;
  const auto written = fs::last_write_time(program, failure);
  const std::lock_guard lock(mutex);
  auto found = known.find(program);
  if (found == known.end() || found->second.written != written) {
    Fingerprint content;
    if (auto status = add_file(program, &content); !status) return status;
    found = known.insert_or_assign(program, Known{written, content.value()}).first;
  }
  print->add(&found->second.value, sizeof found->second.value);
  return {};
}

/// The programs that fly: ours, and the server when it can be found as a file.
Status add_programs(const std::string& server, Fingerprint* print) {
  std::error_code failure;
  if (auto status = add_program("/proc/self/exe", print); !status) return status;
  return fs::is_regular_file(server, failure) ? add_program(server, print) : Status();
}

std::string subtitle(const Trial& trial, const simulator::Report& report) {
  const auto& perturbation = trial.cell->scenario.perturbation;
  return fmt::format(
      "{}, profile {}, gates displaced {:.2f} m, turned {:.0f} deg; top speed {:.2f} m/s, mean {:.2f} m/s",
      trial.name(), trial.cell->profile, perturbation.position_m, perturbation.yaw_rad * 180.0 / std::numbers::pi,
      report.top_speed_m_s, report.mean_speed_m_s);
}

/// Keeps what a run leaves of its flights.
class Keeper {
 public:
  Keeper(const RunRequest& request, const Plan& plan, TrialLog* log) : request_(request), plan_(plan), log_(*log) {}

  Status keep(const Trial& trial, const Flight& flight) {
    TrialResult result = flight.result;
    result.setup = plan_.setups.at(trial.cell->name);
    const bool flown = flight.end == Flight::End::kFlown;
    if (!flown) result.cause = Cause::kNotRecorded;
    if (flown && wants_path(trial, result))
      if (auto status = put_file(request_.folder / "paths" / (trial.file_name() + ".csv"), path_text(flight.report));
          !status)
        return status;
    if (flown && !result.won() && wants_picture(trial)) {
      config::Scenario scenario = trial.cell->scenario;
      scenario.seed = trial.seed;
      scenario.title = trial.cell->title;
      if (auto status = simulator::write_flight_picture(request_.folder / "failures" / (trial.file_name() + ".png"),
                                                        scenario, flight.report, subtitle(trial, flight.report));
          !status)
        return status;
      if (auto status = draw_end(trial, flight, result, scenario); !status) return status;
    }
    if (flown && trial.cell->rollouts && trial.seed == first_seed(trial))
      if (auto status = draw_rollouts(trial, flight); !status) return status;
    return log_.append(result);
  }

 private:
  std::uint64_t first_seed(const Trial& trial) const { return request_.selection.seeds_of(*trial.cell).first; }
  Status draw_end(const Trial& trial, const Flight& flight, const TrialResult& result,
                  const config::Scenario& scenario) const {
    const std::vector<scene::Gate> gates = config::gates_by_waypoint(
        config::perturbed_world(scenario.track, scenario.perturbation, trial.seed), scenario.track.course);
    std::string belief = ", the gate was never seen";
    if (std::isfinite(result.belief_error_m))
      belief = fmt::format("; believed {:.2f} m and {:.0f} deg off, first seen {:.2f} s before the end",
                           result.belief_error_m, result.belief_turn_deg, result.seen_before_s);
    return simulator::write_end_picture(
        request_.folder / "failures" / (trial.file_name() + "-end.png"), scenario, flight.report, flight.trace,
        diagnose(flight.report, flight.trace, gates).waypoint, trial.name() + ": " + result.sentence,
        std::string("cause: ") + words(result.cause) + belief);
  }
  Status draw_rollouts(const Trial& trial, const Flight& flight) const {
    config::Scenario scenario = trial.cell->scenario;
    scenario.seed = trial.seed;
    const fs::path base = request_.folder / "rollouts" / trial.file_name();
    const std::string said = subtitle(trial, flight.report);
    if (auto status = simulator::write_rollouts_picture(base.string() + "-all.png", scenario, flight.report,
                                                        flight.trace, trial.cell->title + ": rollouts", said);
        !status)
      return status;
    return simulator::write_approach_picture(base.string() + "-approach.png", scenario, flight.report, flight.trace,
                                             trial.cell->title + ": the approach to the first gate", said);
  }
  bool wants_path(const Trial& trial, const TrialResult& result) const {
    return !result.won() || trial.seed - first_seed(trial) < static_cast<std::uint64_t>(std::max(request_.paths, 0));
  }
  bool wants_picture(const Trial& trial) {
    const std::lock_guard lock(mutex_);
    return drawn_[{trial.cell->name, trial.speed_m_s}]++ < request_.pictures;
  }

  const RunRequest& request_;
  const Plan& plan_;
  TrialLog& log_;
  std::mutex mutex_;
  std::map<std::pair<std::string, double>, int> drawn_;
};

void copy_missing(const fs::path& from, const fs::path& to) {
  std::error_code failure;
  if (!fs::is_directory(from, failure)) return;
  fs::create_directories(to, failure);
  fs::copy(from, to, fs::copy_options::recursive | fs::copy_options::skip_existing, failure);
}

}  // namespace

void RunRequest::set_folder(const fs::path& results) {
  folder = results;
  server.cells = results / "cells";
  server.traces = results / "traces";
  server.logs = results / "logs";
}

Result<std::uint64_t> setup_of(const Cell& cell, const ServerOptions& server,
                               const std::optional<std::uint64_t>& planner_seed) {
  Fingerprint print;
  config::Scenario scenario = cell.scenario;
  print.add(cell.scenario_text);
  for (const fs::path& file : {cell.scenario.course_file, cell.scenario.vehicle_file, cell.noise_file})
    if (!file.empty())
      if (auto status = add_file(file, &print); !status) return status.failure();
  print.add(fmt::format("{} {:.17g} {:.17g} {:.17g}", cell.laps.value_or(0), cell.link.each_way_ms, cell.link.jitter_ms,
                        cell.link.loss));
  if (cell.link.outage_s > 0) print.add(fmt::format("outage {:.17g}", cell.link.outage_s));
  if (planner_seed) print.add("planner seed " + std::to_string(*planner_seed));
  print.add(cell.profile);
  print.add(name(cell.perception));
  const bool learned = cell.perception == Perception::kLearned;
  if (!server.name.empty()) {
    if (learned) return print.value();
    return Error::invalid("perception", name(cell.perception),
                          "LEARNED with a server on the network (--server): baselines have servers of their own")
        .within("cell '" + cell.name + "': ");
  }

  const fs::path profile = server.profiles / (cell.profile + ".txt");
  std::error_code failure;
  if (!fs::is_regular_file(profile, failure))
    return Error{"cell '" + cell.name + "': profile is '" + cell.profile + "', expected one of the files in " +
                     server.profiles.string() + " without its .txt",
                 ErrorCode::kUnknownName, "profile"};
  if (auto status = add_file(profile, &print); !status) return status.failure();
  if (learned)
    if (auto status = add_model(cell.model, &print); !status)
      return status.failure().within("cell '" + cell.name + "': ");
  print.add(server.isa);
  if (auto status = add_programs(learned ? server.program : server.baseline_program, &print); !status)
    return status.failure();
  return print.value();
}

Result<Plan> plan_run(const Campaign& campaign, const RunRequest& request) {
  Plan plan;
  for (const Cell& cell : campaign.cells) {
    const auto setup = setup_of(cell, request.server, request.selection.planner_seed);
    if (!setup) return setup.failure();
    plan.setups[cell.name] = *setup;
  }
  const auto results = read_trials(request.folder);
  if (!results) return results.failure();
  std::set<std::string> done;
  for (const TrialResult& result : *results) {
    const auto setup = plan.setups.find(result.cell);
    if (setup == plan.setups.end() || result.failure == Failure::kLostServer) continue;
    if (setup->second != result.setup && !request.allow_mixed)
      return Error{"'" + trial_name(result) +
                       "' was flown with another program, scenario, profile or model than these, expected the same "
                       "ones, another --out, or --allow-mixed",
                   ErrorCode::kInvalid}
          .at(request.folder.string());
    done.insert(trial_name(result));
  }
  for (const Trial& trial : trials_of(campaign, request.selection)) {
    if (done.contains(trial.name())) {
      ++plan.done;
    } else {
      plan.trials.push_back(trial);
    }
  }
  if (request.limit && plan.trials.size() > *request.limit) plan.trials.resize(*request.limit);
  return plan;
}

RunSummary run_campaign(const Campaign& campaign, const RunRequest& request, const Plan& plan,
                        const FlyerFactory& factory, const std::atomic<bool>& stop,
                        const std::function<void(const RunProgress&)>& on_progress) {
  RunSummary failed;
  auto log = TrialLog::open(request.folder / log_name(request.selection.shard));
  if (!log) {
    failed.error = log.error();
    return failed;
  }
  if (auto status = save_campaign(campaign, request.folder); !status) {
    failed.error = status.error();
    return failed;
  }
  if (plan.trials.empty()) return {};
  Keeper keeper(request, plan, log.value().get());
  return run_trials(
      plan.trials, request.runner, factory,
      [&keeper](const Trial& trial, const Flight& flight) { return keeper.keep(trial, flight); }, stop, on_progress);
}

Result<std::size_t> merge_results(const std::vector<fs::path>& sources, const fs::path& out, bool allow_mixed) {
  std::vector<TrialResult> all;
  fs::path campaign;
  std::error_code failure;
  for (const fs::path& source : sources) {
    const bool folder = fs::is_directory(source, failure);
    const auto results = folder ? read_trials(source) : read_trial_file(source);
    if (!results) return results.failure();
    if (folder && results->empty())
      return Error{"has no results, expected a folder with trials*.csv that gatefield-race filled",
                   ErrorCode::kUnreadable}
          .at(source.string());
    all.insert(all.end(), results->begin(), results->end());
    const fs::path home = folder ? source : source.parent_path();
    if (campaign.empty() && fs::exists(home / "campaign.txt", failure)) campaign = home;
  }
  if (campaign.empty())
    return Error{"there is no campaign.txt beside the results, expected it in one of the folders at least",
                 ErrorCode::kUnreadable};
  all = newest(all);
  std::map<std::string, const TrialResult*> first;
  for (const TrialResult& result : all) {
    if (result.failure == Failure::kLostServer) continue;
    const auto [at, is_new] = first.emplace(result.cell, &result);
    if (is_new || allow_mixed || (at->second->setup == result.setup && at->second->model == result.model)) continue;
    // Built with +=, since g++ 12 warns wrongly of overlap (-Wrestrict).
    std::string sentence = trial_name(*at->second);
    sentence += " and ";
    sentence += trial_name(result);
    sentence +=
        " were flown with different programs, scenarios, profiles or models, expected the same ones, or "
        "--allow-mixed";
    return Error{sentence, ErrorCode::kInvalid};
  }

  // What is in the target already stays only where it was named as a source: a merge is what its sources are.
  const fs::path file = out / "trials.csv";
  const bool target_is_source = std::any_of(sources.begin(), sources.end(), [&](const fs::path& source) {
    return fs::equivalent(source, out, failure) || fs::equivalent(source, file, failure);
  });
  if (fs::exists(file, failure) && !target_is_source)
    return Error{"is there already, expected a new folder, or the folder among what is merged", ErrorCode::kInvalid}.at(
        file.string());
  std::string text = csv_header() + "\n";
  for (const TrialResult& result : all) text += csv_line(result) + "\n";
  const auto spec = read_file(campaign / "campaign.txt");
  if (!spec) return spec.failure();
  if (auto status = put_file(out / "campaign.txt", *spec); !status) return status.failure();
  for (const fs::path& source : sources) {
    const fs::path home = fs::is_directory(source, failure) ? source : source.parent_path();
    for (const char* part : {"cells", "paths", "failures", "rollouts"}) copy_missing(home / part, out / part);
  }
  if (auto status = put_file(file, text); !status) return status.failure();
  return all.size();
}

}  // namespace gatefield::race
