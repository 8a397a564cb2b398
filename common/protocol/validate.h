#pragma once

#include <string_view>

#include "common/base/result.h"
#include "common/protocol/messages.h"

namespace gatefield::protocol {

/// One function per message that the outside can send: run on every received sample before anything uses it.
/// The sentence names the field, its value and what was expected.
/// Thread-safe: yes.   Real-time safe: yes when the sample is good (a refusal allocates its sentence).
Status validate(const SessionRequest& request);
Status validate(const SessionReply& reply);
Status validate(const VehicleState& state);
/// Against the session's camera: size, encoding, byte count. What is *in* the pixels is perception's matter.
Status validate(const DepthFrame& frame, const CameraModel& camera);
Status validate(const ThrustRateCommand& command);
Status validate(const Telemetry& telemetry);

/// Vehicle and server names: 1 to 63 of [A-Za-z0-9_.-].
/// Real-time safe: is_name() yes.
bool is_name(std::string_view name) noexcept;
Status validate_name(const char* field, const std::string& name);

}  // namespace gatefield::protocol
