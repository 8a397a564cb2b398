#include "client/simulator/outputs.h"

#include <unistd.h>

#include <filesystem>
#include <numbers>
#include <string>
#include <system_error>

#include "client/simulator/depth_picture.h"
#include "client/simulator/flight_picture.h"
#include "common/base/text.h"

namespace gatefield::simulator {
namespace {

std::string subtitle(const Arguments& a, const config::Scenario& scenario, const Report& report) {
  const double turned_deg = scenario.perturbation.yaw_rad * 180.0 / std::numbers::pi;
  return "seed " + text(scenario.seed) + ", profile " + a.profile + ", " + in_words(report.actuation, report.mismatch) +
         ", gates displaced " + fixed(scenario.perturbation.position_m, 2) + " m, turned " + fixed(turned_deg, 0) +
         " deg; top speed " + fixed(report.top_speed_m_s, 2) + " m/s, mean " + fixed(report.mean_speed_m_s, 2) +
         " m/s; " + (report.timing == protocol::Timing::kLockstep ? "lockstep" : "real time");
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
      return Error{"its folder can't be made or written to, expected a place that this user may write to",
                   ErrorCode::kUnreadable}
          .at(name);
    if (std::filesystem::is_directory(name, failure))
      return Error{"is a folder, expected a file name", ErrorCode::kUnreadable}.at(name);
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
    const std::string title = "Depth as the planner gets it, gate " + text(snapshot.waypoint + 1) + " ahead, " +
                              fixed(snapshot.t_s, 2) + " s into the race";
    if (auto status = write_depth_picture(a.depth_picture, snapshot, title); !status) return status;
  }
  return a.frame_folder.empty() ? Status() : save_frame(a.frame_folder, snapshot);
}

}  // namespace gatefield::simulator
