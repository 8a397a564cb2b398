#pragma once

#include "common/dds/px4/messages.h"
#include "gatefield_idl/px4.h"

/// Wire <-> domain, inside common/dds only (it shows generated types). Nothing is checked here; validate() does that.
/// Thread-safe: yes.   Real-time safe: yes.   Errors: none.
namespace gatefield::px4 {

namespace wire = px4_msgs::msg::dds_;

void to_wire(const OffboardControlMode& in, wire::OffboardControlMode_* out) noexcept;
void to_wire(const VehicleRatesSetpoint& in, wire::VehicleRatesSetpoint_* out) noexcept;
void to_wire(const VehicleCommand& in, wire::VehicleCommand_* out) noexcept;

VehicleCommandAck from_wire(const wire::VehicleCommandAck_& in) noexcept;
VehicleOdometry from_wire(const wire::VehicleOdometry_& in) noexcept;
VehicleStatus from_wire(const wire::VehicleStatusV0_& in) noexcept;
VehicleStatus from_wire(const wire::VehicleStatusV1_& in) noexcept;
VehicleStatus from_wire(const wire::VehicleStatusV4_& in) noexcept;
VehicleLandDetected from_wire(const wire::VehicleLandDetected_& in) noexcept;
SensorCombined from_wire(const wire::SensorCombined_& in) noexcept;
TimesyncStatus from_wire(const wire::TimesyncStatus_& in) noexcept;
ManualControlSetpoint from_wire(const wire::ManualControlSetpoint_& in) noexcept;
InputRc from_wire(const wire::InputRc_& in) noexcept;
InputRc from_wire(const wire::InputRcWithFrameRate_& in) noexcept;
BatteryStatus from_wire(const wire::BatteryStatusFiltered_& in) noexcept;
BatteryStatus from_wire(const wire::BatteryStatusV0_& in) noexcept;
BatteryStatus from_wire(const wire::BatteryStatusV1_& in) noexcept;

}  // namespace gatefield::px4
