#include <algorithm>

#include "client/race/campaign_spec.h"
#include "client/race/tune/cma_es.h"
#include "client/race/tune/default_fields.h"
#include "client/race/tune/tune.h"
#include "client/race/tune/tune.pb.h"
#include "common/base/text.h"
#include "common/config/text_file.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;
using Lines = google::protobuf::TextFormat::ParseInfoTree;

constexpr std::uint64_t kUsualFreshSeeds = 20;
constexpr std::size_t kLongestCellName = 50;  // what a candidate adds has room

/// Sentences with the line where a field stands.
class Text {
 public:
  Text(const fs::path& file, const Lines& lines) : file_(file.string()), lines_(lines) {}

  Error error(const std::string& field, const Error& failure) const {
    const auto* descriptor = TuneFile::descriptor()->FindFieldByName(field);
    const int line = lines_.GetLocation(descriptor, descriptor->is_repeated() ? 0 : -1).line;
    return failure.at(file_, line < 0 ? 0 : line + 1);
  }
  template <typename T>
  Status check(const std::string& field, T value, T low, T high, const std::string& unit = {}) const {
    if (value >= low && value <= high) return {};
    return error(field, Error::invalid(field, text(value), text(low) + " to " + text(high) + unit));
  }

 private:
  std::string file_;
  const Lines& lines_;
};

std::string words(const SeedRange& seeds) { return std::to_string(seeds.first) + " to " + std::to_string(seeds.last); }

bool overlap(const SeedRange& a, const SeedRange& b) { return a.first <= b.last && b.first <= a.last; }

/// Races that a campaign may hold, and a search may not.
Status check_races(const Text& text, const TuneFile& spec, const Campaign& races) {
  const auto wrong = [&](const std::string& cell, const std::string& sentence) {
    return text.error("races", Error{"cell '" + cell + "': " + sentence, ErrorCode::kInvalid, "races"});
  };
  if (spec.races().defaults().has_profile())
    return wrong("defaults", "profile is set, expected none: it is looked for");
  for (const CellSpec& cell : spec.races().cell())
    if (cell.has_profile()) return wrong(cell.name(), "profile is set, expected none: it is looked for");
  for (const Cell& cell : races.cells) {
    if (cell.name.size() > kLongestCellName)
      return wrong(cell.name, "name has " + std::to_string(cell.name.size()) + " characters, expected at most " +
                                  std::to_string(kLongestCellName) + " in a search");
    if (cell.scenario.vehicle.actuation.kind != races.cells.front().scenario.vehicle.actuation.kind)
      return wrong(cell.name, "its vehicle is driven in another way than that of cell '" + races.cells.front().name +
                                  "', expected one way in a search: a profile's noise is for one of them");
  }
  return {};
}

Status check_seeds(const Text& text, const Tune& tune, bool evaluation_seeds) {
  const auto wrong = [&](const char* field, const std::string& sentence) {
    return text.error(field, Error{sentence, ErrorCode::kInvalid, field});
  };
  const std::string lab = "expected seeds of the lab, 1 to " + std::to_string(kFirstEvaluationSeed - 1) + ": from " +
                          std::to_string(kFirstEvaluationSeed) +
                          " on they are for evaluation, and what was tuned on them can't be judged by them "
                          "(--evaluation-seeds flies them all the same)";
  if (tune.fresh_seeds.last < tune.fresh_seeds.first || tune.fresh_seeds.count() > kMaxSeeds)
    return wrong("fresh_seeds", "fresh_seeds is " + words(tune.fresh_seeds) + ", expected first <= last and at most " +
                                    std::to_string(kMaxSeeds) + " of them");
  for (const Cell& cell : tune.races.cells) {
    if (cell.seeds.last >= kFirstEvaluationSeed && !evaluation_seeds)
      return wrong("races", "cell '" + cell.name + "': seeds is " + words(cell.seeds) + ", " + lab);
    if (cell.seeds.count() < tune.seeds_per_generation)
      return wrong("races", "cell '" + cell.name + "': seeds is " + words(cell.seeds) + ", expected at least " +
                                std::to_string(tune.seeds_per_generation) + " of them (seeds_per_generation)");
    if (overlap(cell.seeds, tune.fresh_seeds))
      return wrong("fresh_seeds", "fresh_seeds is " + words(tune.fresh_seeds) + ", expected none of those of cell '" +
                                      cell.name + "', " + words(cell.seeds) + ": the comparison is on others");
  }
  if (tune.fresh_seeds.last >= kFirstEvaluationSeed && !evaluation_seeds)
    return wrong("fresh_seeds", "fresh_seeds is " + words(tune.fresh_seeds) + ", " + lab);
  return {};
}

}  // namespace

