#include <google/protobuf/text_format.h>

#include "client/race/campaign.h"
#include "client/race/campaign.pb.h"
#include "client/race/files.h"

namespace gatefield::race {

namespace fs = std::filesystem;

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
      const auto text = read_file(from);
      if (!text) return text.failure();
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
    if (cell.link.outage_s > 0) out->mutable_link()->set_outage_s(cell.link.outage_s);
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

}  // namespace gatefield::race
