#include <google/protobuf/text_format.h>

#include <algorithm>
#include <set>

#include "client/race/campaign.h"
#include "client/race/campaign.pb.h"
#include "client/race/campaign_spec.h"
#include "client/race/single_cell.h"
#include "common/base/text.h"
#include "common/config/locate.h"
#include "common/config/text_file.h"
#include "common/course/course.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;
using Lines = google::protobuf::TextFormat::ParseInfoTree;

constexpr int kMaxCells = 1000;

// The files' numbers are the code's: reading and saving cast between them.
static_assert(LEARNED == static_cast<int>(Perception::kLearned) && NONE == static_cast<int>(Perception::kNone) &&
              CLASSICAL == static_cast<int>(Perception::kClassical) &&
              TRUE_POSE == static_cast<int>(Perception::kTruePose));
static_assert(FigureSpec::SPEED == static_cast<int>(Against::kSpeed) &&
              FigureSpec::DELAY == static_cast<int>(Against::kDelay) &&
              FigureSpec::JITTER == static_cast<int>(Against::kJitter) &&
              FigureSpec::LOSS == static_cast<int>(Against::kLoss) &&
              FigureSpec::POSITION == static_cast<int>(Against::kPosition) &&
              FigureSpec::YAW == static_cast<int>(Against::kYaw) &&
              FigureSpec::TILT == static_cast<int>(Against::kTilt));

bool good_name(const std::string& name) {
  return !name.empty() && name.size() <= 60 &&
         name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.-") ==
             std::string::npos &&
         name.front() != '.' && name.front() != '-';
}

/// Where a cell stands in its file, for the sentences.
class Place {
 public:
  Place(const fs::path& file, const CampaignFile& spec, const Lines& lines, int cell)
      : file_(file.string()), name_(spec.cell(cell).name()) {
    const auto* type = CampaignFile::descriptor();
    const auto* field = type->FindFieldByName("cell");
    line_ = lines.GetLocation(field, cell).line;
    cell_ = lines.GetTreeForNested(field, cell);
    const auto* defaults = type->FindFieldByName("defaults");
    if (spec.has_defaults()) defaults_ = lines.GetTreeForNested(defaults, -1);
  }

  /// What is wrong with a field, at the line where the cell or the defaults set it.
  Error error(const std::string& field, const Error& failure) const {
    const int line = line_of(field);
    return at(line < 0 ? line_ : line, failure);
  }
  Error error(const std::string& field, const std::string& sentence) const {
    return error(field, Error{sentence, ErrorCode::kInvalid, field});
  }

  /// What is wrong with the scenario, at the line of the field that sets it or names its file, else where the scenario
  /// is named.
  Error scenario_error(const config::ScenarioFile& scenario, const Error& failure) const {
    int line = line_of(failure.file == scenario.vehicle()  ? "vehicle"
                       : failure.file == scenario.course() ? "course"
                                                           : cell_field(failure.field));
    if (line < 0) line = line_of("scenario");
    return at(line < 0 ? line_ : line, failure);
  }

 private:
  /// The field of a cell that sets what a scenario's field says.
  static std::string cell_field(const std::string& scenario_field) {
    if (scenario_field == "camera.rate_hz") return "camera_rate_hz";
    const std::string first = scenario_field.substr(0, scenario_field.find('.'));
    return first == "noise" ? "sensor_noise" : first;
  }
  int line_of(const std::string& field) const {
    const auto* descriptor = CellSpec::descriptor()->FindFieldByName(field);
    int line = -1;
    for (const Lines* tree : {cell_, defaults_})
      if (tree != nullptr && descriptor != nullptr && line < 0)
        line = tree->GetLocation(descriptor, descriptor->is_repeated() ? 0 : -1).line;
    return line;
  }
  Error at(int line, const Error& failure) const { return failure.at(file_, line + 1, 0, "cell '" + name_ + "': "); }

  std::string file_;
  std::string name_;
  int line_ = 0;
  const Lines* cell_ = nullptr;
  const Lines* defaults_ = nullptr;
};

