#pragma once

#include <vector>

#include "client/race/tune/cma_es.h"
#include "client/race/tune/objective.h"
#include "client/race/tune/profile_sheet.h"
#include "client/race/tune/space.h"
#include "client/race/tune/tune.h"

namespace gatefield::race {

/// A profile that was tried.
struct Candidate {
  Point point;
  Score score;
};

/// One generation, flown. All of it, the base too, flew the same seeds.
struct Generation {
  Score base;
  std::vector<Candidate> candidates;
  Point mean;  ///< of the search after it
};

/// The search itself, apart from flights and files: profiles out, scores in. The same scores give the same profiles,
/// bit by bit, so what was flown is all that has to be kept. Thread-safe: no.
class Search {
 public:
  Search(const Tune& tune, const Space& space);

  /// The profiles of the next generation: the base, named "base", then the candidates "c01", "c02", ...
  std::vector<ProfileSheet> next();
  /// @param scores  of next(), in that order. What is out of the ranges costs its distance to them, squared, times 10.
  void take(const std::vector<Score>& scores);
  const std::vector<Generation>& generations() const noexcept { return generations_; }
  /// What is believed best by now: the search's mean. Not the best that was ever flown: of many, the luckiest looks
  /// best.
  const Point& found() const noexcept { return cma_es_.mean(); }

 private:
  const Space& space_;
  CmaEs cma_es_;
  std::vector<Generation> generations_;
};

/// How many candidates a generation of this search has.
int candidates_of(const Tune& tune, const Space& space);

}  // namespace gatefield::race
