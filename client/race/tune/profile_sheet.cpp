#include "client/race/tune/profile_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>

#include "common/base/child_process.h"

namespace gatefield::race {
namespace {

using namespace std::chrono_literals;

std::optional<double> number_in(std::string_view text) {
  double value = 0.0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Error wrong_line(std::string_view line) {
  return Error{"'" + std::string(line.substr(0, 80)) +
                   "' is no line of a profile, expected 'name: value' or 'name: value  # min to max'",
               ErrorCode::kUnreadable};
}

}  // namespace

Result<ProfileSheet> ProfileSheet::parse(const std::string& text) {
  ProfileSheet sheet;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    if (line.empty()) continue;
    const std::size_t colon = line.find(": "), comment = line.find("  # ");
    if (colon == std::string_view::npos || colon == 0 || (comment != std::string_view::npos && comment < colon))
      return wrong_line(line);
    Field field;
    field.name = line.substr(0, colon);
    field.value = line.substr(colon + 2, comment == std::string_view::npos ? comment : comment - colon - 2);
    if (field.name == "name") {
      if (field.value.size() < 3 || field.value.front() != '"' || field.value.back() != '"') return wrong_line(line);
      sheet.name_ = field.value.substr(1, field.value.size() - 2);
      continue;
    }
    if (comment != std::string_view::npos) {
      const std::string_view range = line.substr(comment + 4);
      const std::size_t to = range.find(" to ");
      const auto min = number_in(range.substr(0, to));
      const auto max = to == std::string_view::npos ? std::nullopt : number_in(range.substr(to + 4));
      if (!min || !max) return wrong_line(line);
      field.min = *min;
      field.max = *max;
      field.has_range = true;
    }
    sheet.fields_.push_back(std::move(field));
  }
  if (sheet.name_.empty())
    return Error{"the profile has no name, expected a line 'name: \"...\"'", ErrorCode::kUnreadable};
  return sheet;
}

const ProfileSheet::Field* ProfileSheet::find(std::string_view name) const noexcept {
  const auto at = std::find_if(fields_.begin(), fields_.end(), [&](const Field& field) { return field.name == name; });
  return at == fields_.end() ? nullptr : &*at;
}

std::optional<double> ProfileSheet::number(std::string_view name) const noexcept {
  const Field* field = find(name);
  return field == nullptr ? std::nullopt : number_in(field->value);
}

void ProfileSheet::set(std::string_view name, const std::string& value) {
  for (Field& field : fields_)
    if (field.name == name) field.value = value;
}

std::string ProfileSheet::text(const ProfileSheet* before) const {
  std::string out = fmt::format("name: \"{}\"\n", name_);
  for (const Field& field : fields_) {
    const Field* was = before == nullptr ? nullptr : before->find(field.name);
    const bool changed = was != nullptr && was->value != field.value;
    out += fmt::format("{}: {}", field.name, field.value);
    if (field.has_range) out += fmt::format("  # {} to {}", field.min, field.max);
    if (changed) out += (field.has_range ? ", was " : "  # was ") + was->value;
    out += "\n";
  }
  return out;
}

Result<ProfileSheet> read_profile(const std::string& server_program, const std::filesystem::path& folder,
                                  const std::string& name) {
  ChildOptions options;
  options.arguments = {server_program, "--profiles", folder.string(), "--show-profile", name};
  auto child = ChildProcess::start(options);
  if (!child) return child.failure();
  const auto end = child.value()->wait(30s);
  if (!end)
    return Error{server_program + " --show-profile did not end within 30 s, expected a profile",
                 ErrorCode::kNotAnswering};
  if (!end->well())
    return Error{"the profile '" + name + "' is not to be had: " + child.value()->last_line(), ErrorCode::kUnknownName,
                 "profile"};
  auto sheet = ProfileSheet::parse(child.value()->said());
  return sheet ? std::move(sheet) : sheet.failure().within(server_program + " --show-profile " + name + ": ");
}

}  // namespace gatefield::race