std::size_t Tune::races_per_seed() const noexcept {
  std::size_t count = 0;
  for (const Cell& cell : races.cells) count += cell.speeds_m_s.size();
  return count;
}

Result<Tune> load_tune(const fs::path& file, const TuneOrder& order) {
  TuneFile spec;
  Lines lines;
  if (auto status = config::load_text(file, &spec, &lines); !status) return status.failure();
  const Text text(file, lines);
  const auto* races_field = TuneFile::descriptor()->FindFieldByName("races");
  auto races = make_campaign(file, spec.races(), *lines.GetTreeForNested(races_field, -1));
  if (!races) return races.failure();
  if (auto status = check_races(text, spec, *races); !status) return status.failure();

  Tune tune;
  tune.title = spec.has_title() ? spec.title() : file.stem().string();
  tune.base_profile = spec.profile();
  tune.races = std::move(races).value();
  for (const TunedFieldSpec& field : spec.field()) {
    WantedField wanted{field.name(), {}, {}, {}};
    if (field.has_min()) wanted.min = field.min();
    if (field.has_max()) wanted.max = field.max();
    if (field.has_scale()) wanted.logarithmic = field.scale() == TunedFieldSpec::LOGARITHMIC;
    tune.fields.push_back(wanted);
  }
  if (spec.has_candidates()) {
    if (auto status = text.check("candidates", spec.candidates(), kMinCandidates, 200); !status)
      return status.failure();
    tune.candidates = spec.candidates();
  }
  if (auto status = text.check("seeds_per_generation", spec.seeds_per_generation(), 1, 1000); !status)
    return status.failure();
  tune.seeds_per_generation = static_cast<std::uint64_t>(spec.seeds_per_generation());
  if (auto status = text.check("spread", spec.spread(), 0.01, 1.0); !status) return status.failure();
  tune.spread = spec.spread();
  tune.seed = spec.seed();

  std::uint64_t last = 0;
  for (const Cell& cell : tune.races.cells) last = std::max(last, cell.seeds.last);
  tune.fresh_seeds = spec.has_fresh_seeds() ? SeedRange{spec.fresh_seeds().first(), spec.fresh_seeds().last()}
                                            : SeedRange{last + 1, last + kUsualFreshSeeds};
  if (auto status = check_seeds(text, tune, order.evaluation_seeds); !status) return status.failure();

  tune.budget = order.budget;
  if (!tune.budget.trials && !tune.budget.minutes) {
    if (spec.has_trials()) tune.budget.trials = static_cast<std::size_t>(spec.trials());
    if (spec.has_minutes()) tune.budget.minutes = spec.minutes();
  }
  if (!tune.budget.trials && !tune.budget.minutes)
    return Error{"there is no budget, expected trials or minutes in the file, or --trials or --minutes",
                 ErrorCode::kInvalid, "trials"}
        .at(file.string());
  if (tune.budget.minutes)
    if (auto status = text.check("minutes", *tune.budget.minutes, 1.0, 100'000.0); !status) return status.failure();
  return tune;
}

Result<Space> space_of(const Tune& tune, const ProfileSheet& base) {
  if (tune.fields.empty())
    return Space::make(default_fields(base, tune.races.cells.front().scenario.vehicle.actuation.kind), base);
  std::vector<Dimension> dimensions;
  for (const WantedField& wanted : tune.fields) {
    Dimension d{wanted.name, wanted.min.value_or(0.0), wanted.max.value_or(0.0), true};
    if (!wanted.min || !wanted.max) {
      const double value = base.number(wanted.name).value_or(1.0);
      if (!(value > 0.0))
        return Error{"field '" + wanted.name + "': the base has " + brief(value) + ", expected min and max",
                     ErrorCode::kInvalid, wanted.name};
      if (base.number(wanted.name)) {
        const Dimension usual = around_the_base(base, wanted.name);
        d.min = wanted.min.value_or(usual.min);
        d.max = wanted.max.value_or(usual.max);
      }
    }
    d.logarithmic = wanted.logarithmic.value_or(d.min > 0.0);
    dimensions.push_back(d);
  }
  return Space::make(std::move(dimensions), base);
}

}  // namespace gatefield::race
