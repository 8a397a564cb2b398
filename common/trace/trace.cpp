#include "common/trace/trace.h"

#include <cmath>
#include <cstdlib>

#include "common/base/text.h"
#include "common/base/whole_file.h"

namespace gatefield::trace {
namespace {

constexpr std::size_t kMaxRollout = 1000;
constexpr double kMaxStamp_s = 5e9;  // what fits into the nanoseconds of a Stamp
constexpr double kMaxWaypoint = 1e6;

void add(std::string* out, double value, int digits) {
  *out += ' ';
  *out += fixed(value, digits);
}

/// The numbers of a line after its first word; false when something else stands there.
bool numbers_of(const std::string& line, std::vector<double>* numbers) {
  numbers->clear();
  const char* at = line.c_str() + line.find(' ');
  while (*at != '\0') {
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    if (end == at) return false;
    numbers->push_back(value);
    at = end;
  }
  return true;
}

Eigen::Vector3d vector_at(const std::vector<double>& numbers, std::size_t i) {
  return {numbers[i], numbers[i + 1], numbers[i + 2]};
}

}  // namespace

std::string to_text(const Step& step) {
  std::string out = "step";
  add(&out, seconds(step.stamp), 9);
  out += ' ' + std::to_string(step.waypoint) + (step.hold ? " 1" : " 0") + (step.seen ? " 1" : " 0");
  for (const Eigen::Vector3d& v : {step.p_W, step.center_W, step.axis_W})
    for (int i = 0; i < 3; ++i) add(&out, v[i], 5);
  for (const double v : {step.center_sigma_m, step.axis_sigma_rad, step.field_age_s, step.lowest_field_m})
    add(&out, v, 4);
  out += '\n';
  for (const Rollout& rollout : step.rollouts) {
    out += "rollout";
    for (std::size_t k = 0; k < rollout.p_W.size(); ++k) {
      for (int i = 0; i < 3; ++i) add(&out, rollout.p_W[k][i], 3);
      add(&out, rollout.field_m[k], 3);
    }
    out += '\n';
  }
  return out;
}

Result<std::vector<Step>> read(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text)
    return Error{"can't be read, expected a trace that a server wrote (--trace)", ErrorCode::kUnreadable}.at(
        file.string());

  std::vector<Step> steps;
  std::vector<double> numbers;
  int number = 0;
  for (std::size_t begin = 0;;) {
    const std::size_t end = text->find('\n', begin);
    if (end == std::string::npos) return steps;
    const std::string line = text->substr(begin, end - begin);
    begin = end + 1;
    ++number;
    const auto wrong = [&] { return Error{"is no line of a trace", ErrorCode::kUnreadable}.at(file.string(), number); };
    if (line.find(' ') == std::string::npos || !numbers_of(line, &numbers)) return wrong();
    if (line.starts_with("step ") && numbers.size() == 17 && numbers[0] >= 0 && numbers[0] <= kMaxStamp_s &&
        numbers[1] >= 0 && numbers[1] <= kMaxWaypoint) {
      Step step;
      step.stamp = from_seconds(numbers[0]);
      step.waypoint = static_cast<std::uint32_t>(numbers[1]);
      step.hold = numbers[2] != 0.0;
      step.seen = numbers[3] != 0.0;
      step.p_W = vector_at(numbers, 4);
      step.center_W = vector_at(numbers, 7);
      step.axis_W = vector_at(numbers, 10);
      step.center_sigma_m = numbers[13];
      step.axis_sigma_rad = numbers[14];
      step.field_age_s = numbers[15];
      step.lowest_field_m = numbers[16];
      steps.push_back(std::move(step));
    } else if (line.starts_with("rollout ") && !steps.empty() && numbers.size() % 4 == 0 &&
               numbers.size() <= 4 * kMaxRollout) {
      Rollout rollout;
      for (std::size_t k = 0; k < numbers.size(); k += 4) {
        rollout.p_W.push_back(vector_at(numbers, k));
        rollout.field_m.push_back(numbers[k + 3]);
      }
      steps.back().rollouts.push_back(std::move(rollout));
    } else {
      return wrong();
    }
  }
}

}  // namespace gatefield::trace
