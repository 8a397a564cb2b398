#pragma once

#include <memory>
#include <string>

#include "common/base/result.h"
#include "common/config/scenario.h"
#include "common/protocol/messages.h"
#include "server/perception/gate_sensor.h"

/// Other eyes for the same planner, to see what the learned field is worth. For evaluation alone: no program that is
/// installed links this.
namespace gatefield::baseline {

enum class Kind {
  kNone,       ///< no eyes: gates are where the course says
  kTruePose,   ///< the true gate, from the moment when the depth camera shows a part of it
  kClassical,  ///< a detector in the depth image, see classical_detector.h
};

/// "NONE", "TRUE_POSE", "CLASSICAL". Errors (kUnknownName): a sentence with the names.
Result<Kind> parse_kind(const std::string& word);
const char* name(Kind kind) noexcept;

/// What looks for gates in the learned sensor's place. The filter and the rules around it are the product's
/// (perception::Sight, gates::GateRecords); the field is the hourglass of the believed pose.
/// @param request   of the session: its course has the shapes of the gates that are looked for
/// @param scenario  kTruePose: the true gates are drawn from it, with its seed; the request's is the planner's alone
std::unique_ptr<perception::GateSensor> make_sensor(Kind kind, const protocol::SessionRequest& request,
                                                    const config::Scenario& scenario);

}  // namespace gatefield::baseline
