#include "client/firmware/px4_hil/hil_options.h"

#include <algorithm>
#include <cmath>

#include "client/firmware/link/link.h"
#include "client/firmware/link/serial_port.h"
#include "client/firmware/mavlink/frame_format.h"
#include "client/firmware/mavlink/messages.h"
#include "common/base/text.h"

namespace gatefield::firmware {
namespace {

using namespace std::chrono_literals;

constexpr double kLeastRate_hz = 20.0, kMostRate_hz = 1000.0;
constexpr double kLockstepRate_hz = 250.0;
constexpr double kBitsPerByte = 10.0;          // 8N1: a start bit, eight, a stop bit
constexpr double kUsable = 0.8;                // of a line, so that nothing waits long behind something else
constexpr double kSatellites_hz = 20.0;        // at most
constexpr double kSmallThings_byte_s = 600.0;  // heartbeats, commands, requests

std::string in_seconds(Stamp span) { return text(seconds(span)) + " s"; }

bool is_datagram(Address::Kind kind) noexcept {
  return kind == Address::Kind::kUdp || kind == Address::Kind::kUdpListen;
}

template <typename Message>
constexpr double kFrame_byte = static_cast<double>(mavlink::payload_length<Message>() + mavlink::kHeader2 +
                                                   mavlink::kChecksum);

double others_byte_s(double setpoint_rate_hz) noexcept {
  return kSmallThings_byte_s + kSatellites_hz * kFrame_byte<mavlink::HilGps> +
         setpoint_rate_hz * kFrame_byte<mavlink::SetAttitudeTarget>;
}

}  // namespace

Status validate(const HilOptions& options) {
  const auto address = parse_address(options.address);
  if (!address) return address.failure().within("address: ", "address.");
  if (is_datagram(address->kind))
    return Error::invalid("address", options.address, "a tcp-listen: or serial: address, which loses nothing");
  if (options.connect_timeout < 100ms || options.connect_timeout > 10min)
    return Error::invalid("connect_timeout", in_seconds(options.connect_timeout), "0.1 to 600 s");
  if (options.boot_timeout < 1s || options.boot_timeout > 10min)
    return Error::invalid("boot_timeout", in_seconds(options.boot_timeout), "1 to 600 s");
  if (options.answer_timeout < 10ms || options.answer_timeout > 60s)
    return Error::invalid("answer_timeout", in_seconds(options.answer_timeout), "0.01 to 60 s");
  if (options.silence_limit < 50ms || options.silence_limit > 5s)
    return Error::invalid("silence_limit", in_seconds(options.silence_limit), "0.05 to 5 s");
  const bool board = address->kind == Address::Kind::kSerial;
  if (board && !(options.sample_rate_hz >= kLeastRate_hz && options.sample_rate_hz <= kMostRate_hz))
    return Error::invalid("sample_rate_hz", text(options.sample_rate_hz) + " Hz",
                          text(kLeastRate_hz) + " to " + text(kMostRate_hz) + " Hz");
  if (!board && options.sample_rate_hz != kLockstepRate_hz)
    return Error::invalid("sample_rate_hz", text(options.sample_rate_hz) + " Hz",
                          text(kLockstepRate_hz) + " Hz in lockstep; only a board on a serial port takes another");
  return {};
}

bool is_board(const HilOptions& options) {
  return parse_address(options.address).value().kind == Address::Kind::kSerial;
}

Status check_room(const HilOptions& options, double setpoint_rate_hz) {
  const int baud = parse_address(options.address).value().baud;
  const double others = others_byte_s(setpoint_rate_hz);
  const auto fitting_hz = [&](int rate) {
    return std::floor((kUsable * rate / kBitsPerByte - others) / kFrame_byte<mavlink::HilSensor>);
  };
  const double fits_hz = fitting_hz(baud);
  if (options.sample_rate_hz <= fits_hz) return {};
  const std::string beside = setpoint_rate_hz > 0.0 ? " beside setpoints at " + text(setpoint_rate_hz) + " Hz" : "";
  if (fits_hz >= kLeastRate_hz)
    return Error::invalid("sample_rate_hz", text(options.sample_rate_hz) + " Hz",
                          "at most " + text(fits_hz) + " Hz, which fits into " + text(baud) + " baud" + beside);
  const auto bauds = baud_rates();
  const auto enough = std::ranges::find_if(bauds, [&](int rate) { return fitting_hz(rate) >= options.sample_rate_hz; });
  return Error::invalid("address.baud", text(baud),
                        (enough == bauds.end() ? "a faster line" : text(*enough) + " or more") +
                            ": no useful rate of samples fits" + beside);
}

}  // namespace gatefield::firmware
