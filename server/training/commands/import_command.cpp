#include "server/training/commands/import_command.h"

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <memory>

#include "common/base/progress_line.h"
#include "server/training/commands/command.h"
#include "server/training/data/contact_sheet.h"
#include "server/training/data/example_recording.h"
#include "server/training/data/import.h"
#include "server/training/data/statistics.h"
#include "server/training/learn/train_loop.h"

namespace gatefield::training {
namespace {

struct Options {
  std::filesystem::path file, example, sheet_file;
  ImportOptions import;
  int sheet = 64;
  bool statistics = false;
};

int run_import(const Options& options) {
  ImportSummary summary;
  {
    ProgressLine line("import");
    const auto start = std::chrono::steady_clock::now();
    const auto imported = import_recordings(options.file, options.import, [&](std::uint64_t done, std::uint64_t total) {
      const double spent_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const double part = static_cast<double>(done) / static_cast<double>(total);
      line.show(part, spent_s / part * (1.0 - part), std::to_string(done) + " frames");
      return !stop_requested;
    });
    if (stop_requested) {
      std::printf("import stopped; nothing is kept\n");
      return kStopped;
    }
    if (!imported) return fail(imported.error());
    summary = *imported;
  }
  const double valid = static_cast<double>(summary.with_valid_gate) / static_cast<double>(summary.frames);
  std::printf("%s: %llu frames, a valid gate in %.0f %%, %.0f %% of the pixels with a return\n", options.file.c_str(),
              static_cast<unsigned long long>(summary.frames), 100.0 * valid, 100.0 * summary.returns);
  if (valid < 0.3) {
    std::printf(
        "That is little. Look at --contact-sheet: when the outlines don't lie on the gates, check that poses are of "
        "the "
        "optical frame (x right, y down, z forward), from camera to world, quaternions w x y z, depth_unit_m.\n");
  }
  const auto dataset = Dataset::open(options.file);
  if (!dataset) return fail(dataset.error());
  if (options.statistics) std::printf("%s", to_text(count_statistics(*dataset)).c_str());
  if (options.sheet_file.empty()) return 0;
  const Status written = write_contact_sheet(*dataset, options.sheet, {}, options.sheet_file);
  return written ? 0 : fail(written.error());
}

}  // namespace

void add_import_command(CLI::App* app, int* exit_code) {
  const auto options = std::make_shared<Options>();
  auto* command = app->add_subcommand(
      "import", "Turn recordings of a depth camera (16-bit PNG, camera.txt, poses.csv, gates.csv) into a data set");
  auto* recordings = command->add_option("--recording", options->import.recordings,
                                         "a recording's folder (docs/datasets.md); may be given several times");
  auto* out = command->add_option("--out", options->file, "the data set's file");
  command->add_option("--note", options->import.note, "kept in the file, for people");
  command->add_flag("--statistics", options->statistics, "print what is in the set");
  command->add_option("--contact-sheet", options->sheet_file,
                      "also write a PNG of some images with the gates drawn in");
  command->add_option("--contact-sheet-images", options->sheet)->capture_default_str()->check(CLI::Range(1, 1000));
  auto* example =
      command->add_option("--example", options->example, "write a rendered recording of 120 frames here, to look at");
  recordings->needs(out);
  out->needs(recordings);
  example->excludes(recordings);
  command->callback([options, exit_code] {
    constexpr int kExampleFrames = 120;
    if (!options->example.empty()) {
      const Status written = write_example_recording(options->example, kExampleFrames);
      *exit_code = written ? 0 : fail(written.error());
      if (written) {
        std::printf("%s: try gatefield-train import --recording %s --out example.h5 --contact-sheet example.png\n",
                    options->example.c_str(), options->example.c_str());
      }
      return;
    }
    if (options->import.recordings.empty()) {
      *exit_code = fail("import needs --recording and --out, or --example");
      return;
    }
    *exit_code = run_import(*options);
  });
}

}  // namespace gatefield::training
