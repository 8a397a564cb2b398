#include "server/training/commands/evaluate_command.h"

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>

#include "common/base/progress_line.h"
#include "server/training/commands/command.h"
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
    if (stop_requested) return stopped("evaluate");
    if (!result) return fail(result.error());
    evaluation = std::move(result).value();
  }
  const std::string text = to_text(evaluation);
  std::printf("%s", text.c_str());
  if (out.empty()) return 0;
  if (const Status made = make_folder(out); !made) return fail(made.error());
  if (const Status written = write_csv(evaluation, out / "evaluation.csv"); !written) return fail(written.error());
  std::ofstream file(out / "evaluation.txt", std::ios::trunc);
  file << text;
  file.close();
  if (!file) return fail((out / "evaluation.txt").string() + " can't be written");
  return 0;
}

void add_evaluate_command(CLI::App* app, int* exit_code) {
  struct Options {
    EvaluateOptions evaluation;
    std::filesystem::path out;
  };
  const auto options = std::make_shared<Options>();
  auto* command = app->add_subcommand("evaluate", "Held-out error of a bundle");
  command->add_option("--bundle", options->evaluation.bundle)->required();
  command->add_option("--data", options->evaluation.dataset_file, "data set of another seed than the training's")
      ->required();
  command->add_option("--limit", options->evaluation.limit, "at most so many samples; 0 = all")->capture_default_str();
  command->add_option("--prior-sigma", options->evaluation.prior_sigma_m, "noise of the prior per axis, m")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 2.0));
  command->add_option("--noise-scale", options->evaluation.noise_scale, "of the sensor's noise")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 10.0));
  command->add_option("--out", options->out, "folder for evaluation.csv and evaluation.txt");
  command->callback([options, exit_code] { *exit_code = run_evaluation(options->evaluation, options->out); });
}

}  // namespace gatefield::training
