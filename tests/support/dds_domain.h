#pragma once

#include <unistd.h>

#include <cstdint>

namespace gatefield::test {

/// A DDS domain for this process, so that tests that run at the same time don't hear each other. 10 to 99: the ports
/// stay below the range that the system gives to outgoing sockets.
inline std::uint32_t own_domain() { return 10 + static_cast<std::uint32_t>(getpid()) % 90; }

}  // namespace gatefield::test