Status check(const Place& place, const std::string& field, const std::string& name, double value, double low,
             double high, const std::string& unit) {
  if (value >= low && value <= high) return {};
  return place.error(field, Error::invalid(name, brief(value), brief(low) + " to " + brief(high) + unit));
}

/// What a cell sets replaces what the defaults say, field by field, whole.
CellSpec with_defaults(const CellSpec& defaults, const CellSpec& cell) {
  CellSpec merged = defaults;
  std::vector<const google::protobuf::FieldDescriptor*> set;
  CellSpec::GetReflection()->ListFields(cell, &set);
  for (const auto* field : set) CellSpec::GetReflection()->ClearField(&merged, field);
  merged.MergeFrom(cell);
  return merged;
}

/// What a cell that stands beside another one takes from it.
CellSpec without_results(CellSpec spec) {
  spec.clear_goal();
  spec.clear_published();
  spec.clear_title();
  spec.clear_series();
  spec.clear_rollouts();
  return spec;
}

/// The cell's scenario with everything that the cell says in place of it; names are absolute.
Result<config::ScenarioFile> scenario_of(const fs::path& file, const CellSpec& spec, const Place& place) {
  config::ScenarioFile scenario;
  const auto find = [&](const std::string& kind, const std::string& name, const fs::path& base) {
    auto found = config::find_config(kind, name, base);
    return found ? Result<fs::path>(fs::absolute(*found)) : found;
  };
  if (spec.has_scenario()) {
    const auto found = find("scenarios", spec.scenario(), file.parent_path());
    if (!found) return place.error("scenario", found.failure().within("scenario: "));
    if (auto status = config::load_text(*found, &scenario); !status) return status.failure();
    const fs::path base = found->parent_path();
    for (auto [kind, name] :
         {std::pair("courses", scenario.mutable_course()), std::pair("vehicles", scenario.mutable_vehicle())}) {
      const auto part = find(kind, *name, base);
      if (!part) return place.error("scenario", part.failure().within("scenario: "));
      *name = part->string();
    }
    if (scenario.has_sensor_noise_file())
      scenario.set_sensor_noise_file(fs::absolute(base / scenario.sensor_noise_file()).string());
  } else if (!spec.has_course() || !spec.has_vehicle()) {
    return place.error("scenario", "scenario is missing, expected a scenario, or a course and a vehicle");
  }
  if (spec.has_course()) {
    const auto found = find("courses", spec.course(), file.parent_path());
    if (!found) return place.error("course", found.failure().within("course: "));
    scenario.set_course(found->string());
  }
  if (spec.has_vehicle()) {
    const auto found = find("vehicles", spec.vehicle(), file.parent_path());
    if (!found) return place.error("vehicle", found.failure().within("vehicle: "));
    scenario.set_vehicle(found->string());
  }
  if (spec.has_perturbation()) *scenario.mutable_perturbation() = spec.perturbation();
  if (spec.has_sensor_noise()) {
    *scenario.mutable_sensor_noise() = spec.sensor_noise();
    scenario.clear_sensor_noise_file();
    scenario.clear_stereo();
  }
  if (spec.has_stereo()) {
    *scenario.mutable_stereo() = spec.stereo();
    if (!spec.has_sensor_noise()) scenario.clear_sensor_noise();
    scenario.clear_sensor_noise_file();
  }
  if (spec.has_state_noise()) *scenario.mutable_state_noise() = spec.state_noise();
  if (spec.has_mismatch()) *scenario.mutable_mismatch() = spec.mismatch();
  if (spec.has_actuation()) *scenario.mutable_actuation() = spec.actuation();
  if (spec.has_hull()) scenario.set_hull(spec.hull());
  if (spec.world_size() > 0) {
    *scenario.mutable_world() = spec.world();
    scenario.clear_world_sizes();
  }
  if (spec.has_world_sizes()) *scenario.mutable_world_sizes() = spec.world_sizes();
  if (spec.has_camera_rate_hz()) scenario.set_camera_rate_hz(spec.camera_rate_hz());
  if (spec.has_time_limit_s()) scenario.set_time_limit_s(spec.time_limit_s());
  scenario.clear_seed();
  if (spec.has_planner_seed()) scenario.set_planner_seed(spec.planner_seed());
  if (spec.has_title()) scenario.set_title(spec.title());
  return scenario;
}

