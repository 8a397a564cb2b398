#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/training/evaluation/evaluate.h"

namespace gatefield::training {

/// What was evaluated and how, and all tables: the same for the same options on every run.
std::string to_text(const Evaluation& evaluation);
std::string to_markdown(const Evaluation& evaluation);
/// Every figure of every table, one a line: table,row,column,value.
std::string to_csv(const Evaluation& evaluation);

/// How long the encoders took: differs from run to run, so it is in no file.
std::string speed_text(const Evaluation& evaluation);

/// Writes evaluation.txt, evaluation.md, evaluation.csv and the charts (csv, gp and png of each) into a folder, which
/// is made. Errors: what can't be written.
/// @return sentences to tell people: charts that could not be drawn, once
Result<std::vector<std::string>> write_report(const Evaluation& evaluation, const std::filesystem::path& folder);

}  // namespace gatefield::training
