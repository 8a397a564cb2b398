#include "client/race/tune/cma_es.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <utility>

#include "common/base/random.h"

namespace gatefield::race {
namespace {

/// What passes between pagmo, which evaluates one point after the other, and a generation that is flown at once.
struct Exchange {
  std::vector<Point> points;    ///< that pagmo has asked for
  std::vector<double> answers;  ///< for them, in their order; none: nothing is known yet
};

struct FlownElsewhere {
  std::shared_ptr<Exchange> exchange = std::make_shared<Exchange>();
  std::size_t dimensions = 1;

  pagmo::vector_double fitness(const pagmo::vector_double& point) const {
    const std::size_t at = exchange->points.size();
    exchange->points.push_back(point);
    return {exchange->answers.empty() ? 0.0 : exchange->answers.at(at)};
  }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {pagmo::vector_double(dimensions, 0.0), pagmo::vector_double(dimensions, 1.0)};
  }
};

constexpr double kOwnRate = -1.0;     // pagmo finds this rate of adaptation itself
constexpr double kNoTolerance = 0.0;  // the budget ends the search, nothing else

pagmo::cmaes algorithm(double spread, std::uint64_t seed) {
  const auto key = static_cast<unsigned>(stream_key(seed, Stream("gatefield.tune.search")));
  return {1, kOwnRate, kOwnRate, kOwnRate, kOwnRate, spread, kNoTolerance, kNoTolerance, true, false, key};
}

}  // namespace

struct CmaEs::Inside {
  Inside(const Point& start, double spread, int candidates, std::uint64_t seed)
      : population(pagmo::problem(FlownElsewhere{exchange, start.size()}), 0u, 0u), search(algorithm(spread, seed)) {
    // The first mean is the best of them.
    for (int i = 0; i < candidates; ++i) population.push_back(start, {0.0});
  }
  std::shared_ptr<Exchange> exchange = std::make_shared<Exchange>();
  pagmo::population population;
  pagmo::cmaes search;
};

int usual_candidates(std::size_t dimensions) {
  return std::max(kMinCandidates, 4 + static_cast<int>(3.0 * std::log(static_cast<double>(dimensions))));
}

CmaEs::CmaEs(const Point& start, double spread, int candidates, std::uint64_t seed)
    : inside_(std::make_unique<Inside>(start, spread, candidates, seed)), mean_(start) {}
CmaEs::~CmaEs() = default;

const std::vector<Point>& CmaEs::ask() {
  if (!asked_.empty()) return asked_;
  // A generation on a copy, whose answers nobody takes: the copy's draws are those that the search itself will make.
  inside_->exchange->points.clear();
  inside_->exchange->answers.clear();
  const pagmo::cmaes rehearsal = inside_->search;
  rehearsal.evolve(inside_->population);
  asked_ = inside_->exchange->points;
  return asked_;
}

void CmaEs::tell(const std::vector<double>& costs) {
  assert(costs.size() == asked_.size());
  inside_->exchange->points.clear();
  inside_->exchange->answers = costs;
  inside_->population = inside_->search.evolve(inside_->population);
  assert(inside_->exchange->points == asked_);

  // pagmo keeps its mean to itself; it is this one (weights as in Hansen's tutorial, eq. 49).
  std::vector<std::size_t> order(costs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return costs[a] < costs[b]; });
  const std::size_t better = costs.size() / 2;
  std::fill(mean_.begin(), mean_.end(), 0.0);
  double sum = 0.0;
  for (std::size_t i = 0; i < better; ++i) {
    const double weight = std::log(static_cast<double>(better) + 0.5) - std::log(static_cast<double>(i) + 1.0);
    sum += weight;
    for (std::size_t k = 0; k < mean_.size(); ++k) mean_[k] += weight * asked_[order[i]][k];
  }
  for (double& x : mean_) x /= sum;
  asked_.clear();
}

}  // namespace gatefield::race
