#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/dds/network.h"
#include "common/protocol/server_status.h"

namespace gatefield::dds {

/// The servers that say within `wait` that they are there (they do four times a second), each once with what it said
/// last, by name. Finding each other takes about half a second; one second is enough on a quiet network.
/// @param network  as Options::network of the SDK; in a closed domain `security` is a tool's folder, since vehicles may
///                 not hear servers talk
/// @param cancel   when it becomes true, listening ends within some 20 ms; null: nothing ends it early
/// Errors: what the network can't be used for, with the field; not that nobody is there.
/// Thread-safe: yes.   Real-time safe: no (waits).
Result<std::vector<protocol::ServerStatus>> list_servers(std::uint32_t domain, const NetworkOptions& network,
                                                         std::chrono::milliseconds wait,
                                                         const std::atomic<bool>* cancel = nullptr);

}  // namespace gatefield::dds
