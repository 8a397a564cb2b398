#pragma once

#include <functional>
#include <string>

namespace gatefield::dds {

/// Takes what the DDS library says from now on: a line a second at most, which tells how many were held back. Until it
/// is called those lines go to standard error. Programs put their log behind it; a hostile peer can make the library
/// complain thousands of times a second.
/// @param sink  called on a thread of the library, until another one is given. Empty: nothing is said.
/// Thread-safe: yes.
void set_library_log(std::function<void(const std::string& line)> sink);

/// Before the first participant: the library's lines go where set_library_log() says.
void limit_library_log();

}  // namespace gatefield::dds
