#include "server/app/watch.h"

#include <algorithm>

#include "common/base/logging.h"

namespace gatefield::app {
namespace {

using namespace std::chrono_literals;

constexpr auto kDrainedWithin = 100ms;  // of the last vehicle's leaving

}  // namespace

Status Watch::offer(const std::string& address) {
  if (address.empty()) return {};
  auto pages = operations::HttpPages::open(
      address, {{"/healthz", [this] { return health_page(); }}, {"/metrics", [this] { return metrics_page(); }}});
  if (!pages) return pages.failure();
  pages_ = std::move(pages).value();
  log::info("metrics: port " + std::to_string(pages_->port()) + ", /metrics and /healthz");
  return {};
}

const char* Watch::run(const Signals& signals) {
  std::chrono::nanoseconds period = 1s;
  if (manager_.watchdog()) period = std::min<std::chrono::nanoseconds>(period, *manager_.watchdog() / 3);
  manager_.ready(health().words);
  for (;;) {
    const int number = signals.wait(period);
    if (number == SIGINT || number == SIGTERM) {
      manager_.stopping("ends");
      return number == SIGINT ? "SIGINT" : "SIGTERM";
    }
    if (parts_.deaf()) {
      manager_.stopping("is deaf");
      return "deaf";
    }
    if (parts_.service->drained()) {
      manager_.stopping("is drained");
      return "drained";
    }
    if (number == SIGUSR1) {
      parts_.drain();
      period = std::min<std::chrono::nanoseconds>(period, kDrainedWithin);
    }
    if (number == SIGHUP) {
      manager_.reloading();
      parts_.reload();
      manager_.ready(health().words);
    }
    look();
  }
}

/// A server that hangs gives no sign of life any more, so that whoever watches starts it again.
void Watch::look() {
  const operations::Health found = health();
  if (found.well) manager_.alive(found.words);
  if (found.well != was_well_) found.well ? log::info("well again: " + found.words) : log::error(found.words);
  was_well_ = found.well;
  memory_.look(*parts_.service->figures());
}

operations::Health Watch::health() const {
  return operations::health_of(*parts_.service->figures(), parts_.clock->now());
}

operations::HttpAnswer Watch::health_page() const {
  const operations::Health found = health();
  operations::HttpAnswer answer;
  answer.status = found.well ? 200 : 503;
  answer.body = found.words + "\n";
  return answer;
}

operations::HttpAnswer Watch::metrics_page() const {
  operations::HttpAnswer answer;
  answer.type = "text/plain; version=0.0.4; charset=utf-8";
  answer.body = operations::metrics(parts_.words, *parts_.service->figures(), health(), operations::process_figures(),
                                    parts_.packets_dropped());
  return answer;
}

}  // namespace gatefield::app
