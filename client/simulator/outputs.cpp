#include "client/simulator/outputs.h"

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <numbers>

#include "client/simulator/depth_picture.h"
#include "client/simulator/flight_picture.h"

namespace gatefield::simulator {
namespace {

std::string subtitle(const Arguments& a, const config::Scenario& scenario, const Report& report) {
  char text[384];
  std::snprintf(
      text, sizeof text,
      "seed %llu, profile %s, %s, gates displaced %.2f m, turned %.0f deg; top speed %.2f m/s, mean %.2f m/s; %s",
      static_cast<unsigned long long>(scenario.seed), a.profile.c_str(),
      in_words(report.actuation, report.mismatch).c_str(), scenario.perturbation.position_m,
      scenario.perturbation.yaw_rad * 180.0 / std::numbers::pi, report.top_speed_m_s, report.mean_speed_m_s,
      report.timing == protocol::Timing::kLockstep ? "lockstep" : "real time");
  return text;
}

}  // namespace

Status check_outputs(const Arguments& a) {
  for (const std::string& name :
       {a.csv, a.picture, a.depth_picture, a.frame_folder.empty() ? "" : a.frame_folder + "/frame.txt"}) {
    if (name.empty()) continue;
    const std::filesystem::path folder = std::filesystem::absolute(name).parent_path();
    std::error_code failure;
    std::filesystem::create_directories(folder, failure);
    if (failure || access(folder.c_str(), W_OK) != 0)
      return Error{name + ": its folder can't be made or written to, expected a place that this user may write to"};
    if (std::filesystem::is_directory(name, failure)) return Error{name + ": is a folder, expected a file name"};
  }
  return {};
}

Status write_outputs(const Arguments& a, const config::Scenario& scenario, const Report& report) {
  if (!a.csv.empty())
    if (auto status = write_csv(a.csv, report); !status) return status;
  if (!a.picture.empty())
    if (auto status = write_flight_picture(a.picture, scenario, report, subtitle(a, scenario, report)); !status)
      return status;
  if (!report.snapshot) return {};
  const Snapshot& snapshot = *report.snapshot;
  if (!a.depth_picture.empty()) {
    char title[128];
    std::snprintf(title, sizeof title, "Depth as the planner gets it, gate %d ahead, %.2f s into the race",
                  snapshot.waypoint + 1, snapshot.t_s);
    if (auto status = write_depth_picture(a.depth_picture, snapshot, title); !status) return status;
  }
  return a.frame_folder.empty() ? Status() : save_frame(a.frame_folder, snapshot);
}

}  // namespace gatefield::simulator
