// gatefield-server: reads model and profiles, joins the DDS domain, and serves until it is told to end.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <utility>

#include "common/base/text.h"
#include "common/model/bundle.h"
#include "server/app/data_files.h"
#include "server/app/program.h"
#include "server/perception/learned/learned_sensor.h"

namespace gatefield::app {
namespace {

constexpr const char* kDescription =
    "Plans for drones that race through gates: depth images and vehicle states in, thrust-rate plans out, over DDS.";

constexpr const char* kFooter = R"(Examples:
  gatefield-server
      the model and the profiles that come with it, DDS domain 0
  gatefield-server --domain 7 --name lab --model ~/models/night --log-level debug
      another domain, another name, a model of your own
  gatefield-server --profiles ~/profiles --max-vehicles 4 --threads 4 --realtime
      your own planner profiles; four vehicles; real-time priority (needs CAP_SYS_NICE and CAP_IPC_LOCK, or root)
  gatefield-server --isa avx2
      forces an instruction set, to compare machines
  gatefield-server --metrics 127.0.0.1:9464 --log-format json
      figures for Prometheus, /healthz, and a log for machines

  gatefield-server --name a --standby b --standby-of b
      and on another machine the same of b and a: each goes on with the vehicles of the other when that falls silent

Signals: SIGHUP reads the profiles again, for sessions that begin then. SIGUSR1 drains: vehicles are handed over to the
stand-by, newcomers are refused, and the server ends with its last vehicle.

Exit codes: 0 ended by SIGINT or SIGTERM, or drained, 2 arguments, model or configuration, 3 the domain could not be
joined, 4 deaf in shared memory.)";

/// A model with encoders for as many threads as look at images.
struct Model {
  model::Bundle bundle;
  std::unique_ptr<perception::EncoderPool> encoders;
};

Result<Eyes> learned_eyes(std::filesystem::path folder, const Options& options, const kernels::Backend& backend) {
  if (folder.empty()) {
    auto found = find_data_folder("models/race", "--model FOLDER");
    if (!found) return found.failure();
    folder = *found;
  }
  auto bundle = model::Bundle::read(folder);
  if (!bundle) return bundle.failure();
  const auto model = std::make_shared<Model>(Model{std::move(bundle).value(), nullptr});
  // Before anyone can join: a model whose networks don't load is found here.
  auto encoders = perception::EncoderPool::create(model->bundle, options.perception_threads);
  if (!encoders) return encoders.failure();
  model->encoders = std::move(encoders).value();

  const model::Manifest& manifest = model->bundle.manifest();
  Eyes eyes;
  eyes.words = "model " + manifest.name + " (" + folder.string() + ", hash " + hex(model->bundle.hash()) + ")";
  eyes.warnings = model->bundle.warnings();
  eyes.model_hash = model->bundle.hash();
  eyes.cone_angle_rad = manifest.cone_angle_rad;
  eyes.sensor = [model, decoder = backend.prepare(model->bundle.decoder())](
                    const protocol::SessionRequest& request) -> Result<std::unique_ptr<perception::GateSensor>> {
    if (auto status = perception::check_openings(model->bundle.manifest(), request.course); !status)
      return status.failure();
    return std::unique_ptr<perception::GateSensor>(
        std::make_unique<perception::LearnedSensor>(&model->bundle, decoder, model->encoders.get()));
  };
  return eyes;
}

}  // namespace
}  // namespace gatefield::app

int main(int argc, char** argv) {
  using namespace gatefield::app;
  CLI::App app{kDescription, "gatefield-server"};
  app.footer(kFooter);
  app.set_version_flag("--version", "gatefield-server " GATEFIELD_VERSION);
  std::filesystem::path model;
  app.add_option("--model", model,
                 "Folder of a trained model (manifest.txt and its ONNX files); else models/race of the installation's "
                 "share/gatefield, of the sources' deploy, or of ./deploy")
      ->type_name("FOLDER");
  Options options;
  add_options(&app, &options);
  return run_program(&app, argc, argv, [&] {
    return serve("gatefield-server", options,
                 [&](const gatefield::kernels::Backend& backend) { return learned_eyes(model, options, backend); });
  });
}
