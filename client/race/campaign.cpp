#include "client/race/campaign.h"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <set>

#include "client/race/campaign.pb.h"
#include "client/race/files.h"
#include "client/race/single_cell.h"
#include "common/config/locate.h"
#include "common/config/text_file.h"
#include "common/protocol/messages.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;
using Lines = google::protobuf::TextFormat::ParseInfoTree;

constexpr int kMaxCells = 1000;
constexpr std::uint64_t kMaxSeeds = 100'000;

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
      : file_(file), name_(spec.cell(cell).name()) {
    const auto* type = CampaignFile::descriptor();
    const auto* field = type->FindFieldByName("cell");
    line_ = lines.GetLocation(field, cell).line;
    cell_ = lines.GetTreeForNested(field, cell);
    const auto* defaults = type->FindFieldByName("defaults");
    if (spec.has_defaults()) defaults_ = lines.GetTreeForNested(defaults, -1);
  }

  Error error(const std::string& field, const std::string& sentence) const {
    const auto* descriptor = CellSpec::descriptor()->FindFieldByName(field);
    int line = -1;
    for (const Lines* tree : {cell_, defaults_})
      if (tree != nullptr && descriptor != nullptr && line < 0)
        line = tree->GetLocation(descriptor, descriptor->is_repeated() ? 0 : -1).line;
    if (line < 0) line = line_;
    return Error(file_.string() + ":" + std::to_string(line + 1) + ": cell '" + name_ + "': " + sentence);
  }

  /// A sentence that already begins with the campaign's name gets the line put in.
  Error error_of(const std::string& field, const std::string& sentence) const {
    const std::string prefix = file_.string() + ": ";
    return error(field, sentence.starts_with(prefix) ? sentence.substr(prefix.size()) : sentence);
  }

 private:
  fs::path file_;
  std::string name_;
  int line_ = 0;
  const Lines* cell_ = nullptr;
  const Lines* defaults_ = nullptr;
};

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

Status check(const Place& place, const std::string& field, const std::string& name, double value, double low,
             double high, const std::string& unit) {
  if (value >= low && value <= high) return {};
  return place.error(field, name + " is " + number(value) + ", expected " + number(low) + " to " + number(high) + unit);
}

/// What a cell sets replaces what the defaults say, field by field, whole.
CellSpec with_defaults(const CellSpec& defaults, const CellSpec& cell) {
  CellSpec merged = defaults;
  std::vector<const google::protobuf::FieldDescriptor*> set;
  cell.GetReflection()->ListFields(cell, &set);
  for (const auto* field : set) merged.GetReflection()->ClearField(&merged, field);
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
    if (!found) return place.error("scenario", "scenario: " + found.error());
    if (auto status = config::load_text(*found, &scenario); !status) return Error{status.error()};
    const fs::path base = found->parent_path();
    for (auto [kind, name] :
         {std::pair("courses", scenario.mutable_course()), std::pair("vehicles", scenario.mutable_vehicle())}) {
      const auto part = find(kind, *name, base);
      if (!part) return place.error("scenario", "scenario: " + part.error());
      *name = part->string();
    }
    if (scenario.has_sensor_noise_file())
      scenario.set_sensor_noise_file(fs::absolute(base / scenario.sensor_noise_file()).string());
  } else if (!spec.has_course() || !spec.has_vehicle()) {
    return place.error("scenario", "scenario is missing, expected a scenario, or a course and a vehicle");
  }
  if (spec.has_course()) {
    const auto found = find("courses", spec.course(), file.parent_path());
    if (!found) return place.error("course", "course: " + found.error());
    scenario.set_course(found->string());
  }
  if (spec.has_vehicle()) {
    const auto found = find("vehicles", spec.vehicle(), file.parent_path());
    if (!found) return place.error("vehicle", "vehicle: " + found.error());
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
  if (spec.has_camera_rate_hz()) scenario.set_camera_rate_hz(spec.camera_rate_hz());
  if (spec.has_time_limit_s()) scenario.set_time_limit_s(spec.time_limit_s());
  scenario.clear_seed();
  if (spec.has_title()) scenario.set_title(spec.title());
  return scenario;
}

