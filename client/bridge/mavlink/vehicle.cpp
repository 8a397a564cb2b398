#include "client/bridge/mavlink/vehicle.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/bridge/mavlink/report.h"
#include "common/base/text.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

constexpr Stamp kOpenTimeout = 5s;    // TCP's
constexpr Stamp kSettleTimeout = 6s;  // parameters and clock, after the first heartbeat

bool has_datagrams(const std::string& link) {
  const auto address = firmware::parse_address(link);
  return address &&
         (address->kind == firmware::Address::Kind::kUdp || address->kind == firmware::Address::Kind::kUdpListen);
}

}  // namespace

Result<std::unique_ptr<MavlinkVehicle>> MavlinkVehicle::open(const MavlinkConfig& config,
                                                             const std::atomic<bool>* cancel) {
  if (Status status = validate(config); !status) return status.failure();
  auto link = firmware::open(firmware::parse_address(config.link).value(), kOpenTimeout);
  if (!link) return link.failure();
  auto vehicle = std::make_unique<MavlinkVehicle>(config, std::move(link).value(), std::make_unique<MonotonicClock>());
  if (Status status = vehicle->connect(cancel); !status) return status.failure();
  return vehicle;
}

MavlinkVehicle::MavlinkVehicle(const MavlinkConfig& config, std::unique_ptr<firmware::Link> link,
                               std::unique_ptr<Clock> clock)
    : config_(config),
      datagrams_(has_datagrams(config.link)),
      link_(std::move(link)),
      clock_(std::move(clock)),
      autopilot_(config, this),
      thrust_(config.thrust, config.quadrotor) {}

Status MavlinkVehicle::connect(const std::atomic<bool>* cancel) {
  const auto cancelled = [cancel] { return cancel != nullptr && *cancel; };
  const Stamp begin = now();
  while (!report().peer && !cancelled() && now() - begin < config_.connect_timeout) keep_alive(20ms);
  AutopilotReport found = report();
  if (!found.peer) return Error(complaints().front(), ErrorCode::kNoAnswer, "link");
  const auto settled = [this](const AutopilotReport& report) {
    const bool clock = config_.stamps == Stamps::kArrival || report.clock != TimeSync::Trouble::kNoAnswers;
    return report.wrong_firmware || (report.parameters_done && clock);
  };
  const Stamp heard = now();
  while (!settled(found = report()) && !cancelled() && now() - heard < kSettleTimeout) keep_alive(20ms);
  if (found.wrong_firmware) return Error(complaints().front(), ErrorCode::kInvalid, "dialect");
  if (!found.thrust_is_thrust) {
    const auto sentences = complaints();
    const auto sentence = std::ranges::find_if(sentences, [](const std::string& s) { return s.starts_with("GUID"); });
    return Error(sentence == sentences.end() ? "GUID_OPTIONS could not be read" : *sentence, ErrorCode::kInvalid,
                 "GUID_OPTIONS");
  }
  return {};
}

std::vector<std::string> MavlinkVehicle::description() const { return bridge::description(report(), config_); }

std::vector<std::string> MavlinkVehicle::complaints() const {
  auto sentences = bridge::complaints(report(), reader_.counts(), config_);
  if (broken_) sentences.push_back(firmware::broken(*link_, *broken_).message);
  if (not_sent_ > 0)
    sentences.push_back(text(not_sent_) + " messages found no room on " + link_->name() +
                        "; lower setpoint_rate_hz and state_rate_hz, or take a faster link");
  if (const Status status = flight::agreement(thrust_, config_.thrust); !status) sentences.push_back(status.error());
  return sentences;
}

Stamp MavlinkVehicle::sleep_until(Stamp deadline) noexcept {
  for (;;) {
    pump();
    const Stamp time = now();
    if (time >= deadline) return time;
    link_->wait(std::min(deadline - time, kTick));
  }
}

void MavlinkVehicle::pump() noexcept {
  for (int i = 0; i < kMostReads; ++i) {
    const firmware::Transfer transfer = link_->receive(buffer_);
    if (transfer.broken != 0) broken_ = transfer;
    if (transfer.bytes == 0) break;
    broken_.reset();
    const Stamp heard = now();
    reader_.read({buffer_.data(), transfer.bytes}, datagrams_,
                 [&](const mavlink::Frame& frame) { autopilot_.on_frame(heard, frame); });
  }
  autopilot_.tick(now());
}

void MavlinkVehicle::send(const mavlink::Message& message) noexcept {
  const auto packet = mavlink::pack(message, {config_.own_system, config_.own_component}, sequence_);
  const firmware::Transfer transfer = link_->send(packet.bytes());
  if (transfer.broken != 0) broken_ = transfer;
  if (transfer.bytes > 0)
    ++sequence_;
  else if (reader_.counts().frames > 0)  // before that a link that listens has nobody to send to
    ++not_sent_;
}

}  // namespace gatefield::bridge
