#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "client/race/tune/space.h"

namespace gatefield::race {

inline constexpr int kMinCandidates = 5;  ///< of a generation, as pagmo wants it

/// How many candidates a generation has when nobody says: 4 + 3 ln(n), rounded down (N. Hansen, "The CMA evolution
/// strategy: a tutorial", 2016, arXiv:1604.00772, eq. 48), and kMinCandidates at least.
int usual_candidates(std::size_t dimensions);

/// Covariance matrix adaptation, a generation at a time: ask() gives points, tell() says what each of them cost, lower
/// is better. Only their order counts, not how much lower. The mathematics is pagmo's (pagmo::cmaes). The same
/// arguments and the same costs give the same points, bit by bit. Thread-safe: no.
class CmaEs {
 public:
  /// @param start   mean of the first generation
  /// @param spread  one sigma of the first generation, in every dimension
  /// @pre !start.empty(), spread > 0, candidates >= kMinCandidates
  CmaEs(const Point& start, double spread, int candidates, std::uint64_t seed);
  ~CmaEs();
  CmaEs(const CmaEs&) = delete;
  CmaEs& operator=(const CmaEs&) = delete;

  /// The next generation; the same again until tell().
  const std::vector<Point>& ask();
  /// @pre a cost for each point of ask(), finite
  void tell(const std::vector<double>& costs);
  /// What the search believes in by now: the weighted mean of the last generation's better half, or the start.
  const Point& mean() const noexcept { return mean_; }

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
  std::vector<Point> asked_;
  Point mean_;
};

}  // namespace gatefield::race