/// Which field of the cell a sentence about its scenario speaks of.
std::string field_in(const std::string& sentence) {
  for (const char* field :
       {"perturbation", "stereo", "sensor_noise", "state_noise", "mismatch", "camera_rate_hz", "time_limit_s"})
    if (sentence.find(field) != std::string::npos) return field;
  if (sentence.starts_with("noise.") || sentence.find(": noise.") != std::string::npos) return "sensor_noise";
  return sentence.find("rate_hz") != std::string::npos ? "camera_rate_hz" : "scenario";
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
      return place.error("speed_m_s", "speed_m_s has " + number(speed_m_s) + " twice, expected each speed once");
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
          "goal", "goal.speed_m_s is " + number(spec.goal().speed_m_s()) + ", expected one of the cell's speed_m_s");
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
  if (auto status = check_numbers(spec, place); !status) return Error{status.error()};
  const auto scenario_file = scenario_of(file, spec, place);
  if (!scenario_file) return Error{scenario_file.error()};
  auto scenario = config::make_scenario(*scenario_file, file);
  if (!scenario) return place.error_of(field_in(scenario.error()), scenario.error());

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
  cell.link = {spec.link().each_way_ms(), spec.link().jitter_ms(), spec.link().loss()};
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

Result<Campaign> to_campaign(const fs::path& file, const CampaignFile& spec, const Lines& lines) {
  if (spec.cell_size() == 0 || spec.cell_size() > kMaxCells)
    return config::in_file(
        file, "there are " + std::to_string(spec.cell_size()) + " cells, expected 1 to " + std::to_string(kMaxCells));
  if (spec.defaults().has_name())
    return config::in_file(file, "defaults.name is set, expected none: names are of cells");

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
    if (!cell) return Error{cell.error()};
    if (const Cell* other = campaign.find(cell->beside); other != nullptr && !spec.cell(i).has_title()) {
      cell.value().title = other->title + ", " + words(cell->perception);
      if (!spec.cell(i).has_series()) cell.value().series = other->series + ", " + words(cell->perception);
    }
    if (campaign.find(cell->name) != nullptr)
      return place.error("name", "the name is taken by a cell before, expected each name once");
    campaign.cells.push_back(std::move(cell).value());
  }
  campaign.figures = figures_of(spec, campaign.cells);
  const auto* figure_field = CampaignFile::descriptor()->FindFieldByName("figure");
  for (int i = 0; i < spec.figure_size(); ++i) {
    const std::string& name = spec.figure(i).name();
    const bool used = std::any_of(campaign.figures.begin(), campaign.figures.end(),
                                  [&](const Figure& figure) { return figure.name == name; });
    if (!used)
      return Error{file.string() + ":" + std::to_string(lines.GetLocation(figure_field, i).line + 1) + ": figure '" +
                   name + "' is named by no cell, expected a cell with figure: \"" + name + "\""};
  }
  return campaign;
}

}  // namespace

const char* name(Perception perception) noexcept {
  switch (perception) {
    case Perception::kLearned:
      return "LEARNED";
    case Perception::kNone:
      return "NONE";
    case Perception::kClassical:
      return "CLASSICAL";
    case Perception::kTruePose:
      return "TRUE_POSE";
  }
  return "";
}

const char* words(Perception perception) noexcept {
  switch (perception) {
    case Perception::kLearned:
      return "learned field";
    case Perception::kNone:
      return "no vision";
    case Perception::kClassical:
      return "classical detector";
    case Perception::kTruePose:
      return "true pose";
  }
  return "";
}

const Cell* Campaign::find(const std::string& name) const noexcept {
  const auto at = std::find_if(cells.begin(), cells.end(), [&](const Cell& cell) { return cell.name == name; });
  return at == cells.end() ? nullptr : &*at;
}

Result<Campaign> load_campaign(const fs::path& file) {
  CampaignFile spec;
  Lines lines;
  if (auto status = config::load_text(file, &spec, &lines); !status) return Error{status.error()};
  return to_campaign(file, spec, lines);
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
  cell->set_profile(asked.profile);
  cell->set_model(asked.model);
  cell->mutable_seeds()->set_first(asked.seeds.first);
  cell->mutable_seeds()->set_last(asked.seeds.last);
  if (asked.laps) cell->set_laps(*asked.laps);
  cell->mutable_link()->set_each_way_ms(asked.link.each_way_ms);
  cell->mutable_link()->set_jitter_ms(asked.link.jitter_ms);
  cell->mutable_link()->set_loss(asked.link.loss);
  wanted.set_title(name + ", " + asked.profile);
  // Through the text, so that it is read and checked like any other.
  std::string text;
  google::protobuf::TextFormat::PrintToString(wanted, &text);
  CampaignFile spec;
  Lines lines;
  if (auto status = config::parse_text(text, "command line", &spec, &lines); !status) return Error{status.error()};
  return to_campaign("command line", spec, lines);
}

