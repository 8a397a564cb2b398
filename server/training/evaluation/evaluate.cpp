#include "server/training/evaluation/evaluate.h"

#include <algorithm>

#include "common/base/statistics.h"
#include "common/model/bundle.h"

namespace gatefield::training {
namespace {

// About what a piece of work takes, in milliseconds of one core: for the progress alone.
constexpr double kFrame_ms = 0.8, kFrameAndBundle_ms = 5.0;
constexpr double kPair_ms = 20.0, kPairAndBundle_ms = 3.0;
constexpr double kFlight_ms = 120.0, kFlightAndBundle_ms = 70.0;

}  // namespace

Named::Named(const std::filesystem::path& from) : path(from) {
  const std::filesystem::path plain = from.has_filename() ? from : from.parent_path();  // "folder/" is "folder"
  name = plain.extension() == ".h5" || plain.extension() == ".hdf5" ? plain.stem().string() : plain.filename().string();
}

Named Named::parse(const std::string& text) {
  const std::size_t at = text.find('=');
  if (at == std::string::npos || at == 0) return Named(std::filesystem::path(text));
  return {text.substr(0, at), text.substr(at + 1)};
}

Status validate(const EvaluateOptions& options) {
  const auto wrong = [](const std::string& what) { return Error{"evaluation: " + what}; };
  if (options.datasets.empty()) return wrong("no data set is given");
  if (options.threads < 1 || options.threads > 256)
    return wrong(std::to_string(options.threads) + " threads, expected 1 to 256");
  if (!(options.prior_sigma_m >= 0.0 && options.prior_sigma_m <= 2.0))
    return wrong("the prior's noise is " + std::to_string(options.prior_sigma_m) + " m, expected 0 to 2 m");
  if (!(options.noise_scale >= 0.0 && options.noise_scale <= 10.0))
    return wrong("the sensor's noise is scaled by " + std::to_string(options.noise_scale) + ", expected 0 to 10");
  if (options.two_gates.count < 0 || options.approach.count < 0)
    return wrong("a negative number of pairs or approaches");
  std::vector<std::string> names;
  for (const Named& set : options.datasets) names.push_back("data set " + set.name);
  names.push_back("bundle " + options.bundle.name);
  for (const Named& bundle : options.against) names.push_back("bundle " + bundle.name);
  std::sort(names.begin(), names.end());
  const auto twice = std::adjacent_find(names.begin(), names.end());
  if (twice != names.end()) return wrong("two are called " + *twice + "; give them names of their own: name=path");
  return {};
}

Result<Evaluation> evaluate(const EvaluateOptions& options, const std::function<bool(double)>& progress) {
  if (Status checked = validate(options); !checked) return checked.failure();
  std::vector<model::Bundle> bundles;
  std::vector<Named> named{options.bundle};
  named.insert(named.end(), options.against.begin(), options.against.end());
  for (const Named& one : named) {
    auto bundle = model::Bundle::read(one.path);
    if (!bundle) return bundle.failure();
    bundles.push_back(std::move(bundle).value());
  }
  std::vector<Dataset> datasets;
  std::vector<std::uint64_t> counts;
  for (const Named& one : options.datasets) {
    auto dataset = Dataset::open(one.path);
    if (!dataset) return dataset.failure();
    if (dataset->size() == 0) return Error{"data set " + one.path.string() + " has no samples"};
    counts.push_back(options.limit > 0 ? std::min(options.limit, dataset->size()) : dataset->size());
    datasets.push_back(std::move(dataset).value());
  }
  std::vector<Observers> threads(static_cast<std::size_t>(options.threads));
  for (Observers& observers : threads) {
    for (const model::Bundle& bundle : bundles) {
      auto observer = Observer::create(bundle);
      if (!observer) return observer.failure();
      observers.push_back(std::move(observer).value());
    }
  }

  const auto bundle_n = static_cast<double>(bundles.size());
  const double frame_ms = kFrame_ms + kFrameAndBundle_ms * bundle_n;
  const double pair_ms = kPair_ms + kPairAndBundle_ms * bundle_n;
  const double flight_ms = kFlight_ms + kFlightAndBundle_ms * bundle_n;
  double total_ms = pair_ms * options.two_gates.count + flight_ms * options.approach.count;
  for (const std::uint64_t count : counts) total_ms += frame_ms * static_cast<double>(count);
  double before_ms = 0.0;
  const auto report = [&](double one_ms) {
    return [&, one_ms](std::uint64_t done) {
      return !progress || progress(std::min(1.0, (before_ms + one_ms * static_cast<double>(done)) / total_ms));
    };
  };
  const Error stopped{"evaluation stopped"};

  Evaluation out;
  out.options = options;
  for (std::size_t i = 0; i < datasets.size(); ++i) {
    HeldOutOptions held_out;
    held_out.count = counts[i];
    held_out.prior_sigma_m = options.prior_sigma_m;
    held_out.noise_scale = options.noise_scale;
    held_out.seed = options.seed;
    auto frames = measure_held_out(datasets[i], held_out, &threads, report(frame_ms));
    if (!frames) return stopped;
    out.sets.push_back({options.datasets[i].name, datasets[i].kind(), std::move(*frames)});
    before_ms += frame_ms * static_cast<double>(counts[i]);
  }
  // Times are those of the held-out images: the same mixture of looks for every bundle.
  for (std::size_t i = 0; i < bundles.size(); ++i) {
    std::vector<double> prior_ms, first_ms;
    for (const Observers& observers : threads) {
      prior_ms.insert(prior_ms.end(), observers[i]->prior_ms.begin(), observers[i]->prior_ms.end());
      first_ms.insert(first_ms.end(), observers[i]->first_ms.begin(), observers[i]->first_ms.end());
    }
    out.bundles.push_back({named[i].name, bundles[i].manifest().validity_threshold, quantile(prior_ms, 0.5),
                           quantile(prior_ms, 0.99), quantile(first_ms, 0.5)});
  }
  if (options.two_gates.count > 0) {
    auto pairs = measure_two_gates(options.two_gates, &threads, report(pair_ms));
    if (!pairs) return stopped;
    out.two_gates = std::move(*pairs);
    before_ms += pair_ms * options.two_gates.count;
  }
  if (options.approach.count > 0) {
    auto flights = measure_approaches(options.approach, &threads, report(flight_ms));
    if (!flights) return stopped;
    out.approaches = std::move(*flights);
  }
  return out;
}

}  // namespace gatefield::training
