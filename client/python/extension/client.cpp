#include "client/python/extension/client.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "client/python/extension/depth.h"
#include "client/python/extension/fields.h"
#include "client/python/extension/options.h"
#include "client/python/extension/process.h"
#include "client/python/extension/refusal.h"
#include "gatefield/sdk/client.h"

namespace gatefield::python {

namespace py = pybind11;

namespace {

constexpr double kLongestWait_s = 1e6;

template <typename Work>
auto without_gil(Work&& work) {
  const py::gil_scoped_release released;
  return work();
}

/// An SDK client in Python's hands. Called with the GIL held, by any thread; play() and applied() keep it, so that they
/// take turns, everything that waits or makes system calls gives it away.
class Handle {
 public:
  Handle(std::shared_ptr<sdk::Client> client, const CameraModel& camera)
      : client_(std::move(client)), width_px_(camera.width_px), height_px_(camera.height_px) {}
  ~Handle() { close(); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  /// Leaves the session. Calls of other threads that are under way end first.
  void close() {
    std::shared_ptr<sdk::Client> client = std::move(client_);
    client_ = nullptr;
    if (!client) return;
    if (forked()) {
      // Its threads stayed in the parent, who flies on: nothing may be said or taken down here.
      static_cast<void>(new std::shared_ptr<sdk::Client>(std::move(client)));
      return;
    }
    const py::gil_scoped_release released;
    client.reset();
  }
  bool closed() const { return client_ == nullptr; }

  std::uint64_t send_depth(const py::object& stamp, const py::object& image) {
    const auto client = in_use();
    const Stamp when = to_stamp(stamp, "stamp");
    const DepthImage depth = to_depth(image, height_px_, width_px_);
    const void* const pixels = depth.array.data();
    const auto count = static_cast<std::size_t>(depth.array.size());
    const py::gil_scoped_release released;
    return depth.counts ? client->send_depth_counts(when, {static_cast<const std::uint16_t*>(pixels), count})
                        : client->send_depth(when, {static_cast<const float*>(pixels), count});
  }

  std::uint64_t send_state(const py::object& stamp, const py::object& state, bool thrust_known) {
    const auto client = in_use();
    const Stamp when = to_stamp(stamp, "stamp");
    const QuadrotorState sent = to_state(state);
    const py::gil_scoped_release released;
    return client->send_state(when, sent, thrust_known);
  }

  std::shared_ptr<protocol::ThrustRateCommand> newest() {
    const auto client = in_use();
    return shared(without_gil([&] { return client->newest(); }));
  }

  std::shared_ptr<protocol::ThrustRateCommand> wait_for_answer(const py::object& sequence, const py::object& timeout) {
    const std::uint64_t state = to_count(sequence, "sequence", UINT64_MAX);
    const double timeout_s = to_number(timeout, "timeout_s");
    if (!(timeout_s >= 0.0 && timeout_s <= kLongestWait_s))
      refuse(Error::invalid("timeout_s", py::str(timeout), "0 to 1000000 seconds"));
    const MonotonicClock clock;
    const Stamp deadline = clock.now() + from_seconds(timeout_s);
    for (;;) {
      const auto client = in_use();  // anew each time: another thread may close it meanwhile
      const Stamp turn = std::clamp<Stamp>(deadline - clock.now(), Stamp{0}, kSignalPoll);
      if (auto answer = without_gil(
              [&] { return client->wait_for_answer(state, std::chrono::ceil<std::chrono::milliseconds>(turn)); }))
        return shared(std::move(answer));
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (clock.now() >= deadline) return nullptr;
    }
  }

  sdk::Setpoint play(const py::object& now, const py::object& state, const py::object& period) {
    return in_use()->play(to_stamp(now, "now"), to_state(state), to_stamp(period, "period"));
  }

  void applied(const py::object& now, const std::optional<sdk::Setpoint>& setpoint) {
    in_use()->applied(to_stamp(now, "now"), setpoint);
  }

  py::list problems() {
    const auto client = in_use();
    py::list all;
    for (const protocol::Problem problem : protocol::list(without_gil([&] { return client->problems(); })))
      all.append(problem);
    return all;
  }

  /// One of the SDK's questions that need no argument.
  template <typename Answer>
  Answer ask(Answer (sdk::Client::*question)()) {
    const auto client = in_use();
    return without_gil([&] { return (client.get()->*question)(); });
  }
  template <typename Answer>
  Answer ask(Answer (sdk::Client::*question)() const) {
    const auto client = in_use();
    return without_gil([&] { return (client.get()->*question)(); });
  }

 private:
  /// Keeps it alive for the call.
  std::shared_ptr<sdk::Client> in_use() const {
    if (client_ == nullptr) {
      PyErr_SetString(PyExc_ValueError, "this client has left its session (it was closed), expected a new connect()");
      throw py::error_already_set();
    }
    if (forked()) use_network();  // which refuses
    return client_;
  }

  static std::shared_ptr<protocol::ThrustRateCommand> shared(std::optional<protocol::ThrustRateCommand>&& command) {
    return command ? std::make_shared<protocol::ThrustRateCommand>(std::move(*command)) : nullptr;
  }

  std::shared_ptr<sdk::Client> client_;  // under the GIL
  const int width_px_, height_px_;
};

std::unique_ptr<Handle> connect(const py::object& given) {
  const sdk::Options options = to_options(given);
  use_network();
  using Joined = Result<std::unique_ptr<sdk::Client>>;
  auto joined =
      interruptible<Joined>([&](const std::atomic<bool>* cancel) { return sdk::Client::connect(options, cancel); });
  return std::make_unique<Handle>(value_or_refuse(std::move(joined)), options.camera);
}

}  // namespace

void bind_client(py::module_* module) {
  using sdk::Client;
  py::class_<Handle>(*module, "Client")
      .def("close", &Handle::close)
      .def_property_readonly("closed", &Handle::closed)
      .def("session", [](Handle& self) { return self.ask(&Client::session); })
      .def("send_depth", &Handle::send_depth)
      .def("send_state", &Handle::send_state)
      .def("newest", &Handle::newest)
      .def("wait_for_answer", &Handle::wait_for_answer)
      .def("play", &Handle::play)
      .def("applied", &Handle::applied)
      .def("problems", &Handle::problems)
      .def("problem_change", [](Handle& self) { return self.ask(&Client::problem_change); })
      .def("session_change", [](Handle& self) { return self.ask(&Client::session_change); })
      .def("statistics", [](Handle& self) { return self.ask(&Client::statistics); })
      .def("telemetry", [](Handle& self) { return self.ask(&Client::telemetry); });
  module->def("connect", &connect);
}

}  // namespace gatefield::python
