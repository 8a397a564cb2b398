#include "client/bridge/px4/vehicle.h"

#include <algorithm>
#include <chrono>
#include <utility>
#include <variant>

#include "common/base/text.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

constexpr Stamp kSettleTimeout = 3s;  // first states, after PX4 was heard

}  // namespace

Result<std::unique_ptr<Px4Vehicle>> Px4Vehicle::open(const Px4Config& config, const std::atomic<bool>* cancel,
                                                     std::unique_ptr<flight::LoopClock> clock) {
  if (Status status = validate(config); !status) return status.failure();
  auto vehicle = std::make_unique<Px4Vehicle>(config, std::move(clock));
  if (Status status = vehicle->connect(cancel); !status) return status.failure();
  return vehicle;
}

Px4Vehicle::Px4Vehicle(const Px4Config& config, std::unique_ptr<flight::LoopClock> clock)
    : config_(config), clock_(std::move(clock)), autopilot_(config, this), thrust_(config.thrust, config.quadrotor) {}

Px4Vehicle::~Px4Vehicle() = default;

Status Px4Vehicle::connect(const std::atomic<bool>* cancel) {
  const auto cancelled = [cancel] { return cancel != nullptr && *cancel; };
  auto endpoint = px4::Endpoint::create(config_.bus, this);
  if (!endpoint) return endpoint.failure();
  endpoint_ = std::move(endpoint).value();
  const Stamp begin = now();
  while (!report().status && !cancelled() && now() - begin < config_.connect_timeout) keep_alive(20ms);
  if (!report().status) {
    std::string sentence;
    for (const std::string& each : complaints()) sentence += (sentence.empty() ? "" : "; ") + each;
    return Error(sentence, ErrorCode::kNoAnswer, "domain");
  }
  const Stamp heard = now();
  while (report().states == 0 && !cancelled() && now() - heard < kSettleTimeout) keep_alive(20ms);
  return {};
}

std::vector<std::string> Px4Vehicle::description() const { return bridge::description(report(), config_); }

BusReport Px4Vehicle::bus_report() const {
  BusReport bus;
  if (endpoint_) bus.offered = endpoint_->offered();
  bus.not_sent = not_sent_;
  const std::lock_guard lock(rejected_mutex_);
  bus.rejected = rejected_;
  bus.why = why_rejected_;
  return bus;
}

std::vector<std::string> Px4Vehicle::complaints() const {
  auto sentences = bridge::complaints(report(), bus_report(), config_);
  if (const Status status = flight::agreement(thrust_, config_.thrust); !status) sentences.push_back(status.error());
  return sentences;
}

Stamp Px4Vehicle::sleep_until(Stamp deadline) noexcept {
  for (;;) {
    pump();
    const Stamp time = now();
    if (time >= deadline) return time;
    clock_->sleep_until(std::min(deadline, time + kTick));
  }
}

void Px4Vehicle::pump() noexcept {
  const auto take = [this](auto& box) {
    if (const auto* arrived = box.read()) autopilot_.on_message(arrived->at, arrived->message);
  };
  std::apply([&](auto&... boxes) { (take(boxes), ...); }, boxes_.all);
}

void Px4Vehicle::on_message(const px4::Message& message) {
  const Arrival at{now(), std::chrono::system_clock::now().time_since_epoch()};
  std::visit(
      [&]<typename Kind>(const Kind& content) {
        std::get<Mailbox<Arrived<Kind>>>(boxes_.all).write({at, content});
      },
      message);
}

void Px4Vehicle::on_rejected(std::string_view, const Error& why) {
  const std::lock_guard lock(rejected_mutex_);
  ++rejected_;
  why_rejected_ = why;
}

}  // namespace gatefield::bridge
