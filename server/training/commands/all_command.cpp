#include "server/training/commands/all_command.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/training/commands/command.h"
#include "server/training/commands/evaluate_command.h"
#include "server/training/commands/generate_command.h"
#include "server/training/commands/recipe.h"
#include "server/training/commands/stereo_command.h"
#include "server/training/commands/train_command.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string profile = "ship";
  fs::path work, out;
  std::vector<std::string> only;
  int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  TrainRun run;
};

class All {
 public:
  All(const Recipe& recipe, const Options& options) : recipe_(recipe), options_(options) {}

  int run() {
    if (const int code = make_data(); code != 0) return code;
    for (const Part& part : recipe_.parts) {
      if (!wanted(part)) continue;
      if (const int code = make_part(part); code != 0) return code;
    }
    for (const Part& part : recipe_.parts) {
      if (!wanted(part) || !part.ships) continue;
      if (const int code = evaluate_part(part); code != 0) return code;
    }
    return options_.only.empty() ? compare_stages() : 0;
  }

 private:
  fs::path file(const char* name) const { return options_.work / name; }
  fs::path bundle(const Part& part) const {
    return (part.ships ? options_.out : options_.work / "bundles") / std::string(part.name);
  }
  bool wanted(const Part& part) const {
    return options_.only.empty() ||
           std::find(options_.only.begin(), options_.only.end(), part.name) != options_.only.end();
  }
  bool round_wanted() const {
    return std::any_of(recipe_.parts.begin(), recipe_.parts.end(),
                       [&](const Part& part) { return wanted(part) && part.round_part > 0.0; });
  }
  bool stereo_wanted() const {
    return std::any_of(recipe_.parts.begin(), recipe_.parts.end(),
                       [&](const Part& part) { return wanted(part) && part.stereo > 0.0; });
  }

  int make_data() const {
    if (const int code = generate_file(file("held-out.h5"), kHeldOutSeed, recipe_.held_out, options_.threads);
        code != 0)
      return code;
    if (round_wanted()) {
      if (const int code =
              generate_file(file("held-out-round.h5"), kRoundHeldOutSeed, recipe_.held_out, options_.threads, 0, 1.0);
          code != 0)
        return code;
    }
    if (!stereo_wanted()) return 0;
    if (const int code =
            stereo_file(file("stereo-train.h5"), kStereoTrainSeed, recipe_.stereo, options_.threads, recipe_.rooms);
        code != 0)
      return code;
    return stereo_file(file("stereo-held-out.h5"), kStereoHeldOutSeed, recipe_.stereo_held_out, options_.threads,
                       recipe_.rooms);
  }

  int make_part(const Part& part) const {
    std::printf("== %s ==\n", std::string(part.name).c_str());
    TrainRun run = options_.run;
    run.design = find_design(part.design).value();
    run.name = part.name;
    run.folder = options_.work / std::string(part.name);
    run.images = part.images;
    run.learning_rate = part.learning_rate;
    run.freeze_decoders = part.freeze_decoders;
    if (!part.start_from.empty()) run.start_from = options_.work / std::string(part.start_from) / "checkpoint.pt";
    if (part.simulation > 0.0) run.data.push_back({{}, part.simulation, part.round_part});
    if (part.stereo > 0.0) run.data.push_back({file("stereo-train.h5"), part.stereo});
    if (const int code = run_training(run); code != 0) return code;
    // Exported already from just this run, unless somebody changed it since.
    const fs::path checkpoint = run.folder / "checkpoint.pt";
    const fs::path manifest = bundle(part) / "manifest.txt";
    if (fs::exists(manifest) && fs::last_write_time(manifest) >= fs::last_write_time(checkpoint)) return 0;
    return export_checkpoint(checkpoint, run.name, bundle(part));
  }

  EvaluateOptions evaluation_of(const fs::path& folder) const {
    EvaluateOptions evaluation;
    evaluation.bundle = folder;
    evaluation.datasets = {{"simulation", file("held-out.h5")}};
    if (stereo_wanted()) evaluation.datasets.emplace_back("second sensor", file("stereo-held-out.h5"));
    evaluation.threads = options_.threads;
    evaluation.two_gates.count = recipe_.two_gates;
    evaluation.approach.count = recipe_.approaches;
    return evaluation;
  }

  /// Evaluates a part's bundle, unless that was done with just this bundle.
  int evaluate_part(const Part& part) const {
    const fs::path report = bundle(part) / "evaluation" / "evaluation.txt";
    const fs::path manifest = bundle(part) / "manifest.txt";
    if (fs::exists(report) && fs::last_write_time(report) >= fs::last_write_time(manifest)) return 0;
    EvaluateOptions evaluation = evaluation_of(bundle(part));
    if (part.round_part > 0.0) {  // on square and on round gates, beside the model that it began with
      evaluation.datasets.emplace_back("round gates", file("held-out-round.h5"));
      const fs::path before = options_.out / std::string(part.start_from);
      if (fs::exists(before / "manifest.txt")) evaluation.against.emplace_back(before);
    }
    return run_evaluation(evaluation, report.parent_path());
  }

  /// What both stages are worth on the second sensor, side by side.
  int compare_stages() const {
    const auto find = [&](std::string_view name) {
      return *std::find_if(recipe_.parts.begin(), recipe_.parts.end(),
                           [&](const Part& part) { return part.name == name; });
    };
    EvaluateOptions evaluation = evaluation_of(bundle(find("race-stereo")));
    evaluation.bundle.name = "both stages";
    evaluation.against = {{"stage 1", bundle(find("race"))},
                          {"stage 2", bundle(find("stereo-alone"))},
                          {"both, no replay", bundle(find("stereo-no-replay"))}};
    evaluation.two_gates.count = 0;
    evaluation.approach.count = 0;
    return run_evaluation(evaluation, options_.work / "stages");
  }

  const Recipe& recipe_;
  const Options& options_;
};

}  // namespace

void add_all_command(CLI::App* app, int* exit_code) {
  const auto options = std::make_shared<Options>();
  auto* command = app->add_subcommand("all", "Data sets, training, export and evaluation; continues where it stopped");
  std::vector<std::string> names;
  std::string says;
  for (const Recipe& recipe : recipes()) {
    names.emplace_back(recipe.name);
    says += (says.empty() ? "" : "; ") + std::string(recipe.name) + ": " + std::string(recipe.says);
  }
  command->add_option("--profile", options->profile, says)->capture_default_str()->check(CLI::IsMember(names));
  command->add_option("--work", options->work, "folder for data and checkpoints (ship: 1 GB)")->required();
  command->add_option("--out", options->out, "folder of the bundles")->required();
  command->add_option("--only", options->only, "just these parts (and the data that they need), e.g. race paper");
  command->add_option("--threads", options->threads, "for rendering")->capture_default_str()->check(CLI::Range(1, 256));
  add_training_options(command, &options->run);
  command->callback([options, exit_code] {
    for (const Recipe& recipe : recipes()) {
      if (recipe.name != options->profile) continue;
      for (const std::string& wanted : options->only) {
        std::string known;
        bool found = false;
        for (const Part& part : recipe.parts) {
          found = found || part.name == wanted;
          known += (known.empty() ? "'" : ", '") + std::string(part.name) + "'";
        }
        if (!found) {
          *exit_code = fail("--only is '" + wanted + "', expected some of " + known);
          return;
        }
      }
      *exit_code = All(recipe, *options).run();
    }
  });
}

}  // namespace gatefield::training
