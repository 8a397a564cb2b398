#include "common/plot/table.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "common/base/text.h"

namespace gatefield::plot {
namespace {

constexpr std::size_t kNoteWidth = 150;

/// Characters as a person counts them: bytes that begin one in UTF-8.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::vector<bool> numeric_columns(const Table& table) {
  std::vector<bool> out(table.columns.size(), !table.rows.empty());
  for (const auto& row : table.rows)
    for (std::size_t i = 0; i < out.size() && i < row.size(); ++i)
      if (!std::isfinite(row[i].value) && row[i].text != "-") out[i] = false;
  return out;
}

/// Lines of at most kNoteWidth characters, broken at spaces.
std::string wrapped(const std::string& text) {
  std::string out, line;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!line.empty() && width(line) + 1 + width(word) > kNoteWidth) {
      out.append(line).append("\n");
      line.clear();
    }
    line.append(line.empty() ? "" : " ").append(word);
  }
  return out.append(line);
}

std::string padded(const std::string& text, std::size_t to, bool right) {
  const std::string fill(to - std::min(to, width(text)), ' ');
  return right ? fill + text : text + fill;
}

std::string escaped_markdown(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out;
}

}  // namespace

Cell::Cell(double number, int digits) : value(number) { text = std::isfinite(number) ? fixed(number, digits) : "-"; }

std::string csv_cell(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + '"';
}

std::string to_text(const Table& table) {
  std::vector<std::size_t> widths;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    std::size_t most = width(table.columns[i]);
    for (const auto& row : table.rows)
      if (i < row.size()) most = std::max(most, width(row[i].text));
    widths.push_back(most);
  }
  const std::vector<bool> right = numeric_columns(table);
  const auto line = [&](const auto& cell_text) {
    std::string out;
    for (std::size_t i = 0; i < table.columns.size(); ++i)
      out.append(i == 0 ? "" : "  ").append(padded(cell_text(i), widths[i], right[i]));
    out.erase(out.find_last_not_of(' ') + 1);
    return out + "\n";
  };
  std::string out = table.title.empty() ? "" : table.title + "\n";
  out += line([&](std::size_t i) { return table.columns[i]; });
  for (const auto& row : table.rows) out += line([&](std::size_t i) { return i < row.size() ? row[i].text : ""; });
  if (!table.note.empty()) out += wrapped(table.note) + "\n";
  return out;
}

std::string to_markdown(const Table& table) {
  const std::vector<bool> right = numeric_columns(table);
  std::string out;
  if (!table.title.empty()) out.append("**").append(escaped_markdown(table.title)).append("**\n\n");
  out += "|";
  for (const std::string& column : table.columns) out.append(" ").append(escaped_markdown(column)).append(" |");
  out += "\n|";
  for (std::size_t i = 0; i < table.columns.size(); ++i) out += right[i] ? " ---: |" : " --- |";
  out += "\n";
  for (const auto& row : table.rows) {
    out += "|";
    for (std::size_t i = 0; i < table.columns.size(); ++i)
      out.append(" ").append(i < row.size() ? escaped_markdown(row[i].text) : "").append(" |");
    out += "\n";
  }
  if (!table.note.empty()) out += "\n" + table.note + "\n";
  return out;
}

std::string to_csv(const Table& table) {
  std::string out;
  const auto line = [&](const auto& cell_text) {
    for (std::size_t i = 0; i < table.columns.size(); ++i) out.append(i == 0 ? "" : ",").append(csv_cell(cell_text(i)));
    out += "\n";
  };
  line([&](std::size_t i) { return table.columns[i]; });
  for (const auto& row : table.rows) {
    line([&](std::size_t i) -> std::string {
      if (i >= row.size()) return "";
      if (!std::isfinite(row[i].value)) return row[i].text == "-" ? "" : row[i].text;
      return text(row[i].value);
    });
  }
  return out;
}

}  // namespace gatefield::plot
