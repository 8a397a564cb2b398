#pragma once

namespace gatefield::dds {

/// From now on the DDS library's lines stand in the program's log, as warnings: one a second (set_library_log()).
/// @pre log::start()   Thread-safe: yes.
void log_library_lines();

}  // namespace gatefield::dds
