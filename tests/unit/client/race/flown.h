#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "client/race/campaign.h"
#include "client/race/trial.h"
#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {

/// A campaign of two cells, all of it flown: what reports are made of.
class Flown : public testing::Test {
 protected:
  Flown() {
    for (const Trial& trial : trials_of(campaign_)) {
      results_.push_back(result_of(trial));
      results_.back().setup = 1;
    }
  }
  Campaign campaign_ = campaign_of(R"(
    title: "Two"
    defaults { scenario: "circle" seeds { first: 5 last: 8 } laps: 1 }
    cell { name: "a" title: "first" speed_m_s: [8, 6] goal { speed_m_s: 6 success_percent: 90 }
           published { who: "Others" speed_m_s: 7 success_percent: 87 } }
    cell { name: "b" speed_m_s: 7 perturbation { position_m: 0.3 } figure: "position" link { each_way_ms: 20 } }
    figure { name: "position" against: POSITION }
  )");
  std::vector<TrialResult> results_;
};

}  // namespace gatefield::race
