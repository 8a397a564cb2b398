#include "server/training/commands/evaluate_command.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/base/progress_line.h"
#include "server/training/commands/command.h"
#include "server/training/commands/no_gate_command.h"
#include "server/training/evaluation/report.h"
#include "server/training/learn/train_loop.h"

namespace gatefield::training {

int run_evaluation(const EvaluateOptions& options, const std::filesystem::path& out) {
  Evaluation evaluation;
  {
    ProgressLine line("evaluate");
    const auto begun = std::chrono::steady_clock::now();
    auto result = evaluate(options, [&](double part) {
      const double spent_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
      line.show(part, part > 0.0 ? spent_s / part * (1.0 - part) : 0.0, "");
      return !stop_requested;
    });
    if (stop_requested) {
      std::printf("evaluate stopped; nothing was written\n");
      return kStopped;
    }
    if (!result) return fail(result.error());
    evaluation = std::move(result).value();
  }
  std::printf("%s\n%s", to_text(evaluation).c_str(), speed_text(evaluation).c_str());
  if (out.empty()) return 0;
  const auto written = write_report(evaluation, out);
  if (!written) return fail(written.error());
  for (const std::string& sentence : *written) std::printf("%s\n", sentence.c_str());
  return 0;
}

void add_evaluate_command(CLI::App* app, int* exit_code) {
  struct Options {
    EvaluateOptions evaluation;
    std::string bundle;
    std::vector<std::string> against, data;
    std::filesystem::path out;
    NoGateArguments no_gate;
  };
  const auto options = std::make_shared<Options>();
  EvaluateOptions& evaluation = options->evaluation;
  evaluation.threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  auto* command = app->add_subcommand(
      "evaluate",
      "Held-out errors of a bundle: tables, pictures, and how they stand to the targets.\n"
      "Example: gatefield-train evaluate --bundle deploy/models/race --data simulation=held-out.h5 --data "
      "stereo=stereo-held-out.h5 --against \"stage 1=work/stage1\" --out report");
  command->add_option("--bundle", options->bundle, "the bundle's folder; 'name=folder' gives it a name")->required();
  command
      ->add_option("--data", options->data,
                   "data set of another seed than the training's; 'name=file' gives it a name; can be given again")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      ->add_option("--against", options->against,
                   "another bundle to stand beside it; can be given again. Bundles named 'stage 1' and 'stage 2' are "
                   "what the second sensor's targets compare with")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command->add_option("--limit", evaluation.limit, "at most so many images of each set; 0 = all")
      ->capture_default_str();
  command->add_option("--prior-sigma", evaluation.prior_sigma_m, "noise of the prior per axis, m")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 2.0));
  command->add_option("--noise-scale", evaluation.noise_scale, "of the simulated sensor's noise")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 10.0));
  command->add_option("--pairs", evaluation.two_gates.count, "images of two gates at the same distance; 0 = none")
      ->capture_default_str()
      ->check(CLI::Range(0, 100'000));
  command->add_option("--approaches", evaluation.approach.count, "flights toward a gate; 0 = none")
      ->capture_default_str()
      ->check(CLI::Range(0, 100'000));
  command->add_option("--seed", evaluation.seed, "of noise, priors and query points")->capture_default_str();
  command->add_option("--threads", evaluation.threads)->capture_default_str()->check(CLI::Range(1, 256));
  command->add_option("--out", options->out,
                      "folder for evaluation.txt, .md and .csv and the pictures (made when it isn't there)");
  add_no_gate_options(command, &options->no_gate);
  command->callback([options, exit_code] {
    if (options->data.empty() == options->no_gate.frames.empty()) {
      *exit_code = fail("evaluate needs either --data SET or --no-gate FOLDER, and not both");
      return;
    }
    EvaluateOptions& wanted = options->evaluation;
    wanted.bundle = Named::parse(options->bundle);
    if (!options->no_gate.frames.empty()) {
      *exit_code = run_no_gate(options->no_gate, wanted.bundle, wanted.threads, wanted.seed, options->out);
      return;
    }
    for (const std::string& text : options->against) wanted.against.push_back(Named::parse(text));
    for (const std::string& text : options->data) wanted.datasets.push_back(Named::parse(text));
    *exit_code = run_evaluation(wanted, options->out);
  });
}

}  // namespace gatefield::training
