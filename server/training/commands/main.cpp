// gatefield-train: data set, training, export and held-out evaluation of a model bundle (docs/training.md).

#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "common/base/progress_line.h"
#include "server/training/data/contact_sheet.h"
#include "server/training/evaluation/evaluate.h"
#include "server/training/learn/export.h"
#include "server/training/learn/train_loop.h"

namespace {

namespace fs = std::filesystem;
using namespace gatefield;
using namespace gatefield::training;

constexpr int kBadInput = 2;
constexpr int kStopped = 130;
constexpr std::uint64_t kTrainSeed = 1;
constexpr std::uint64_t kHeldOutSeed = 1'000'003;  // never trained on
constexpr std::size_t kLogLines = 2000;

/// What `all` makes.
struct Profile {
  std::uint64_t samples;
  std::uint64_t held_out;
  std::uint64_t images;
};

void on_signal(int) { stop_requested = true; }

int fail(const std::string& sentence) {
  std::fprintf(stderr, "gatefield-train: %s\n", sentence.c_str());
  return kBadInput;
}

int stopped(const std::string& what) {
  std::printf("%s stopped; what is done is kept, and the same command continues\n", what.c_str());
  return kStopped;
}

/// 0, kBadInput or kStopped.
int generate_file(const fs::path& file, std::uint64_t seed, std::uint64_t count, int threads) {
  std::error_code code;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), code);
  DatasetOptions options;
  options.seed = seed;
  options.count = count;
  options.threads = threads;
  ProgressLine line("generate");
  const Status made = generate_dataset(file, options, [&](const Progress& progress) {
    char rate[48];
    std::snprintf(rate, sizeof rate, "%.0f samples/s", progress.rate_hz);
    line.show(static_cast<double>(progress.done_n) / static_cast<double>(std::max<std::uint64_t>(1, progress.total_n)),
              progress.time_left_s, rate);
    return !stop_requested;
  });
  if (stop_requested) return stopped("generate");
  if (!made) return fail(made.error());
  line.say(file.string() + ": " + std::to_string(count) + " samples, seed " + std::to_string(seed));
  return 0;
}

int run_training(const TrainRun& run) {
  const auto complete = train(run);
  if (!complete) return fail(complete.error());
  return *complete ? 0 : stopped("training");
}

int run_evaluation(const EvaluateOptions& options, const fs::path& out) {
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
  std::error_code code;
  fs::create_directories(out, code);
  if (const Status written = write_csv(evaluation, out / "evaluation.csv"); !written) return fail(written.error());
  std::ofstream file(out / "evaluation.txt", std::ios::trunc);
  file << text;
  file.close();
  if (!file) return fail((out / "evaluation.txt").string() + " can't be written");
  return 0;
}

/// The training log with at most kLogLines lines, evenly taken; the last one always.
int copy_log(const fs::path& from, const fs::path& to) {
  std::ifstream in(from);
  std::string header;
  std::vector<std::string> lines;
  std::getline(in, header);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  const std::size_t every = lines.size() / kLogLines + 1;
  std::ofstream out(to, std::ios::trunc);
  out << header << '\n';
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if ((lines.size() - 1 - i) % every == 0) out << lines[i] << '\n';
  }
  out.close();
  return out ? 0 : fail(to.string() + " can't be written");
}

int export_checkpoint(const fs::path& checkpoint, bool plain, const std::string& name, const fs::path& out) {
  TrainerOptions options;
  options.plain = plain;
  options.total_steps = 1;
  auto trainer = Trainer::create(options);
  if (!trainer) return fail(trainer.error());
  if (const Status loaded = (*trainer)->load(checkpoint); !loaded) return fail(loaded.error());
  std::error_code code;
  if (out.has_parent_path()) fs::create_directories(out.parent_path(), code);
  if (const Status exported = export_bundle((*trainer)->weights(), plain, name, out); !exported)
    return fail(exported.error());
  std::printf("%s: bundle of step %llu\n", out.c_str(), static_cast<unsigned long long>((*trainer)->steps()));
  return 0;
}

int run_all(const Profile& profile, const fs::path& work, const fs::path& out, TrainRun run, int threads) {
  const fs::path train_file = work / "train.bin";
  const fs::path held_out_file = work / "held-out.bin";
  if (const int code = generate_file(train_file, kTrainSeed, profile.samples, threads); code != 0) return code;
  if (const int code = generate_file(held_out_file, kHeldOutSeed, profile.held_out, threads); code != 0) return code;
  run.dataset_file = train_file;
  run.folder = work / "run";
  run.images = profile.images;
  if (const int code = run_training(run); code != 0) return code;
  if (const int code = export_checkpoint(run.folder / "checkpoint.pt", run.plain, run.name, out); code != 0)
    return code;
  if (const int code = copy_log(run.folder / "log.csv", out / "training.csv"); code != 0) return code;
  EvaluateOptions evaluation;
  evaluation.bundle = out;
  evaluation.dataset_file = held_out_file;
  return run_evaluation(evaluation, out);
}

}  // namespace

