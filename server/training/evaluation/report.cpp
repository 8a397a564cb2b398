#include "server/training/evaluation/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/whole_file.h"
#include "server/training/evaluation/charts.h"
#include "server/training/evaluation/tables.h"

namespace gatefield::training {
namespace {

std::string heading(const Evaluation& evaluation) {
  const EvaluateOptions& options = evaluation.options;
  std::string out = "Bundle " + evaluation.bundles[0].name + ".";
  for (const Evaluation::Set& set : evaluation.sets) {
    const auto gates = std::count_if(set.frames.truth.begin(), set.frames.truth.end(),
                                     [](const FrameTruth& truth) { return truth.has_gate; });
    out += " Set " + set.name + " (" + name(set.kind) + "): " + std::to_string(set.frames.truth.size()) + " images, " +
           std::to_string(gates) + " with a gate.";
  }
  return out + fmt::format(" Simulated sensor's noise times {:g}, prior's noise {:g} m per axis, seed {}.",
                           options.noise_scale, options.prior_sigma_m, options.seed);
}

}  // namespace

std::string to_text(const Evaluation& evaluation) {
  std::string out = heading(evaluation) + "\n";
  for (const plot::Table& table : tables_of(evaluation)) out.append("\n").append(plot::to_text(table));
  return out;
}

std::string to_markdown(const Evaluation& evaluation) {
  std::string out = heading(evaluation) + "\n";
  for (const plot::Table& table : tables_of(evaluation)) out.append("\n").append(plot::to_markdown(table));
  return out;
}

std::string to_csv(const Evaluation& evaluation) {
  std::string out = "table,row,column,value\n";
  for (const plot::Table& table : tables_of(evaluation)) {
    for (const auto& row : table.rows) {
      // What names a row: its words from the left on, at most two; or its first number.
      std::size_t first = 0;
      std::string name;
      for (; first < std::min<std::size_t>(2, row.size()); ++first) {
        const bool words = !std::isfinite(row[first].value) && row[first].text != "-";
        if (!words && first > 0) break;
        name += first > 0 ? ", " + row[first].text : words ? row[first].text : table.columns[0] + " " + row[first].text;
        if (!words) {
          first = 1;
          break;
        }
      }
      for (std::size_t i = first; i < row.size(); ++i) {
        // "(const.)" and "p90" belong to the column before them.
        std::string column = table.columns[i];
        for (std::size_t k = i;
             k > 0 && (column == table.columns[i]) && (table.columns[i] == "(const.)" || table.columns[i] == "p90");
             --k) {
          if (table.columns[k - 1] != "(const.)" && table.columns[k - 1] != "p90")
            column = table.columns[k - 1] + " " + table.columns[i];
        }
        out += plot::csv_cell(table.title) + "," + plot::csv_cell(name) + "," + plot::csv_cell(column) + "," +
               (std::isfinite(row[i].value) ? fmt::format("{:.6g}", row[i].value)
                : row[i].text == "-"        ? ""
                                            : plot::csv_cell(row[i].text)) +
               "\n";
      }
    }
  }
  return out;
}

std::string speed_text(const Evaluation& evaluation) {
  std::string out;
  for (const Evaluation::Bundle& bundle : evaluation.bundles) {
    out += fmt::format(
        "encoder of {}: {:.2f} ms median, {:.2f} ms p99 with a prior; {:.2f} ms median without (one thread)\n",
        bundle.name, bundle.encode_median_ms, bundle.encode_p99_ms, bundle.first_encode_median_ms);
  }
  return out;
}

Result<std::vector<std::string>> write_report(const Evaluation& evaluation, const std::filesystem::path& folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (code) return Error{"folder " + folder.string() + " can't be made: " + code.message()};
  if (Status written = write_file(folder / "evaluation.txt", to_text(evaluation)); !written) return written.failure();
  if (Status written = write_file(folder / "evaluation.md", to_markdown(evaluation)); !written)
    return written.failure();
  if (Status written = write_file(folder / "evaluation.csv", to_csv(evaluation)); !written) return written.failure();
  std::vector<std::string> sentences;
  int missing = 0;
  for (const auto& [name, chart] : charts_of(evaluation)) {
    const auto drawn = plot::draw(chart, folder, name);
    if (!drawn) return drawn.failure();
    if (!drawn->png && ++missing == 1) sentences.push_back(drawn->why_not);
  }
  if (missing > 1) sentences.push_back(std::to_string(missing - 1) + " more pictures are missing for the same reason");
  return sentences;
}

}  // namespace gatefield::training
