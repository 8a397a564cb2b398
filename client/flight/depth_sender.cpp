#include "client/flight/depth_sender.h"

namespace gatefield::flight {

DepthSender::DepthSender(DepthSource* source, sdk::Client* client) : source_(source), client_(*client) {
  if (source_ != nullptr) thread_ = std::thread([this] { run(); });
}

std::uint64_t DepthSender::stop() {
  ending_.store(true);
  if (thread_.joinable()) thread_.join();
  return sent_;
}

void DepthSender::run() {
  while (!ending_.load()) {
    const auto frame = source_->next(kWait);
    if (!frame || ending_.load()) continue;
    if (const auto* counts = std::get_if<std::span<const std::uint16_t>>(&frame->pixels)) {
      client_.send_depth_counts(frame->capture, *counts);
    } else {
      client_.send_depth(frame->capture, std::get<std::span<const float>>(frame->pixels));
    }
    ++sent_;
  }
}

}  // namespace gatefield::flight
