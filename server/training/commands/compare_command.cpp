#include "server/training/commands/compare_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/base/whole_file.h"
#include "common/plot/table.h"
#include "server/training/commands/command.h"
#include "server/training/commands/generate_command.h"
#include "server/training/commands/train_command.h"
#include "server/training/evaluation/evaluate.h"
#include "server/training/evaluation/grouping.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> designs;
  fs::path work;
  std::uint64_t images = 64'000;
  std::uint64_t held_out = 2'000;
  int seeds = 3;
  int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  TrainRun run;
};

std::string run_name(const std::string& design, int seed) { return design + "-" + std::to_string(seed); }

/// "mean (least to most)" over the seeds.
std::string spread(const std::vector<double>& values, int digits) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return fmt::format("{0:.{3}f} ({1:.{3}f} to {2:.{3}f})", sum / static_cast<double>(values.size()), *least, *most,
                     digits);
}

plot::Table table_of(const Evaluation& evaluation, const Options& options, Mode mode) {
  plot::Table table;
  table.title = std::string("Designs after ") + std::to_string(options.images) + " image passes, " +
                std::to_string(options.seeds) + " seeds, mean (least to most); " + name_of(mode);
  table.columns = {"design", "frames", "box, m", "sign %", "centre median, m", "centre p90, m", "normal median, deg"};
  const HeldOut& frames = evaluation.sets.front().frames;
  for (std::size_t d = 0; d < options.designs.size(); ++d) {
    std::vector<double> box, sign, center, center_p90, normal;
    int count = 0;
    for (int seed = 0; seed < options.seeds; ++seed) {
      const std::size_t bundle = d * static_cast<std::size_t>(options.seeds) + static_cast<std::size_t>(seed);
      std::vector<const Measured*> measured;
      for (std::size_t i = 0; i < frames.truth.size(); ++i) {
        if (frames.truth[i].has_gate) measured.push_back(&frames.measured[bundle][i].modes[index_of(mode)]);
      }
      const Summary summary = summarize(measured, evaluation.bundles[bundle].validity_threshold);
      count = summary.count;
      box.push_back(summary.box_m);
      sign.push_back(summary.sign_percent);
      center.push_back(summary.center_median_m);
      center_p90.push_back(summary.center_p90_m);
      normal.push_back(summary.normal_median_deg);
    }
    table.rows.push_back({options.designs[d],
                          {static_cast<double>(count), 0},
                          spread(box, 3),
                          spread(sign, 1),
                          spread(center, 3),
                          spread(center_p90, 3),
                          spread(normal, 1)});
  }
  return table;
}

int compare(const Options& options) {
  for (int seed = 1; seed <= options.seeds; ++seed) {
    for (const std::string& design : options.designs) {
      TrainRun run = options.run;
      run.design = find_design(design).value();
      run.name = run_name(design, seed);
      run.folder = options.work / run.name;
      run.images = options.images;
      run.seed = static_cast<std::uint64_t>(seed);
      run.data = {{}};
      std::printf("== %s ==\n", run.name.c_str());
      if (const int code = run_training(run); code != 0) return code;
      if (const int code =
              export_checkpoint(run.folder / "checkpoint.pt", run.name, options.work / "bundles" / run.name);
          code != 0)
        return code;
    }
  }
  // Choosing between designs is selection: images of its own, neither trained on nor reported as held out.
  const fs::path file = options.work / "selection.h5";
  if (const int code = generate_file(file, kSelectionSeed, options.held_out, options.threads); code != 0) return code;
  EvaluateOptions evaluation;
  evaluation.datasets = {{"selection", file}};
  evaluation.threads = options.threads;
  evaluation.two_gates.count = 0;
  evaluation.approach.count = 0;
  std::vector<Named> bundles;
  for (const std::string& design : options.designs) {
    for (int seed = 1; seed <= options.seeds; ++seed)
      bundles.emplace_back(options.work / "bundles" / run_name(design, seed));
  }
  evaluation.bundle = bundles.front();
  evaluation.against.assign(bundles.begin() + 1, bundles.end());
  const auto result = evaluate(evaluation, [](double) { return !stop_requested; });
  if (stop_requested) return stopped("compare");
  if (!result) return fail(result.error());
  std::string markdown;
  for (const Mode mode : kModes) {
    const plot::Table table = table_of(*result, options, mode);
    std::printf("\n%s", plot::to_text(table).c_str());
    markdown += plot::to_markdown(table) + '\n';
  }
  const Status written = write_file(options.work / "designs.md", markdown);
  return written ? 0 : fail(written.error());
}

}  // namespace

void add_compare_command(CLI::App* app, int* exit_code) {
  const auto options = std::make_shared<Options>();
  std::vector<std::string> names;
  for (const Design& design : designs()) names.emplace_back(design.name);
  options->designs = names;
  auto* command = app->add_subcommand(
      "compare", "Train designs for the same number of image passes, some seeds each, and hold them side by side");
  command->add_option("--designs", options->designs, "which ('gatefield-train designs' tells about them)")
      ->capture_default_str()
      ->check(CLI::IsMember(names));
  command->add_option("--work", options->work, "folder for checkpoints, bundles and designs.md")->required();
  command->add_option("--images", options->images, "image passes of each run")
      ->capture_default_str()
      ->check(CLI::Range(16ull, 1'000'000'000ull));
  command->add_option("--seeds", options->seeds)->capture_default_str()->check(CLI::Range(1, 100));
  command->add_option("--held-out", options->held_out, "images to compare on")
      ->capture_default_str()
      ->check(CLI::Range(10ull, 1'000'000ull));
  command->add_option("--threads", options->threads, "for rendering and evaluation")
      ->capture_default_str()
      ->check(CLI::Range(1, 256));
  add_training_options(command, &options->run);
  command->callback([options, exit_code] { *exit_code = compare(*options); });
}

}  // namespace gatefield::training
