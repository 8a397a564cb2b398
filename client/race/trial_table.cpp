#include "client/race/trial_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <limits>
#include <sstream>

#include "common/base/text.h"
#include "common/plot/table.h"

namespace gatefield::race {
namespace {

/// Cells of one line, as plot::csv_cell() writes them.
std::vector<std::string> split_csv(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back() += c;
      ++i;
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

bool read(const std::string& text, double* value) {
  if (text.empty()) {
    *value = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  char* end = nullptr;
  *value = std::strtod(text.c_str(), &end);
  return *end == '\0';
}

template <typename Integer>
bool read_integer(const std::string& text, Integer* value, int base = 10) {
  const auto [stopped, code] = std::from_chars(text.data(), text.data() + text.size(), *value, base);
  return code == std::errc() && stopped == text.data() + text.size();
}

/// One of `all`, or kNone, by its name.
template <typename Kind, std::size_t kCount>
bool read_kind(const std::string& text, const Kind (&all)[kCount], Kind* kind) {
  *kind = Kind::kNone;
  if (text == name(Kind::kNone)) return true;
  const auto* const found = std::find_if(std::begin(all), std::end(all), [&](Kind one) { return text == name(one); });
  if (found == std::end(all)) return false;
  *kind = *found;
  return true;
}

/// A column: its name, how it is written and how it is read.
struct Column {
  const char* name;
  std::function<std::string(const TrialResult&)> write;
  std::function<bool(const std::string&, TrialResult*)> read;
};

Column text(const char* name, std::string TrialResult::*member) {
  return {name, [member](const TrialResult& r) { return r.*member; },
          [member](const std::string& s, TrialResult* r) {
            r->*member = s;
            return true;
          }};
}
/// What is not finite is an empty cell.
std::string decimal_text(double value, int digits) { return std::isfinite(value) ? fixed(value, digits) : ""; }
Column decimal(const char* name, double TrialResult::*member, int digits) {
  return {name, [member, digits](const TrialResult& r) { return decimal_text(r.*member, digits); },
          [member](const std::string& s, TrialResult* r) { return gatefield::race::read(s, &(r->*member)); }};
}
Column coordinate(const char* name, int axis) {
  return {name, [axis](const TrialResult& r) { return decimal_text(r.end_p_W[axis], 4); },
          [axis](const std::string& s, TrialResult* r) { return gatefield::race::read(s, &r->end_p_W[axis]); }};
}
/// Numbers with spaces between them.
Column decimals(const char* name, std::vector<double> TrialResult::*member, int digits) {
  return {name,
          [member, digits](const TrialResult& r) {
            std::string all;
            for (const double value : r.*member) {
              if (!all.empty()) all += ' ';
              all += fixed(value, digits);
            }
            return all;
          },
          [member](const std::string& s, TrialResult* r) {
            (r->*member).clear();
            std::istringstream words(s);
            for (std::string word; words >> word;)
              if (!gatefield::race::read(word, &(r->*member).emplace_back())) return false;
            return true;
          }};
}
template <typename Integer>
Column whole(const char* name, Integer TrialResult::*member) {
  return {name, [member](const TrialResult& r) { return std::to_string(r.*member); },
          [member](const std::string& s, TrialResult* r) { return read_integer(s, &(r->*member)); }};
}
Column bits(const char* name, std::uint64_t TrialResult::*member) {
  return {name, [member](const TrialResult& r) { return hex(r.*member); },
          [member](const std::string& s, TrialResult* r) { return read_integer(s, &(r->*member), 16); }};
}

/// What a person looks for first stands first; what was measured by the wall clock, and differs from run to run, is
/// round_trip_*, solve_*, attempts, wall_s and host.
const std::vector<Column>& columns() {
  using R = TrialResult;
  static const std::vector<Column> all = {
      text("cell", &R::cell),
      {"speed_m_s", [](const R& r) { return std::isfinite(r.speed_m_s) ? brief(r.speed_m_s) : ""; },
       [](const std::string& s, R* r) { return gatefield::race::read(s, &r->speed_m_s); }},
      whole("seed", &R::seed),
      whole("planner_seed", &R::planner_seed),
      {"success", [](const R& r) { return std::string(r.won() ? "1" : "0"); },
       [](const std::string& s, R*) { return s == "0" || s == "1"; }},
      {"failure", [](const R& r) { return std::string(name(r.failure)); },
       [](const std::string& s, R* r) { return read_kind(s, kFailures, &r->failure); }},
      {"cause", [](const R& r) { return std::string(name(r.cause)); },
       [](const std::string& s, R* r) { return read_kind(s, kCauses, &r->cause); }},
      decimal("belief_error_m", &R::belief_error_m, 3),
      decimal("belief_turn_deg", &R::belief_turn_deg, 1),
      decimal("seen_before_s", &R::seen_before_s, 2),
      text("outcome", &R::outcome),
      whole("gates", &R::gates_passed),
      whole("gates_total", &R::gates_total),
      decimal("time_s", &R::time_s, 3),
      decimal("top_speed_m_s", &R::top_speed_m_s, 4),
      decimal("mean_speed_m_s", &R::mean_speed_m_s, 4),
      decimal("median_lap_s", &R::median_lap_s, 3),
      decimal("slowest_lap_s", &R::slowest_lap_s, 3),
      whole("missed", &R::missed),
      whole("retries", &R::retries),
      text("hull", &R::hull),
      decimal("clearance_m", &R::clearance_m, 4),
      decimals("clearances_m", &R::clearances_m, 4),
      whole("end_gate", &R::gate),
      whole("end_lap", &R::lap),
      coordinate("end_x_m", 0),
      coordinate("end_y_m", 1),
      coordinate("end_z_m", 2),
      whole("end_frame", &R::frame),
      decimal("round_trip_p50_ms", &R::round_trip_p50_ms, 3),
      decimal("round_trip_p99_ms", &R::round_trip_p99_ms, 3),
      decimal("solve_p50_ms", &R::solve_p50_ms, 3),
      bits("flight", &R::flight),
      bits("setup", &R::setup),
      bits("model", &R::model),
      text("profile", &R::profile),
      text("isa", &R::isa),
      text("host", &R::host),
      whole("attempts", &R::attempts),
      decimal("wall_s", &R::wall_s, 2),
      text("sentence", &R::sentence),
      text("reproduce", &R::reproduce),
  };
  return all;
}

/// No line of the table may break in two.
std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

}  // namespace

std::string csv_header() {
  std::string line;
  for (const Column& column : columns()) {
    if (!line.empty()) line += ',';
    line += column.name;
  }
  return line;
}

std::string csv_line(const TrialResult& result) {
  std::string line;
  for (const Column& column : columns()) {
    if (&column != &columns().front()) line += ',';
    line += plot::csv_cell(one_line(column.write(result)));
  }
  return line;
}

Result<TrialResult> parse_csv_line(const std::string& line) {
  const std::vector<std::string> cells = split_csv(line);
  if (cells.size() != columns().size())
    return Error{"there are " + std::to_string(cells.size()) + " columns, expected " + std::to_string(columns().size()),
                 ErrorCode::kInvalid};
  TrialResult result;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (!columns()[i].read(cells[i], &result))
      return Error{std::string(columns()[i].name) + " is '" + cells[i] + "', which can't be read", ErrorCode::kInvalid,
                   columns()[i].name};
  return result;
}

}  // namespace gatefield::race
