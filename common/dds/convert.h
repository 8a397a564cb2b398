#pragma once

#include "common/protocol/messages.h"
#include "common/protocol/server_status.h"
#include "common/protocol/validate.h"
#include "gatefield_idl/gatefield.h"

/// Wire <-> domain, inside common/dds only (it shows generated types).
///
/// to_wire copies; texts longer than their bound are cut (validate() refuses them before they get here).
/// from_wire converts, then runs protocol::validate, then normalises quaternions: what it calls good may be used
/// without another look. It fills `out` as far as it can even when it refuses, so that a refusal can name the vehicle.
/// Nothing here throws on hostile content; sizes are bounded by the sample that was received.
///
/// Thread-safe: yes.   Real-time safe: yes once `out` has held a sample of the same size.
namespace gatefield::dds {

void to_wire(const protocol::SessionRequest& in, wire::SessionRequest* out);
void to_wire(const protocol::SessionReply& in, wire::SessionReply* out);
void to_wire(const protocol::VehicleState& in, wire::VehicleState* out);
void to_wire(const protocol::ThrustRateCommand& in, wire::ThrustRateCommand* out);
void to_wire(const protocol::Telemetry& in, wire::Telemetry* out);
void to_wire(const protocol::ServerStatus& in, wire::ServerStatus* out);
/// Everything but the pixels, which callers swap.
void header_to_wire(const protocol::DepthFrame& in, wire::DepthFrame* out);

Status from_wire(const wire::SessionRequest& in, protocol::SessionRequest* out);
Status from_wire(const wire::SessionReply& in, protocol::SessionReply* out);
Status from_wire(const wire::VehicleState& in, protocol::VehicleState* out);
Status from_wire(const wire::ThrustRateCommand& in, protocol::ThrustRateCommand* out);
Status from_wire(const wire::Telemetry& in, protocol::Telemetry* out);
Status from_wire(const wire::ServerStatus& in, protocol::ServerStatus* out);
/// Swaps the pixels out of `in`. The frame is checked in itself: any size a camera may have, a known encoding, the
/// right byte count.
Status from_wire(wire::DepthFrame* in, protocol::DepthFrame* out);

}  // namespace gatefield::dds
