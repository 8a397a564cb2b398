#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/dds/network.h"
#include "common/protocol/server_status.h"

namespace gatefield::sdk {

/// Who serves in a domain: the servers that say within `wait` that they are there (they do four times a second), each
/// once, by name. A second is enough on a quiet network.
/// @param network  as Options::network; in a closed domain `security` is a tool's folder (gatefield-keys tool NAME)
/// @param cancel   when it becomes true, listening ends within some 20 ms; null: nothing ends it early
/// Errors: what the network can't be used for, with the field. That nobody is there is none.
/// Thread-safe: yes.   Real-time safe: no (waits).
Result<std::vector<protocol::ServerStatus>> find_servers(std::uint32_t domain, const dds::NetworkOptions& network = {},
                                                         std::chrono::milliseconds wait = std::chrono::seconds(1),
                                                         const std::atomic<bool>* cancel = nullptr);

}  // namespace gatefield::sdk
