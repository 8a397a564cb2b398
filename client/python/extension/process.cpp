#include "client/python/extension/process.h"

#include <pthread.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <mutex>

#include "client/python/extension/refusal.h"

namespace gatefield::python {
namespace {

std::atomic<bool> network_used{false};
std::atomic<bool> child_without_network{false};

/// Of a forked child, when Python has ended: the middleware's own end would wait for threads that are not there.
void end_without_middleware(int status, void*) {
  std::fflush(nullptr);
  _exit(status);
}

}  // namespace

void use_network() {
  if (forked())
    refuse(
        Error("this process was forked from one that had used gatefield's network, whose threads stayed there; "
              "expected a process of its own: fork before the first connect(), or use "
              "multiprocessing.get_context('spawn')",
              ErrorCode::kUnsupported));
  static std::once_flag once;
  std::call_once(once, [] {
    pthread_atfork(nullptr, nullptr, [] {
      if (!network_used) return;
      child_without_network = true;
      on_exit(end_without_middleware, nullptr);
    });
  });
  network_used = true;
}

bool forked() noexcept { return child_without_network; }

}  // namespace gatefield::python
