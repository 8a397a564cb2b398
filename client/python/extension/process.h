#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <future>

/// What a Python process does to a client: signals and forks. All of it is called with the GIL held.
namespace gatefield::python {

/// Refuses in a process that was forked from one that had used the network: the middleware's threads stayed in the
/// parent. Else from now on the network is in use.
void use_network();
/// True in such a process, where nothing of the network may even be closed.
bool forked() noexcept;

/// How often a wait looks whether a signal came (Ctrl-C), which Python's handlers only see between calls.
inline constexpr std::chrono::milliseconds kSignalPoll{40};

/// Runs `work` on a thread of its own without the GIL. When a signal's handler raises meanwhile (KeyboardInterrupt),
/// `cancel` asks `work` to end, and what was raised is raised here once it has.
template <typename Value>
Value interruptible(const std::function<Value(const std::atomic<bool>* cancel)>& work) {
  std::atomic<bool> cancel{false};
  auto running = std::async(std::launch::async, [&] { return work(&cancel); });
  for (;;) {
    {
      const pybind11::gil_scoped_release released;
      if (running.wait_for(kSignalPoll) == std::future_status::ready) break;
    }
    if (PyErr_CheckSignals() == 0) continue;
    const pybind11::error_already_set raised;  // holds it while others use Python
    cancel = true;
    {
      const pybind11::gil_scoped_release released;
      running.wait();
    }
    throw pybind11::error_already_set(raised);
  }
  return running.get();
}

}  // namespace gatefield::python
