#pragma once

#include <string>
#include <string_view>

/// What programs say to the person who runs them. Thread-safe: yes, but for start().   Real-time safe: no.
namespace gatefield::log {

enum class Format {
  kText,  ///< for people
  kJson,  ///< an object a line: time (UTC, RFC 3339), level, program, message
};

/// Starts logging to standard error; `level` is one of trace, debug, info, warn, error, off. Unknown levels mean info.
void start(std::string_view program, std::string_view level = "info", Format format = Format::kText);
void debug(std::string_view message);
void info(std::string_view message);
void warn(std::string_view message);
void error(std::string_view message);

}  // namespace gatefield::log