int main(int argc, char** argv) {
  // libtorch asks for and gives back tens of megabytes in every step; keep them instead of returning them to the
  // kernel.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  mallopt(M_TOP_PAD, 64 << 20);
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);

  CLI::App app{
      "Makes the model bundle that gatefield-server flies with: depth images of simulated gates, training, ONNX "
      "export, held-out error.\n"
      "Everything made: gatefield-train all --profile ship --work /var/tmp/gatefield --out deploy/models/race"};
  app.require_subcommand(1);
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));

  fs::path file, out, bundle, work, checkpoint;
  std::uint64_t samples = 200'000, seed = kTrainSeed;
  int threads = cores, sheet = 64;
  auto* generate = app.add_subcommand("generate", "Render a data set (continues a file that is there)");
  generate->add_option("--out", file, "the data set's file")->required();
  generate->add_option("--samples", samples, "how many images")
      ->capture_default_str()
      ->check(CLI::Range(1, 100'000'000));
  generate->add_option("--seed", seed, "names the set; held-out sets need another one")->capture_default_str();
  generate->add_option("--threads", threads)->capture_default_str()->check(CLI::Range(1, 256));
  fs::path sheet_file;
  generate->add_option("--contact-sheet", sheet_file, "also write a PNG of some images");
  generate->add_option("--contact-sheet-images", sheet)->capture_default_str()->check(CLI::Range(1, 1000));

  TrainRun run;
  bool single_precision = false;
  const auto training_options = [&](CLI::App* command) {
    command->add_option("--batch", run.batch, "images a step")->capture_default_str()->check(CLI::Range(1, 1024));
    command->add_option("--rate", run.learning_rate, "AdamW's learning rate, falls to 0 along a cosine")
        ->capture_default_str()
        ->check(CLI::Range(1e-6, 1.0));
    command->add_option("--torch-threads", run.torch_threads, "threads of libtorch's operators")
        ->capture_default_str()
        ->check(CLI::Range(1, 256));
    command->add_option("--data-threads", run.data_threads, "threads that prepare batches")
        ->capture_default_str()
        ->check(CLI::Range(1, 64));
    command->add_option("--checkpoint-every", run.checkpoint_every_s, "seconds")
        ->capture_default_str()
        ->check(CLI::Range(1.0, 1e5));
    command->add_option("--name", run.name, "of the bundle")->capture_default_str();
    command->add_flag("--plain", run.plain,
                      "the published networks: one encoder, positional encoding, concatenated decoder");
    command->add_flag("--single-precision", single_precision, "don't use bfloat16 even where the CPU has it");
  };
  auto* training = app.add_subcommand("train", "Train (continues from the folder's checkpoint)");
  training->add_option("--data", run.dataset_file, "data set")->required();
  training->add_option("--run", run.folder, "folder of checkpoint.pt and log.csv")->required();
  training->add_option("--bundle", run.bundle_folder, "export here at every checkpoint");
  training->add_option("--images", run.images, "image passes in all")
      ->capture_default_str()
      ->check(CLI::Range(1ull, 10'000'000'000ull));
  training->add_option("--seed", run.seed)->capture_default_str();
  training_options(training);

  EvaluateOptions evaluation;
  auto* evaluating = app.add_subcommand("evaluate", "Held-out error of a bundle");
  evaluating->add_option("--bundle", evaluation.bundle)->required();
  evaluating->add_option("--data", evaluation.dataset_file, "data set of another seed than the training's")->required();
  evaluating->add_option("--limit", evaluation.limit, "at most so many samples; 0 = all")->capture_default_str();
  evaluating->add_option("--prior-sigma", evaluation.prior_sigma_m, "noise of the prior per axis, m")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 2.0));
  evaluating->add_option("--noise-scale", evaluation.noise_scale, "of the sensor's noise")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 10.0));
  evaluating->add_option("--out", out, "folder for evaluation.csv and evaluation.txt");

  bool plain = false;
  std::string name = "race";
  auto* exporting = app.add_subcommand("export", "Write a bundle from a checkpoint");
  exporting->add_option("--checkpoint", checkpoint)->required();
  exporting->add_option("--out", bundle, "the bundle's folder (replaced as a whole)")->required();
  exporting->add_option("--name", name)->capture_default_str();
  exporting->add_flag("--plain", plain);

  std::string profile_name = "ship";
  auto* all = app.add_subcommand("all", "Data set, training, export and evaluation; continues where it stopped");
  all->add_option("--profile", profile_name,
                  "ship: what the repository's model was made with; try: minutes, to see it work")
      ->capture_default_str()
      ->check(CLI::IsMember({"ship", "try"}));
  all->add_option("--work", work, "folder for data and checkpoints (ship: 9 GB)")->required();
  all->add_option("--out", out, "the bundle's folder")->required();
  all->add_option("--threads", threads, "for rendering")->capture_default_str()->check(CLI::Range(1, 256));
  training_options(all);

  CLI11_PARSE(app, argc, argv);
  run.allow_bf16 = !single_precision;

  if (*generate) {
    if (const int code = generate_file(file, seed, samples, threads); code != 0) return code;
    if (sheet_file.empty()) return 0;
    const auto dataset = Dataset::open(file);
    if (!dataset) return fail(dataset.error());
    const Status written = write_contact_sheet(*dataset, sheet, {}, sheet_file);
    return written ? 0 : fail(written.error());
  }
  if (*training) return run_training(run);
  if (*evaluating) return run_evaluation(evaluation, out);
  if (*exporting) return export_checkpoint(checkpoint, plain, name, bundle);
  const Profile profile = profile_name == "ship" ? Profile{200'000, 4'000, 1'200'000} : Profile{6'000, 400, 40'000};
  if (all->count("--name") == 0) run.name = "race";
  return run_all(profile, work, out, run, threads);
}
