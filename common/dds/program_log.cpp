#include "common/dds/program_log.h"

#include <string>

#include "common/base/logging.h"
#include "common/dds/library_log.h"

namespace gatefield::dds {

void log_library_lines() {
  set_library_log([](const std::string& line) { log::warn(line); });
}

}  // namespace gatefield::dds
