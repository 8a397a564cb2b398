#include "client/race/tune/search.h"

#include <fmt/format.h>

namespace gatefield::race {
namespace {

constexpr double kOutsideCost = 10.0;

}  // namespace

int candidates_of(const Tune& tune, const Space& space) {
  return tune.candidates.value_or(usual_candidates(space.size()));
}

Search::Search(const Tune& tune, const Space& space)
    : space_(space), cma_es_(space.start(), tune.spread, candidates_of(tune, space), tune.seed) {}

std::vector<ProfileSheet> Search::next() {
  std::vector<ProfileSheet> profiles{space_.profile(space_.start())};
  profiles.front().rename("base");
  for (const Point& point : cma_es_.ask()) {
    profiles.push_back(space_.profile(point));
    profiles.back().rename(fmt::format("c{:02}", profiles.size() - 1));
  }
  return profiles;
}

void Search::take(const std::vector<Score>& scores) {
  Generation generation;
  generation.base = scores.front();
  std::vector<double> costs;
  const std::vector<Point>& points = cma_es_.ask();
  for (std::size_t i = 0; i < points.size(); ++i) {
    generation.candidates.push_back({points[i], scores[i + 1]});
    costs.push_back(kOutsideCost * Space::outside(points[i]) - scores[i + 1].mean);
  }
  cma_es_.tell(costs);
  generation.mean = cma_es_.mean();
  generations_.push_back(std::move(generation));
}

}  // namespace gatefield::race
