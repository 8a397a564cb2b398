#include "client/race/server_process.h"

namespace gatefield::race {
namespace {

using namespace std::chrono_literals;

constexpr auto kGrace = 2000ms;
constexpr const char* kReady = "ready: server";

}  // namespace

Result<std::unique_ptr<ChildProcess>> start_server(const std::vector<std::string>& arguments,
                                                   const std::filesystem::path& log, std::chrono::milliseconds limit,
                                                   const std::atomic<bool>& cancel) {
  ChildOptions options;
  options.arguments = arguments;
  options.log = log;
  options.grace = kGrace;
  auto server = ChildProcess::start(options);
  if (!server || server.value()->wait_for_words(kReady, limit, &cancel)) return server;
  if (const auto end = server.value()->wait(0ms))
    return Error{arguments[0] + " ended " + text(*end) + " before it was ready: " + server.value()->last_line(),
                 end->exited && end->code == kServerBadInput ? ErrorCode::kInvalid : ErrorCode::kNotAnswering};
  if (cancel) return Error{"interrupted while a server started", ErrorCode::kNotAnswering};
  return Error{arguments[0] + " was not ready within " + std::to_string(limit.count() / 1000) +
                   " s, its last words (in " + log.string() + "): " + server.value()->last_line(),
               ErrorCode::kNotAnswering};
}

}  // namespace gatefield::race