/// The scenario as it will lie beside its course, vehicle and noise under the cell's name.
std::string text_of(config::ScenarioFile scenario, const std::string& cell) {
  scenario.set_course(cell + ".course.txt");
  scenario.set_vehicle(cell + ".vehicle.txt");
  if (scenario.has_sensor_noise_file()) scenario.set_sensor_noise_file(cell + ".noise.txt");
  std::string text;
  google::protobuf::TextFormat::PrintToString(scenario, &text);
  return text;
}

std::string model_of(const fs::path& file, const std::string& name) {
  std::error_code failure;
  const fs::path beside = file.parent_path() / name;
  if (fs::path(name).is_relative() && fs::exists(beside / "manifest.txt", failure))
    return fs::absolute(beside).lexically_normal().string();
  if (name.find('/') != std::string::npos && fs::is_directory(name, failure)) return fs::absolute(name).string();
  return name;
}

Status check_speeds(const CellSpec& spec, const Place& place) {
  if (spec.speed_m_s_size() == 0 || spec.speed_m_s_size() > 50)
    return place.error("speed_m_s",
                       "speed_m_s has " + std::to_string(spec.speed_m_s_size()) + " values, expected 1 to 50 of them");
  std::set<double> speeds;
  for (const double speed_m_s : spec.speed_m_s()) {
    if (auto status = check(place, "speed_m_s", "speed_m_s", speed_m_s, 0.5, 50, " m/s"); !status) return status;
    if (!speeds.insert(speed_m_s).second)
      return place.error("speed_m_s", "speed_m_s has " + brief(speed_m_s) + " twice, expected each speed once");
  }
  return {};
}

Status check_numbers(const CellSpec& spec, const Place& place) {
  if (auto status = check_speeds(spec, place); !status) return status;
  if (!spec.has_seeds()) return place.error("name", "seeds is missing, expected seeds { first: 1001 last: 1100 }");
  if (spec.seeds().last() < spec.seeds().first() || spec.seeds().last() - spec.seeds().first() >= kMaxSeeds)
    return place.error("seeds", "seeds is " + std::to_string(spec.seeds().first()) + " to " +
                                    std::to_string(spec.seeds().last()) + ", expected first <= last and at most " +
                                    std::to_string(kMaxSeeds) + " of them");
  if (spec.has_laps())
    if (auto status = check(place, "laps", "laps", spec.laps(), 1, kMaxLaps, ""); !status) return status;
  const LinkSpec& link = spec.link();
  if (auto status = check(place, "link", "link.each_way_ms", link.each_way_ms(), 0, 500, " ms"); !status) return status;
  if (auto status = check(place, "link", "link.jitter_ms", link.jitter_ms(), 0, 1000, " ms"); !status) return status;
  if (auto status = check(place, "link", "link.loss", link.loss(), 0, 0.9, ""); !status) return status;
  if (auto status = check(place, "link", "link.outage_s", link.outage_s(), 0, 60, " s"); !status) return status;
  for (const PublishedSpec& published : spec.published())
    if (auto status = check(place, "published", "published.success_percent", published.success_percent(), 0, 100, " %");
        !status)
      return status;
  if (spec.has_goal()) {
    if (auto status = check(place, "goal", "goal.success_percent", spec.goal().success_percent(), 0, 100, " %");
        !status)
      return status;
    if (std::find(spec.speed_m_s().begin(), spec.speed_m_s().end(), spec.goal().speed_m_s()) == spec.speed_m_s().end())
      return place.error(
          "goal", "goal.speed_m_s is " + brief(spec.goal().speed_m_s()) + ", expected one of the cell's speed_m_s");
  }
  for (const auto& [field, name] : {std::pair("figure", spec.figure()), std::pair("profile", spec.profile())})
    if (!name.empty() && !good_name(name))
      return place.error(field, std::string(field) + " is '" + name +
                                    "', expected 1 to 60 letters, digits, '_', '-' or '.', not '-' or '.' first");
  return {};
}

