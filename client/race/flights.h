#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/race/campaign.h"
#include "client/race/trial_result.h"
#include "client/simulator/flight_picture.h"
#include "common/base/result.h"

/// The paths of flights: kept as files beside a campaign's results, and chosen for a picture. Thread-safe: yes.
namespace gatefield::race {

/// The path of a flight as a file for shown_flights(): t_s,x_m,y_m,z_m,speed_m_s, 25 points a second and the last one.
std::string path_text(const simulator::Report& report);

/// Flights of one cell at one speed.
struct ShownFlights {
  double speed_m_s = 0.0;
  std::vector<simulator::FlownPath> flights;  ///< empty: none was kept
  std::size_t won = 0;
};
/// The flights of a cell at its goal, else at the highest speed with flights to show.
/// @param folder  of the results; paths are looked for in <folder>/paths. What can't be read is left out.
ShownFlights shown_flights(const std::filesystem::path& folder, const Cell& cell,
                           const std::vector<TrialResult>& results);

/// Whether a cell's flights get a picture of their own: flights over another link, or with other eyes, look like those
/// of the cell that they are compared with.
bool has_flights_picture(const Campaign& campaign, const Cell& cell);

}  // namespace gatefield::race
