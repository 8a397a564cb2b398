#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace gatefield::race {

/// A planner profile as `gatefield-server --show-profile` prints it: every field with its value and range, without
/// knowing what it means. Thread-safe: yes (const).
class ProfileSheet {
 public:
  struct Field {
    std::string name;   ///< as in the file
    std::string value;  ///< as in the file
    double min = 0.0, max = 0.0;
    bool has_range = false;
  };

  /// Errors: the line that is no "name: value  # min to max", or no name of the profile.
  static Result<ProfileSheet> parse(const std::string& text);

  const std::string& name() const noexcept { return name_; }
  void rename(const std::string& name) { name_ = name; }
  const std::vector<Field>& fields() const noexcept { return fields_; }
  const Field* find(std::string_view name) const noexcept;
  /// The field's value; nothing where there is no such field, or it is no number.
  std::optional<double> number(std::string_view name) const noexcept;
  /// @pre find(name) != nullptr
  void set(std::string_view name, const std::string& value);
  /// As a profile's file, complete.
  /// @param before  when given: what differs from it says what it was
  std::string text(const ProfileSheet* before = nullptr) const;

 private:
  std::string name_;
  std::vector<Field> fields_;
};

/// Asks a server's program for a profile. Errors: the program's own sentence (no such profile, a bad file), or that it
/// can't be started or gives no profile.
Result<ProfileSheet> read_profile(const std::string& server_program, const std::filesystem::path& folder,
                                  const std::string& name);

}  // namespace gatefield::race
