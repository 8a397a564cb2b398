#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"

namespace gatefield::training {

/// Draws a run's log.csv (train_loop.h) as learning curves: <folder>/<name>.png with its .csv and .gp.
/// @return why there is no picture, empty when there is one. Errors: log missing or foreign, folder can't be written.
Result<std::string> draw_curves(const std::filesystem::path& log_file, const std::filesystem::path& folder,
                                const std::string& name);

}  // namespace gatefield::training