Result<Cell> to_cell(const fs::path& file, const CellSpec& spec, const Place& place) {
  if (!good_name(spec.name()))
    return place.error("name", "name is '" + spec.name() +
                                   "', expected 1 to 60 letters, digits, '_', '-' or '.', not '-' or '.' first");
  if (auto status = check_numbers(spec, place); !status) return status.failure();
  const auto scenario_file = scenario_of(file, spec, place);
  if (!scenario_file) return scenario_file.failure();
  auto scenario = config::make_scenario(*scenario_file, file);
  if (!scenario) return place.scenario_error(*scenario_file, scenario.failure());

  Cell cell;
  cell.name = spec.name();
  cell.title = spec.has_title() ? spec.title() : spec.name();
  cell.scenario = std::move(scenario).value();
  if (spec.has_laps()) cell.scenario.track.course.laps = *(cell.laps = spec.laps());
  cell.speeds_m_s.assign(spec.speed_m_s().begin(), spec.speed_m_s().end());
  cell.profile = spec.profile();
  cell.model = model_of(file, spec.model());
  cell.perception = static_cast<Perception>(spec.perception());
  cell.beside = spec.beside();
  cell.rollouts = spec.rollouts();
  cell.link = {spec.link().each_way_ms(), spec.link().jitter_ms(), spec.link().loss(), spec.link().outage_s()};
  cell.seeds = {spec.seeds().first(), spec.seeds().last()};
  cell.figure = spec.has_figure() ? spec.figure() : "success";
  cell.series = spec.has_series() ? spec.series() : cell.title;
  for (const PublishedSpec& published : spec.published())
    cell.published.push_back(
        {published.who(), published.speed_m_s(),
         published.has_success_percent() ? std::optional(published.success_percent()) : std::nullopt});
  if (spec.has_goal()) cell.goal = Goal{spec.goal().speed_m_s(), spec.goal().success_percent()};
  cell.scenario_text = text_of(*scenario_file, cell.name);
  if (scenario_file->has_sensor_noise_file()) cell.noise_file = scenario_file->sensor_noise_file();
  return cell;
}

/// Every figure that a cell names, with what the file says of it.
std::vector<Figure> figures_of(const CampaignFile& spec, const std::vector<Cell>& cells) {
  std::vector<Figure> figures;
  for (const Cell& cell : cells) {
    if (std::any_of(figures.begin(), figures.end(), [&](const Figure& f) { return f.name == cell.figure; })) continue;
    Figure figure{cell.figure, "", Against::kSpeed};
    for (const FigureSpec& said : spec.figure())
      if (said.name() == figure.name) figure = {said.name(), said.title(), static_cast<Against>(said.against())};
    figures.push_back(figure);
  }
  return figures;
}

}  // namespace

