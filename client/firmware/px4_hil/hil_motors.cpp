#include "client/firmware/px4_hil/hil_motors.h"

#include <algorithm>
#include <cmath>

#include "client/firmware/mavlink/constants.h"
#include "common/base/text.h"

namespace gatefield::firmware {
namespace {

/// Outputs of 1 and a rounding more are 1.
constexpr double kFullOutput = 1.001;

}  // namespace

Status HilMotors::take(const mavlink::HilActuatorControls& controls) {
  armed = (controls.mode & mavlink::kModeArmed) != 0;
  for (std::size_t i = 0; i < kMotors; ++i) {
    const auto output = static_cast<double>(controls.controls[i]);
    const bool off = std::isnan(output) || !armed;
    if (!off && !(output >= 0.0 && output <= kFullOutput))
      return Error::invalid("HIL_ACTUATOR_CONTROLS.controls[" + text(i) + "]", text(output),
                            "0 to 1, as motors that turn one way have it");
    outputs[i] = off ? 0.0 : std::min(output, 1.0);
  }
  ++answers;
  return {};
}

}  // namespace gatefield::firmware
