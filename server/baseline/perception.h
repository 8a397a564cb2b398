#pragma once

#include <memory>
#include <string>

#include "common/base/result.h"
#include "common/config/scenario.h"
#include "server/perception/depth_encoder.h"
#include "server/service/sight.h"

/// Other eyes for the same planner, to see what the learned field is worth. For evaluation alone: no program that is
/// installed links this.
namespace gatefield::baseline {

enum class Kind {
  kNone,       ///< no eyes: gates are where the course says
  kTruePose,   ///< the true gate, from the moment when the depth camera shows a part of it
  kClassical,  ///< a detector in the depth image, see classical_detector.h
};

/// "NONE", "TRUE_POSE", "CLASSICAL". Errors: a sentence with the names.
Result<Kind> parse_kind(const std::string& name);
const char* name(Kind kind) noexcept;

/// What looks at the depth image in the network's place. What it finds goes to the memory below as an Encoding whose
/// latent is the memory's to understand. @param course  has the shapes of the gates that are looked for
std::unique_ptr<perception::DepthEncoder> make_encoder(Kind kind, const Course& course);

/// What is remembered of the gates in the learned field's place: the filter and the rules are the product's
/// (perception::GateRecords), the field is the hourglass of the believed pose.
/// @param scenario  kTruePose: gives the true gates, with the request's seed
std::unique_ptr<service::Memory> make_memory(Kind kind, const protocol::SessionRequest& request,
                                             const config::Scenario& scenario);

}  // namespace gatefield::baseline
