#pragma once

#include <string>
#include <vector>

#include "client/race/tune/profile_sheet.h"
#include "common/base/result.h"

namespace gatefield::race {

/// One field that is looked for. In a point it counts from 0 (min) to 1 (max), by its logarithm or itself.
struct Dimension {
  std::string name;  ///< of the profile's field
  double min = 0.0, max = 1.0;
  bool logarithmic = true;
};

/// A place in the space: a number for each dimension. Within [0, 1] it is a profile; outside of it the nearest one is
/// meant.
using Point = std::vector<double>;

/// What is looked for, and how its values become points. Thread-safe: yes (const).
class Space {
 public:
  /// Errors: a sentence that begins with "field": none at all, a name that the base doesn't have or that is no number,
  /// or twice; a range that is empty, not the field's, not positive for a logarithm, or without the base's value.
  static Result<Space> make(std::vector<Dimension> dimensions, const ProfileSheet& base);

  std::size_t size() const noexcept { return dimensions_.size(); }
  const std::vector<Dimension>& dimensions() const noexcept { return dimensions_; }
  /// The point whose profile has the base's values.
  const Point& start() const noexcept { return start_; }
  /// Value of a dimension at a point, as a file has it: four digits, within the range.
  std::string value(const Point& point, std::size_t dimension) const;
  /// The base with the point's values.
  ProfileSheet profile(const Point& point) const;
  /// How far a point is outside: the sum of the squares.
  static double outside(const Point& point) noexcept;

 private:
  Space(std::vector<Dimension> dimensions, ProfileSheet base)
      : dimensions_(std::move(dimensions)), base_(std::move(base)) {}

  std::vector<Dimension> dimensions_;
  ProfileSheet base_;
  Point start_;
};

}  // namespace gatefield::race
