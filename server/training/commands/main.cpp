// gatefield-train: data sets, training, export and held-out evaluation of model bundles (docs/training.md).

#include <malloc.h>

#include <CLI/CLI.hpp>

#include "server/training/commands/all_command.h"
#include "server/training/commands/command.h"
#include "server/training/commands/compare_command.h"
#include "server/training/commands/evaluate_command.h"
#include "server/training/commands/figures_command.h"
#include "server/training/commands/fit_noise_command.h"
#include "server/training/commands/generate_command.h"
#include "server/training/commands/import_command.h"
#include "server/training/commands/stereo_command.h"
#include "server/training/commands/train_command.h"

int main(int argc, char** argv) {
  using namespace gatefield::training;
  // libtorch asks for and gives back tens of megabytes in every step; keep them instead of returning them to the
  // kernel.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  mallopt(M_TOP_PAD, 64 << 20);
  stop_on_signals();

  CLI::App app{
      "Makes the model bundles that gatefield-server flies with: depth images of simulated gates, training, ONNX "
      "export, held-out error.\n"
      "Everything made: gatefield-train all --profile ship --work /var/tmp/gatefield --out deploy/models"};
  app.require_subcommand(1);
  int exit_code = 0;
  add_all_command(&app, &exit_code);
  add_generate_command(&app, &exit_code);
  add_import_command(&app, &exit_code);
  add_stereo_command(&app, &exit_code);
  add_fit_noise_command(&app, &exit_code);
  add_train_command(&app, &exit_code);
  add_designs_command(&app, &exit_code);
  add_export_command(&app, &exit_code);
  add_compare_command(&app, &exit_code);
  add_evaluate_command(&app, &exit_code);
  add_figures_command(&app, &exit_code);
  CLI11_PARSE(app, argc, argv);
  return exit_code;
}
