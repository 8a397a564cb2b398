#include "server/operations/health.h"

#include "common/base/text.h"

namespace gatefield::operations {

Health health_of(const service::Figures& figures, Stamp now) {
  if (now - figures.made > kHangsAfter)
    return {false, "housekeeping hangs: its newest figures are " + text(seconds(now - figures.made)) +
                       " s old, expected at most " + text(seconds(kHangsAfter)) + "; start the server again"};
  if (now - figures.step_since > kHangsAfter)
    return {false, "a control step hangs: it runs for " + text(seconds(now - figures.step_since)) +
                       " s, expected at most " + text(seconds(kHangsAfter)) + "; start the server again"};
  return {true, "serves " + std::to_string(figures.vehicles.size()) +
                    (figures.vehicles.size() == 1 ? " vehicle" : " vehicles")};
}

}  // namespace gatefield::operations
