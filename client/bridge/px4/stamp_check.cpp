#include "client/bridge/px4/stamp_check.h"

#include <algorithm>
#include <string>

#include "common/base/text.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

std::string milliseconds(Stamp span) { return text(seconds(span) * 1e3) + " ms"; }

}  // namespace

Status validate(const StampOptions& options) {
  if (options.most_error < 1ms || options.most_error > 1s)
    return Error::invalid("clock.most_error", milliseconds(options.most_error), "1 to 1000 ms");
  return {};
}

std::optional<Stamp> StampCheck::ours(const Arrival& at, std::uint64_t stamp_us) noexcept {
  since_boot_ = stamp_us < px4::kSince1970_us;
  if (since_boot_) return std::nullopt;
  const Stamp age = at.wall - Stamp(std::chrono::microseconds(static_cast<std::int64_t>(stamp_us)));
  const bool gap = window_began_ && at.now - *window_began_ > 2 * kWindow;
  if (!window_began_ || at.now - *window_began_ > kWindow) {
    least_before_.reset();
    if (window_began_ && !gap) least_before_ = least_;
    window_began_ = at.now;
    least_ = age;
  }
  least_ = std::min(least_, age);
  if (trouble() != Trouble::kNone) return std::nullopt;
  return at.now - age;
}

void StampCheck::on_timesync(const px4::TimesyncStatus& message) noexcept {
  if (message.source_protocol != px4::TimesyncStatus::kDds) return;  // with a ground station, over MAVLink
  own_error_ = std::chrono::microseconds(message.observed_offset - message.estimated_offset);
  round_trip_ = std::chrono::microseconds(message.round_trip_time);
  const bool off = std::max(own_error_, -own_error_) > options_.most_error;
  unsettled_ = off ? std::min(unsettled_ + 1, kInARow) : 0;
}

Stamp StampCheck::least_age() const noexcept { return least_before_ ? std::min(*least_before_, least_) : least_; }

StampCheck::Trouble StampCheck::trouble() const noexcept {
  if (since_boot_) return Trouble::kSinceBoot;
  if (window_began_ && least_age() > options_.most_error) return Trouble::kLate;
  if (window_began_ && least_age() < -kEarly) return Trouble::kEarly;
  return unsettled_ == kInARow ? Trouble::kUnsettled : Trouble::kNone;
}

Status describe(StampCheck::Trouble trouble, Stamp least_age, Stamp own_error, const StampOptions& options) {
  switch (trouble) {
    case StampCheck::Trouble::kNone:
      return {};
    case StampCheck::Trouble::kSinceBoot:
      return Error(
          "PX4's stamps count from its start, since it does not synchronise its time: set its UXRCE_DDS_SYNCT to 1, or "
          "stamps to ARRIVAL",
          ErrorCode::kUnsupported, "vehicle_odometry.timestamp_sample");
    case StampCheck::Trouble::kLate:
    case StampCheck::Trouble::kEarly:
      return Error::invalid(
          "clock.error", milliseconds(least_age),
          milliseconds(-StampCheck::kEarly) + " to " + milliseconds(options.most_error) +
              ": PX4's stamps are off by that against this machine's wall clock; give it a minute after its start, "
              "run its agent on this machine (or hold the clocks together by PTP), or start PX4 again");
    case StampCheck::Trouble::kUnsettled:
      return Error::invalid("timesync_status.observed_offset - estimated_offset", milliseconds(own_error),
                            "at most " + milliseconds(options.most_error) +
                                ": PX4 has not found its agent's clock yet; give it a minute, or start PX4 again");
  }
  return {};
}

}  // namespace gatefield::bridge
