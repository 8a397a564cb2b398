#pragma once

#include <cstdio>
#include <string>

/// How gatefield-race ends, see its --help.
namespace gatefield::race {

inline constexpr int kExitDone = 0, kExitBadInput = 2, kExitNoServer = 3, kExitInterrupted = 130;

/// Says what is wrong, on standard error. @return the exit code
inline int complain(const std::string& sentence, int code = kExitBadInput) {
  std::fprintf(stderr, "gatefield-race: %s\n", sentence.c_str());
  return code;
}

}  // namespace gatefield::race
