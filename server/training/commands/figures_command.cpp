#include "server/training/commands/figures_command.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/model/bundle.h"
#include "server/training/commands/command.h"
#include "server/training/evaluation/evaluate.h"
#include "server/training/evaluation/slices.h"

namespace gatefield::training {
namespace {

struct Options {
  std::string bundle;
  std::vector<std::string> against;
  std::string data;
  std::filesystem::path out;
  int frames = 5;
  std::uint64_t seed = 1'000'011;
};

int run_figures(const Options& options) {
  std::vector<Named> named{Named::parse(options.bundle)};
  for (const std::string& text : options.against) named.push_back(Named::parse(text));
  std::vector<std::unique_ptr<model::Bundle>> bundles;
  std::vector<std::unique_ptr<Observer>> observers;
  std::vector<NamedObserver> side_by_side;
  for (const Named& one : named) {
    auto bundle = model::Bundle::read(one.path);
    if (!bundle) return fail(bundle.error());
    bundles.push_back(std::make_unique<model::Bundle>(std::move(bundle).value()));
    auto observer = Observer::create(*bundles.back());
    if (!observer) return fail(observer.error());
    observers.push_back(std::move(observer).value());
    side_by_side.push_back({one.name, observers.back().get()});
  }
  if (const Status made = make_folder(options.out); !made) return fail(made.error());
  const std::filesystem::path occlusions = options.out / "occlusions.png";
  if (const Status drawn = draw_occlusions(observers[0].get(), options.seed, occlusions); !drawn)
    return fail(drawn.error());
  std::printf("%s\n", occlusions.c_str());
  if (options.data.empty()) return 0;
  const auto dataset = Dataset::open(options.data);
  if (!dataset) return fail(dataset.error());
  const std::filesystem::path stages = options.out / "side-by-side.png";
  if (const Status drawn = draw_side_by_side(side_by_side, *dataset, options.frames, options.seed, stages); !drawn)
    return fail(options.data + ": " + drawn.error());
  std::printf("%s\n", stages.c_str());
  return 0;
}

}  // namespace

void add_figures_command(CLI::App* app, int* exit_code) {
  const auto options = std::make_shared<Options>();
  auto* command = app->add_subcommand(
      "figures",
      "Pictures of a bundle's field: slices under six kinds of occlusion and noise; with --data the same frames "
      "through several bundles.\n"
      "Example: gatefield-train figures --bundle \"both=deploy/models/race\" --against \"stage 1=work/stage1\" --data "
      "work/stereo-held-out.h5 --out figures");
  command->add_option("--bundle", options->bundle, "the bundle's folder; 'name=folder' gives it a name")->required();
  command
      ->add_option("--against", options->against, "another bundle to stand beside it; can be given again (with --data)")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command->add_option("--data", options->data, "data set that the frames are taken from");
  command->add_option("--frames", options->frames, "how many of them")->capture_default_str()->check(CLI::Range(1, 20));
  command->add_option("--seed", options->seed, "of the sensor's noise")->capture_default_str();
  command->add_option("--out", options->out, "folder for the pictures (made when it isn't there)")->required();
  command->callback([options, exit_code] { *exit_code = run_figures(*options); });
}

}  // namespace gatefield::training
