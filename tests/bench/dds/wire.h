#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "common/base/clock.h"
#include "common/dds/endpoint.h"

namespace gatefield::bench {

/// Every clock of one machine's programs is the same one, so that one process may subtract what another one read.
inline Stamp now() { return MonotonicClock().now(); }

/// Who serves in these measurements.
inline constexpr const char* kServer = "bench";

struct Wire {
  std::uint32_t domain = 0;
  bool shared_memory = false;
  std::string keys = {};  ///< of a closed domain: folder of gatefield-keys; empty: it is open
};

/// The folder of a server, or of a vehicle of this name.
inline std::string security(const Wire& wire, const std::string& name) {
  if (wire.keys.empty()) return {};
  return wire.keys + (name == kServer ? "/servers/" : "/vehicles/") + name;
}

/// An end of the wire as the product opens it. Null when it can't be, with the reason on stderr.
template <typename Endpoint, typename Handler>
std::unique_ptr<Endpoint> open(const Wire& wire, const std::string& name, Handler* handler) {
  dds::TransportOptions transport;
  transport.network.shared_memory = wire.shared_memory;
  transport.network.security = security(wire, name);
  auto opened = Endpoint::create(wire.domain, name, handler, transport);
  if (opened.ok()) return std::move(opened).value();
  std::fprintf(stderr, "gatefield-dds-bench: %s\n", opened.error().c_str());
  return nullptr;
}

}  // namespace gatefield::bench