Result<Campaign> make_campaign(const fs::path& file, const CampaignFile& spec, const Lines& lines) {
  if (spec.cell_size() == 0 || spec.cell_size() > kMaxCells)
    return config::in_file(file, Error{"there are " + std::to_string(spec.cell_size()) + " cells, expected 1 to " +
                                           std::to_string(kMaxCells),
                                       ErrorCode::kInvalid, "cell"});
  if (spec.defaults().has_name())
    return config::in_file(
        file, Error{"defaults.name is set, expected none: names are of cells", ErrorCode::kInvalid, "defaults.name"});

  Campaign campaign;
  campaign.title = spec.has_title() ? spec.title() : file.stem().string();
  std::vector<CellSpec> merged;
  for (int i = 0; i < spec.cell_size(); ++i) {
    const Place place(file, spec, lines, i);
    CellSpec base = spec.defaults();
    if (spec.cell(i).has_beside()) {
      const auto at = std::find_if(merged.begin(), merged.end(),
                                   [&](const CellSpec& other) { return other.name() == spec.cell(i).beside(); });
      if (at == merged.end())
        return place.error("beside",
                           "beside is '" + spec.cell(i).beside() + "', expected the name of a cell above this one");
      base = without_results(*at);
    }
    merged.push_back(with_defaults(base, spec.cell(i)));
    auto cell = to_cell(file, merged.back(), place);
    if (!cell) return cell.failure();
    if (const Cell* other = campaign.find(cell->beside); other != nullptr && !spec.cell(i).has_title()) {
      cell.value().title = other->title + ", " + words(cell->perception);
      if (!spec.cell(i).has_series()) cell.value().series = other->series + ", " + words(cell->perception);
    }
    if (campaign.find(cell->name) != nullptr)
      return place.error("name", "the name is taken by a cell before, expected each name once");
    for (const std::string& note : cell->scenario.vehicle.notes)
      if (std::find(campaign.notes.begin(), campaign.notes.end(), note) == campaign.notes.end())
        campaign.notes.push_back(note);
    campaign.cells.push_back(std::move(cell).value());
  }
  campaign.figures = figures_of(spec, campaign.cells);
  const auto* figure_field = CampaignFile::descriptor()->FindFieldByName("figure");
  for (int i = 0; i < spec.figure_size(); ++i) {
    const std::string& name = spec.figure(i).name();
    const bool used = std::any_of(campaign.figures.begin(), campaign.figures.end(),
                                  [&](const Figure& figure) { return figure.name == name; });
    if (!used)
      return Error{"figure '" + name + "' is named by no cell, expected a cell with figure: \"" + name + "\"",
                   ErrorCode::kInvalid, "figure"}
          .at(file.string(), lines.GetLocation(figure_field, i).line + 1);
  }
  return campaign;
}

Result<Campaign> load_campaign(const fs::path& file, std::optional<config::HullKind> hull) {
  CampaignFile spec;
  Lines lines;
  if (auto status = config::load_text(file, &spec, &lines); !status) return status.failure();
  if (hull)
    for (CellSpec& cell : *spec.mutable_cell()) cell.set_hull(static_cast<config::HullKindSpec>(*hull));
  return make_campaign(file, spec, lines);
}

Result<Campaign> single_cell_campaign(const SingleCell& asked) {
  CampaignFile wanted;
  CellSpec* cell = wanted.add_cell();
  std::string name = fs::path(asked.scenario).stem().string();
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !good_name(std::string("a") + c); }, '_');
  cell->set_name(name.substr(0, 60));
  cell->set_scenario(asked.scenario);
  for (const double speed_m_s : asked.speeds_m_s) cell->add_speed_m_s(speed_m_s);
  if (asked.actuation)
    cell->mutable_actuation()->set_kind(*asked.actuation == Actuation::Kind::kBodyRates
                                            ? config::ActuationSpec::BODY_RATES
                                            : config::ActuationSpec::ROTOR_THRUSTS);
  if (asked.hull) cell->set_hull(static_cast<config::HullKindSpec>(*asked.hull));
  for (const config::WorldPart part : asked.world) cell->add_world(static_cast<config::WorldPartKind>(part));
  cell->set_profile(asked.profile);
  cell->set_model(asked.model);
  cell->mutable_seeds()->set_first(asked.seeds.first);
  cell->mutable_seeds()->set_last(asked.seeds.last);
  if (asked.laps) cell->set_laps(*asked.laps);
  cell->mutable_link()->set_each_way_ms(asked.link.each_way_ms);
  cell->mutable_link()->set_jitter_ms(asked.link.jitter_ms);
  cell->mutable_link()->set_loss(asked.link.loss);
  cell->mutable_link()->set_outage_s(asked.link.outage_s);
  wanted.set_title(name + ", " + asked.profile);
  // Through the text, so that it is read and checked like any other.
  std::string text;
  google::protobuf::TextFormat::PrintToString(wanted, &text);
  CampaignFile spec;
  Lines lines;
  if (auto status = config::parse_text(text, "command line", &spec, &lines); !status) return status.failure();
  return make_campaign("command line", spec, lines);
}

}  // namespace gatefield::race
