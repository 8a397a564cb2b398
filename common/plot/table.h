#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace gatefield::plot {

/// What stands in a table: words, or a number with as many digits as people want to see.
struct Cell {
  std::string text;
  double value = std::numeric_limits<double>::quiet_NaN();  ///< NaN: words only

  Cell(std::string words) : text(std::move(words)) {}  // NOLINT(google-explicit-constructor): reads like a cell
  Cell(const char* words) : text(words) {}             // NOLINT(google-explicit-constructor)
  /// @param digits after the point; a value that isn't finite shows as "-"
  Cell(double number, int digits);
};

/// A table for people; every row has as many cells as there are columns.
struct Table {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<Cell>> rows;
  std::string note;  ///< under the table; empty = none
};

/// Columns set off by spaces; those whose cells are all numbers (or "-") stand on the right.
std::string to_text(const Table& table);
std::string to_markdown(const Table& table);
std::string to_csv(const Table& table);

/// A cell as RFC 4180 wants it: in quotes when it has a comma, a quote or a line end.
std::string csv_cell(std::string_view text);

}  // namespace gatefield::plot
