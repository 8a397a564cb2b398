#include "client/race/tune/cma_es.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gatefield::race {
namespace {

/// Narrow, and turned against the axes.
double valley(const Point& x) {
  const double a = x[0] + x[1] - 0.9, b = x[0] - x[1] + 0.3, c = x[2] - 0.4;
  return a * a + 50 * b * b + 5 * c * c;
}
const Point kLowest{0.3, 0.6, 0.4};

std::vector<double> costs_of(const std::vector<Point>& points) {
  std::vector<double> costs;
  for (const Point& x : points) costs.push_back(valley(x));
  return costs;
}

TEST(CmaEs, FindsTheLowestPlaceOfAQuadraticFunction) {
  CmaEs search({0.8, 0.2, 0.9}, 0.2, 8, 1);
  for (int generation = 0; generation < 60; ++generation) search.tell(costs_of(search.ask()));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(search.mean()[i], kLowest[i], 1e-3);
}

TEST(CmaEs, OnlyTheOrderOfTheCostsCounts) {
  CmaEs search({0.8, 0.2, 0.9}, 0.2, 8, 1), other({0.8, 0.2, 0.9}, 0.2, 8, 1);
  for (int generation = 0; generation < 5; ++generation) {
    ASSERT_EQ(search.ask(), other.ask());
    std::vector<double> costs = costs_of(search.ask());
    search.tell(costs);
    for (double& cost : costs) cost = std::exp(cost) - 7.0;
    other.tell(costs);
  }
}

TEST(CmaEs, AskingTwiceChangesNothing) {
  CmaEs search({0.5, 0.5, 0.5}, 0.2, 6, 3), other({0.5, 0.5, 0.5}, 0.2, 6, 3);
  const std::vector<Point> first = search.ask();
  EXPECT_EQ(search.ask(), first);
  EXPECT_EQ(other.ask(), first);
  search.tell(costs_of(first));
  other.tell(costs_of(first));
  EXPECT_EQ(search.ask(), other.ask());
  EXPECT_NE(search.ask(), first);
}

TEST(CmaEs, AnotherSeedDrawsOthersAroundTheSameStart) {
  CmaEs search({0.5, 0.5, 0.5}, 0.1, 100, 1), other({0.5, 0.5, 0.5}, 0.1, 100, 2);
  EXPECT_NE(search.ask(), other.ask());
  EXPECT_EQ(search.mean(), (Point{0.5, 0.5, 0.5})) << "nothing was told yet";
  double sum = 0.0, squares = 0.0;
  for (const Point& point : search.ask())
    for (const double x : point) {
      sum += x - 0.5;
      squares += (x - 0.5) * (x - 0.5);
    }
  EXPECT_NEAR(sum / 300, 0.0, 0.02);
  EXPECT_NEAR(std::sqrt(squares / 300), 0.1, 0.015) << "the spread";
}

TEST(CmaEs, TheMeanIsTheOneThatTheNextGenerationStandsAround) {
  CmaEs search({0.5, 0.5, 0.5}, 0.1, 200, 1);
  search.tell(costs_of(search.ask()));
  Point middle(3, 0.0);
  for (const Point& point : search.ask())
    for (std::size_t i = 0; i < 3; ++i) middle[i] += point[i] / 200;
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(middle[i], search.mean()[i], 0.03);
  EXPECT_GT(std::abs(search.mean()[0] - 0.5) + std::abs(search.mean()[1] - 0.5), 0.04) << "it has moved";
}

TEST(CmaEs, UsualGenerationsGrowWithTheLogarithm) {
  EXPECT_EQ(usual_candidates(1), 5) << "pagmo's least";
  EXPECT_EQ(usual_candidates(8), 10);
  EXPECT_EQ(usual_candidates(13), 11);
}

}  // namespace
}  // namespace gatefield::race
