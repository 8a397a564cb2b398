#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/child_process.h"
#include "common/base/result.h"

namespace gatefield::race {

/// Exit code of gatefield-server and gatefield-baseline-server for arguments, models and profiles that are wrong.
inline constexpr int kServerBadInput = 2;

/// Starts a gatefield-server of our own and waits until it says that it is ready. It is asked to end when the result
/// goes, killed two seconds later, and ends with the thread that started it (ChildProcess).
/// @param arguments  program first; its folder is looked for on the PATH when it names none
/// @param log        what it says is added to this file
/// @param cancel     becomes true when nobody wants it any more
/// Errors: kUnreadable, program or log are not to be had; kInvalid, it ended with kServerBadInput; kNotAnswering, it
/// ended otherwise or was not ready in time (with its last words), or nobody wants it.
Result<std::unique_ptr<ChildProcess>> start_server(const std::vector<std::string>& arguments,
                                                   const std::filesystem::path& log, std::chrono::milliseconds limit,
                                                   const std::atomic<bool>& cancel);

}  // namespace gatefield::race
