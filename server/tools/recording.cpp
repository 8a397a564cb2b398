#include "server/tools/recording.h"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/text.h"
#include "common/base/whole_file.h"

namespace gatefield::tools {
namespace {

constexpr std::uintmax_t kMaxBytes = std::uintmax_t{1} << 30;

/// A column, and the most that its values may be away from 0.
struct Column {
  std::string_view name;
  double most;
};
constexpr std::array<Column, 15> kColumns{{{"t_s", 1e9},
                                           {"vx_m_s", 200},
                                           {"vy_m_s", 200},
                                           {"vz_m_s", 200},
                                           {"qw", 1.01},
                                           {"qx", 1.01},
                                           {"qy", 1.01},
                                           {"qz", 1.01},
                                           {"wx_rad_s", 200},
                                           {"wy_rad_s", 200},
                                           {"wz_rad_s", 200},
                                           {"collective_n", 4e4},
                                           {"wx_asked_rad_s", 200},
                                           {"wy_asked_rad_s", 200},
                                           {"wz_asked_rad_s", 200}}};
constexpr double kUnitTolerance = 1e-2;  // of the quaternion: a log has few digits

/// Takes the text up to `end` off the front, and `end` with it.
std::string_view take(std::string_view* text, char end) {
  const std::size_t at = std::min(text->find(end), text->size());
  const std::string_view taken = text->substr(0, at);
  text->remove_prefix(std::min(at + 1, text->size()));
  return taken;
}

std::string_view line_of(std::string_view* text) {
  std::string_view line = take(text, '\n');
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

/// Where each of kColumns stands in a line.
Result<std::array<std::size_t, kColumns.size()>> places(std::string_view header) {
  std::array<std::optional<std::size_t>, kColumns.size()> found;
  for (std::size_t place = 0; !header.empty(); ++place) {
    const std::string_view name = take(&header, ',');
    for (std::size_t i = 0; i < kColumns.size(); ++i)
      if (kColumns[i].name == name) found[i] = place;
  }
  std::array<std::size_t, kColumns.size()> out{};
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    const std::string name(kColumns[i].name);
    if (!found[i])
      return Error("the first line names no column '" + name +
                       "', expected a flight of a vehicle of body rates as gatefield-sim --csv writes it",
                   ErrorCode::kUnreadable, name);
    out[i] = *found[i];
  }
  return out;
}

Result<std::array<double, kColumns.size()>> values_of(std::string_view line,
                                                      const std::array<std::size_t, kColumns.size()>& at) {
  std::array<double, kColumns.size()> values{};
  values.fill(std::nan(""));
  for (std::size_t place = 0; !line.empty(); ++place) {
    const std::string_view word = take(&line, ',');
    for (std::size_t i = 0; i < kColumns.size(); ++i) {
      if (at[i] != place) continue;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), values[i]);
      if (error != std::errc{} || end != word.data() + word.size())
        return Error::invalid(std::string(kColumns[i].name), "'" + shown(word, 40) + "'", "a number",
                              ErrorCode::kUnreadable);
    }
  }
  for (std::size_t i = 0; i < kColumns.size(); ++i)
    if (!(std::abs(values[i]) <= kColumns[i].most))
      return Error::invalid(std::string(kColumns[i].name), text(values[i]),
                            "finite and at most " + brief(kColumns[i].most) + " away from 0");
  return values;
}

}  // namespace

Result<std::vector<RecordedState>> read_recording(const std::filesystem::path& file) {
  const auto content = read_file(file, kMaxBytes);
  if (!content) return content.failure();
  std::string_view rest = *content;
  const auto at = places(line_of(&rest));
  if (!at) return at.failure().at(file.string(), 1);
  std::vector<RecordedState> recording;
  for (int line = 2; !rest.empty(); ++line) {
    const std::string_view words = line_of(&rest);
    if (words.empty()) continue;
    const auto values = values_of(words, *at);
    if (!values) return values.failure().at(file.string(), line);
    const auto& v = *values;
    RecordedState now;
    now.stamp = from_seconds(v[0]);
    now.state.v_WB = {v[1], v[2], v[3]};
    now.state.q_WB = Eigen::Quaterniond(v[4], v[5], v[6], v[7]);
    now.state.w_WB_B = {v[8], v[9], v[10]};
    now.asked = {v[11], v[12], v[13], v[14]};
    if (const double norm = now.state.q_WB.norm(); !(std::abs(norm - 1.0) <= kUnitTolerance))
      return Error::invalid("q", "of norm " + brief(norm), "qw, qx, qy, qz of norm 1 within 0.01")
          .at(file.string(), line);
    now.state.q_WB.normalize();
    if (!recording.empty() && now.stamp < recording.back().stamp)
      return Error::invalid("t_s", text(v[0]),
                            "a time that rises from " + text(seconds(recording.back().stamp)) + " on")
          .at(file.string(), line);
    if (recording.empty() || now.stamp > recording.back().stamp) recording.push_back(now);
  }
  if (recording.size() < 2)
    return Error("there are fewer than two moments in it, expected some seconds of flight", ErrorCode::kInvalid)
        .at(file.string());
  return recording;
}

}  // namespace gatefield::tools
