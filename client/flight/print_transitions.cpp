#include <cstdio>
#include <string_view>

#include "client/flight/transitions_text.h"

// gatefield-supervisor-table: the supervisor's table for documents (deploy/safety-picture).
int main(int count, char** arguments) {
  const std::string_view what = count == 2 ? arguments[1] : "";
  if (what != "--dot" && what != "--markdown") {
    std::fputs("usage: gatefield-supervisor-table --dot | --markdown\n", stderr);
    return 2;
  }
  std::fputs((what == "--dot" ? gatefield::flight::to_dot() : gatefield::flight::to_markdown()).c_str(), stdout);
  return 0;
}