Status save_campaign(const Campaign& campaign, const fs::path& folder) {
  CampaignFile spec;
  spec.set_title(campaign.title);
  for (const Cell& cell : campaign.cells) {
    const fs::path base = folder / "cells";
    if (auto status = put_file(base / (cell.name + ".txt"), cell.scenario_text); !status) return status;
    for (const auto& [from, suffix] :
         {std::pair(cell.scenario.course_file, ".course.txt"), std::pair(cell.scenario.vehicle_file, ".vehicle.txt"),
          std::pair(cell.noise_file, ".noise.txt")}) {
      if (from.empty()) continue;
      const auto text = get_file(from);
      if (!text) return Error{text.error()};
      if (auto status = put_file(base / (cell.name + suffix), *text); !status) return status;
    }
    CellSpec* out = spec.add_cell();
    out->set_name(cell.name);
    out->set_title(cell.title);
    out->set_scenario("cells/" + cell.name + ".txt");
    if (cell.laps) out->set_laps(*cell.laps);
    for (const double speed_m_s : cell.speeds_m_s) out->add_speed_m_s(speed_m_s);
    out->set_profile(cell.profile);
    out->set_model(cell.model);
    out->set_perception(static_cast<PerceptionKind>(cell.perception));
    if (!cell.beside.empty()) out->set_beside(cell.beside);
    if (cell.rollouts) out->set_rollouts(true);
    out->mutable_link();  // as it is, whatever the cell beside has
    if (cell.link.each_way_ms > 0) out->mutable_link()->set_each_way_ms(cell.link.each_way_ms);
    if (cell.link.jitter_ms > 0) out->mutable_link()->set_jitter_ms(cell.link.jitter_ms);
    if (cell.link.loss > 0) out->mutable_link()->set_loss(cell.link.loss);
    out->mutable_seeds()->set_first(cell.seeds.first);
    out->mutable_seeds()->set_last(cell.seeds.last);
    out->set_figure(cell.figure);
    out->set_series(cell.series);
    for (const Published& published : cell.published) {
      auto* entry = out->add_published();
      entry->set_who(published.who);
      entry->set_speed_m_s(published.speed_m_s);
      if (published.success_percent) entry->set_success_percent(*published.success_percent);
    }
    if (cell.goal) {
      out->mutable_goal()->set_speed_m_s(cell.goal->speed_m_s);
      out->mutable_goal()->set_success_percent(cell.goal->success_percent);
    }
  }
  for (const Figure& figure : campaign.figures) {
    auto* out = spec.add_figure();
    out->set_name(figure.name);
    out->set_title(figure.title);
    out->set_against(static_cast<FigureSpec::Against>(figure.against));
  }
  std::string text;
  google::protobuf::TextFormat::PrintToString(spec, &text);
  return put_file(folder / "campaign.txt",
                  "# What was flown, with all its parts in cells/. Written by gatefield-race.\n" + text);
}

double abscissa(const Cell& cell, double speed_m_s, Against against) noexcept {
  constexpr double kDegree = std::numbers::pi / 180.0;
  switch (against) {
    case Against::kSpeed:
      return speed_m_s;
    case Against::kDelay:
      return cell.link.each_way_ms;
    case Against::kJitter:
      return cell.link.jitter_ms;
    case Against::kLoss:
      return 100.0 * cell.link.loss;
    case Against::kPosition:
      return cell.scenario.perturbation.position_m;
    case Against::kYaw:
      return cell.scenario.perturbation.yaw_rad / kDegree;
    case Against::kTilt:
      return cell.scenario.perturbation.tilt_rad / kDegree;
  }
  return speed_m_s;
}

Result<SeedRange> parse_seeds(const std::string& text) {
  SeedRange seeds;
  const std::size_t dash = text.find('-');
  const std::string first = text.substr(0, dash), last = dash == std::string::npos ? first : text.substr(dash + 1);
  const auto whole = [](const std::string& digits, std::uint64_t* value) {
    const char* end = digits.data() + digits.size();
    const auto [stopped, code] = std::from_chars(digits.data(), end, *value);
    return code == std::errc() && stopped == end && !digits.empty();
  };
  if (!whole(first, &seeds.first) || !whole(last, &seeds.last) || seeds.last < seeds.first ||
      seeds.last - seeds.first >= kMaxSeeds)
    return Error{"'" + text + "' is no range of seeds, expected FIRST-LAST with at most " + std::to_string(kMaxSeeds) +
                 " of them, for example 1001-1100"};
  return seeds;
}

}  // namespace gatefield::race
