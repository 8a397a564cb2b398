#include "server/training/commands/train_command.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "common/base/whole_file.h"
#include "common/config/sensor_noise_file.h"
#include "server/training/commands/command.h"
#include "server/training/learn/curves.h"
#include "server/training/learn/export.h"

namespace gatefield::training {
namespace {

constexpr std::size_t kLogLines = 500;

/// The training log with at most kLogLines lines, evenly taken; the last one always.
int copy_log(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::ifstream in(from);
  std::string header;
  std::vector<std::string> lines;
  std::getline(in, header);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  const std::size_t every = lines.size() / kLogLines + 1;
  std::string kept = header + '\n';
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if ((lines.size() - 1 - i) % every == 0) kept += lines[i] + '\n';
  }
  const Status written = write_file(to, kept);
  return written ? 0 : fail(written.error());
}

CLI::Option* add_design_option(CLI::App* command, std::string* name) {
  std::vector<std::string> names;
  for (const Design& design : designs()) names.emplace_back(design.name);
  return command->add_option("--design", *name, "which networks; 'gatefield-train designs' tells about them")
      ->capture_default_str()
      ->check(CLI::IsMember(names));
}

}  // namespace

void add_training_options(CLI::App* command, TrainRun* run) {
  command->add_option("--batch", run->batch, "images a step")->capture_default_str()->check(CLI::Range(1, 1024));
  command->add_option("--crops", run->crops_per_image, "crops of each image (two looks)")
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  command->add_option("--points", run->points, "query points per crop or image, drawn afresh in every pass")
      ->capture_default_str()
      ->check(CLI::Range(8, 8192));
  command->add_option("--torch-threads", run->torch_threads, "threads of libtorch's operators")
      ->capture_default_str()
      ->check(CLI::Range(1, 256));
  command->add_option("--data-threads", run->data_threads, "threads that prepare batches")
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  command->add_option("--checkpoint-every", run->checkpoint_every_s, "seconds")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1e5));
  command->add_flag(
      "--single-precision", [run](std::int64_t given) { run->allow_bf16 = given == 0; },
      "don't use bfloat16 even where the CPU has it");
}

int run_training(const TrainRun& run) {
  const auto complete = train(run);
  if (!complete) return fail(complete.error());
  const auto no_picture = draw_curves(run.folder / "log.csv", run.folder, "curves");
  if (!no_picture) return fail(no_picture.error());
  if (!no_picture->empty()) std::printf("%s\n", no_picture->c_str());
  return *complete ? 0 : stopped("training");
}

int export_checkpoint(const std::filesystem::path& checkpoint, const std::string& name,
                      const std::filesystem::path& out) {
  const auto design = Trainer::design_of(checkpoint);
  if (!design) return fail(design.error());
  const auto weights = Trainer::weights_of(checkpoint);
  if (!weights) return fail(weights.error());
  if (const Status made = make_folder(out.parent_path()); !made) return fail(made.error());
  if (const Status exported = export_bundle(*weights, *design, name, out); !exported) return fail(exported.error());
  std::printf("%s: bundle of design '%s'\n", out.c_str(), std::string(design->name).c_str());
  const auto log = checkpoint.parent_path() / "log.csv";
  return std::filesystem::exists(log) ? copy_log(log, out / "training.csv") : 0;
}

void add_train_command(CLI::App* app, int* exit_code) {
  struct Options {
    TrainRun run;
    std::string design{designs().front().name};
    std::vector<std::string> data;
    std::vector<double> parts;
    double round_part = 0.0;
    std::filesystem::path noise;
  };
  const auto options = std::make_shared<Options>();
  TrainRun& run = options->run;
  auto* command = app->add_subcommand("train", "Train (continues from the folder's checkpoint)");
  command->add_option("--data", options->data, "data set, or the word endless: rendered as needed; several are mixed")
      ->required();
  command->add_option("--part", options->parts, "which part of the images each data set gives, e.g. 0.5 0.5");
  command->add_option("--round-part", options->round_part, "part of the gates in endless images whose opening is round")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--run", run.folder, "folder of checkpoint.pt and log.csv")->required();
  command->add_option("--bundle", run.bundle_folder, "export here at every checkpoint");
  command->add_option("--name", run.name, "of the bundle")->capture_default_str();
  add_design_option(command, &options->design);
  command->add_option("--start-from", run.start_from, "checkpoint whose weights a new run begins with");
  command->add_flag("--freeze-decoders", run.freeze_decoders,
                    "second stage: only the encoder learns, the field's decoder stays as it is");
  command->add_option("--images", run.images, "image passes in all")
      ->capture_default_str()
      ->check(CLI::Range(1ull, 10'000'000'000ull));
  command->add_option("--rate", run.learning_rate, "AdamW's learning rate, falls to 0 along a cosine")
      ->capture_default_str()
      ->check(CLI::Range(1e-6, 1.0));
  command->add_option("--seed", run.seed)->capture_default_str();
  command->add_option("--noise", options->noise,
                      "the simulated sensor's noise, as 'gatefield-train fit-noise' writes it");
  add_training_options(command, &run);
  command->callback([options, exit_code] {
    auto& parts = options->parts;
    if (!parts.empty() && parts.size() != options->data.size()) {
      *exit_code = fail("--part has " + std::to_string(parts.size()) + " numbers, expected one for each of " +
                        std::to_string(options->data.size()) + " data sets");
      return;
    }
    for (std::size_t i = 0; i < options->data.size(); ++i)
      options->run.data.push_back({options->data[i] == "endless" ? std::string() : options->data[i],
                                   parts.empty() ? 1.0 : parts[i], options->round_part});
    options->run.design = find_design(options->design).value();
    if (!options->noise.empty()) {
      const auto noise = config::load_sensor_noise(options->noise);
      if (!noise) {
        *exit_code = fail(noise.error());
        return;
      }
      options->run.noise = *noise;
    }
    *exit_code = run_training(options->run);
  });
}

void add_export_command(CLI::App* app, int* exit_code) {
  struct Options {
    std::filesystem::path checkpoint, out;
    std::string name = "race";
  };
  const auto options = std::make_shared<Options>();
  auto* command = app->add_subcommand("export", "Write a bundle from a checkpoint");
  command->add_option("--checkpoint", options->checkpoint)->required();
  command->add_option("--out", options->out, "the bundle's folder (replaced as a whole)")->required();
  command->add_option("--name", options->name)->capture_default_str();
  command->callback(
      [options, exit_code] { *exit_code = export_checkpoint(options->checkpoint, options->name, options->out); });
}

void add_designs_command(CLI::App* app, int* exit_code) {
  auto* command = app->add_subcommand("designs", "List the networks that can be trained");
  command->callback([exit_code] {
    for (const Design& design : designs())
      std::printf("%-14s %s\n", std::string(design.name).c_str(), std::string(design.says).c_str());
    *exit_code = 0;
  });
}

}  // namespace gatefield::training
