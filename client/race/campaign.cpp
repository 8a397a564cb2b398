#include "client/race/campaign.h"

#include <algorithm>
#include <charconv>
#include <numbers>

namespace gatefield::race {

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
                     " of them, for example 1001-1100",
                 ErrorCode::kInvalid, "seeds"};
  return seeds;
}

}  // namespace gatefield::race
