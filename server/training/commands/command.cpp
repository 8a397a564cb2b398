#include "server/training/commands/command.h"

#include <csignal>
#include <cstdio>
#include <system_error>

#include "server/training/learn/train_loop.h"

namespace gatefield::training {

void stop_on_signals() {
  const auto stop = [](int) { stop_requested = true; };
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
}

int fail(const std::string& sentence) {
  std::fprintf(stderr, "gatefield-train: %s\n", sentence.c_str());
  return kBadInput;
}

int stopped(const std::string& what) {
  std::printf("%s stopped; what is done is kept, and the same command continues\n", what.c_str());
  return kStopped;
}

Status make_folder(const std::filesystem::path& folder) {
  std::error_code code;
  if (!folder.empty()) std::filesystem::create_directories(folder, code);
  if (code) return Error{"folder " + folder.string() + " can't be made: " + code.message()};
  return {};
}

}  // namespace gatefield::training
