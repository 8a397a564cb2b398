#pragma once

#include <gtest/gtest.h>

#include <string>

#include "client/race/tune/profile_sheet.h"

namespace gatefield::race {

/// As `gatefield-server --show-profile` prints one, shortened.
inline const char* const kSheet =
    "name: \"lab\"\n"
    "samples: 2048  # 16 to 16384\n"
    "rotors_thrust_sigma_s: 1.5  # 0 to 1000\n"
    "rotors_yaw_sigma_rad_s3: 9  # 0 to 1000\n"
    "rates_correlation: 0.85  # 0 to 0.99\n"
    "rates_thrust_sigma: 0.3  # 0 to 10\n"
    "rates_thrust_change_sigma_s: 4.5  # 0 to 1000\n"
    "temperature: 1  # 1e-06 to 1000000\n"
    "target_effective_fraction: 0  # 0 to 1\n"
    "crossing_weight: 0  # 0 to 1000000\n"
    "crossing_margin_m: 0.08  # 0 to 2\n"
    "unseen_speed_factor: 0.6  # 0.05 to 1\n"
    "rates_by_changes: false\n"
    "progress_metric: DISTANCE\n";

inline ProfileSheet sheet_of(const std::string& text = kSheet) {
  auto sheet = ProfileSheet::parse(text);
  EXPECT_TRUE(sheet.ok()) << sheet.error();
  return sheet.ok() ? std::move(sheet).value() : ProfileSheet{};
}

}  // namespace gatefield::race
