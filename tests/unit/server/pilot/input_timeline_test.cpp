#include "server/pilot/input_timeline.h"

#include <gtest/gtest.h>

#include <vector>

namespace gatefield::pilot {
namespace {

using protocol::AskedBy;
using namespace std::chrono_literals;

std::vector<PlainVector4> plan_of(std::initializer_list<double> rates) {
  std::vector<PlainVector4> plan;
  for (const double rate : rates) plan.emplace_back(PlainVector4::Constant(rate));
  return plan;
}

struct Span {
  double rate;
  Stamp from;
  Stamp to;
  bool operator==(const Span&) const = default;
};
void PrintTo(const Span& span, std::ostream* out) {
  *out << span.rate << " from " << span.from.count() << " to " << span.to.count() << " ns";
}

std::vector<Span> visited(const InputTimeline& inputs, Stamp from, Stamp to) {
  std::vector<Span> spans;
  inputs.visit(from, to, [&](const PlainVector4& rates, Stamp begin, Stamp end) {
    spans.push_back({rates[0], begin, end});
  });
  return spans;
}

TEST(InputTimeline, NothingSentMeansThrustsStay) {
  const InputTimeline inputs;
  EXPECT_EQ(visited(inputs, 5ms, 25ms), (std::vector<Span>{{0, 5ms, 25ms}}));
}

TEST(InputTimeline, ANewerPlanCutsTheOlderOneOff) {
  InputTimeline inputs;
  inputs.add(100ms, 30ms, plan_of({1, 2, 3}), 90ms);
  inputs.add(120ms, 30ms, plan_of({4, 5, 6}), 90ms);
  EXPECT_EQ(visited(inputs, 90ms, 250ms), (std::vector<Span>{{0, 90ms, 100ms},
                                                             {1, 100ms, 120ms},
                                                             {4, 120ms, 150ms},
                                                             {5, 150ms, 180ms},
                                                             {6, 180ms, 210ms},
                                                             {0, 210ms, 250ms}}));
  EXPECT_EQ(visited(inputs, 130ms, 140ms), (std::vector<Span>{{4, 130ms, 140ms}}));
}

TEST(InputTimeline, AnEarlierStartReplacesWhatWasToCome) {
  InputTimeline inputs;
  inputs.add(100ms, 30ms, plan_of({1, 2, 3}), 90ms);
  inputs.add(90ms, 30ms, plan_of({7}), 30ms);
  EXPECT_EQ(visited(inputs, 90ms, 130ms), (std::vector<Span>{{7, 90ms, 120ms}, {0, 120ms, 130ms}}));
}

TEST(InputTimeline, EndsWithTheValidity) {
  InputTimeline inputs;
  inputs.add(0ms, 30ms, plan_of({1, 2, 3}), 40ms);
  EXPECT_EQ(visited(inputs, 0ms, 60ms), (std::vector<Span>{{1, 0ms, 30ms}, {2, 30ms, 40ms}, {0, 40ms, 60ms}}));
}

TEST(InputTimeline, NothingHoldsBeforeTheFirstPlanArrived) {
  InputTimeline inputs;
  inputs.add(0ms, 30ms, plan_of({1, 2, 3, 4}), 400ms);
  inputs.begin_at(70ms);
  EXPECT_EQ(visited(inputs, 20ms, 110ms), (std::vector<Span>{{0, 20ms, 70ms}, {3, 70ms, 90ms}, {4, 90ms, 110ms}}));
}

TEST(InputTimeline, ForgetsTheOldestWhenFull) {
  InputTimeline inputs;
  for (int i = 0; i < 5000; ++i) inputs.add(i * 2ms, 30ms, plan_of({1.0 * i, 0, 0}), 90ms);
  EXPECT_EQ(visited(inputs, 9990ms, 9994ms), (std::vector<Span>{{4995, 9990ms, 9992ms}, {4996, 9992ms, 9994ms}}));
  EXPECT_EQ(visited(inputs, 9000ms, 9002ms), (std::vector<Span>{{4500, 9000ms, 9002ms}}));
  EXPECT_EQ(visited(inputs, 0ms, 2ms), (std::vector<Span>{{0, 0ms, 2ms}}));
}

/// Told by a state at `stamp`, the one before which was at `last`.
void tell(InputTimeline* inputs, Stamp last, Stamp stamp, AskedBy by, double value = 0.0) {
  inputs->tell(last, stamp, {by, PlainVector4::Constant(value)});
}

/// Plans all the way: 1, 2, 3, .. each for 30 ms.
InputTimeline planned() {
  InputTimeline inputs;
  inputs.add(0ms, 30ms, plan_of({1, 2, 3, 4, 5, 6, 7, 8}), 400ms);
  return inputs;
}

TEST(ToldInputs, WhatIsToldHoldsFromHalfWayBetweenTwoStatesUntilToldOtherwise) {
  InputTimeline inputs = planned();
  tell(&inputs, 0ms, 20ms, AskedBy::kPlans);
  tell(&inputs, 20ms, 40ms, AskedBy::kOther, 9);
  EXPECT_EQ(visited(inputs, 20ms, 200ms), (std::vector<Span>{{1, 20ms, 30ms}, {9, 30ms, 200ms}}));
  tell(&inputs, 40ms, 60ms, AskedBy::kOther, 8);
  EXPECT_EQ(visited(inputs, 40ms, 200ms), (std::vector<Span>{{9, 40ms, 50ms}, {8, 50ms, 200ms}}));
  tell(&inputs, 60ms, 100ms, AskedBy::kPlans);
  EXPECT_EQ(visited(inputs, 60ms, 110ms), (std::vector<Span>{{8, 60ms, 80ms}, {3, 80ms, 90ms}, {4, 90ms, 110ms}}));
}

TEST(ToldInputs, APlanThatIsSentMeanwhileDoesNotHold) {
  InputTimeline inputs = planned();
  tell(&inputs, 20ms, 40ms, AskedBy::kOther, 9);
  inputs.add(50ms, 30ms, plan_of({11, 12, 13}), 90ms);
  EXPECT_EQ(visited(inputs, 40ms, 100ms), (std::vector<Span>{{9, 40ms, 100ms}}));
}

TEST(ToldInputs, AFallbackEndsWhereAPlanBeginsThatWasSentSince) {
  InputTimeline inputs = planned();
  tell(&inputs, 20ms, 40ms, AskedBy::kFallback, 9);
  EXPECT_EQ(visited(inputs, 40ms, 100ms), (std::vector<Span>{{9, 40ms, 100ms}}));
  inputs.add(60ms, 30ms, plan_of({11, 12, 13}), 90ms);
  inputs.add(80ms, 30ms, plan_of({21, 22, 23}), 90ms);
  EXPECT_EQ(visited(inputs, 40ms, 100ms), (std::vector<Span>{{9, 40ms, 60ms}, {11, 60ms, 80ms}, {21, 80ms, 100ms}}));
  // It was not heard: on with the fallback, until the next one.
  tell(&inputs, 40ms, 70ms, AskedBy::kFallback, 8);
  EXPECT_EQ(visited(inputs, 70ms, 100ms), (std::vector<Span>{{8, 70ms, 100ms}}));
  inputs.add(100ms, 30ms, plan_of({31}), 30ms);
  EXPECT_EQ(visited(inputs, 70ms, 120ms), (std::vector<Span>{{8, 70ms, 100ms}, {31, 100ms, 120ms}}));
}

TEST(ToldInputs, OfWhatNobodyKnowsNothingChanges) {
  InputTimeline inputs = planned();
  tell(&inputs, 20ms, 40ms, AskedBy::kUnknown, 9);
  EXPECT_EQ(visited(inputs, 40ms, 100ms), (std::vector<Span>{{0, 40ms, 100ms}}));
}

TEST(ToldInputs, AreKnownWherePlansCoverThemOrTheyWereTold) {
  InputTimeline inputs = planned();
  EXPECT_TRUE(inputs.covers(20ms, 40ms));
  EXPECT_FALSE(inputs.covers(20ms, 300ms));
  tell(&inputs, 20ms, 40ms, AskedBy::kPlans);
  EXPECT_TRUE(inputs.covers(20ms, 40ms));
  tell(&inputs, 40ms, 60ms, AskedBy::kOther, 9);
  EXPECT_FALSE(inputs.covers(40ms, 60ms)) << "when it changed hands is not known";
  EXPECT_TRUE(inputs.covers(60ms, 900ms));
  tell(&inputs, 60ms, 80ms, AskedBy::kOther, 8);
  EXPECT_TRUE(inputs.covers(60ms, 80ms));
  tell(&inputs, 80ms, 100ms, AskedBy::kUnknown);
  EXPECT_FALSE(inputs.covers(80ms, 100ms));
  tell(&inputs, 100ms, 120ms, AskedBy::kUnknown);
  EXPECT_FALSE(inputs.covers(100ms, 120ms));
}

TEST(ToldInputs, ComeBackAsTheyWereWrittenDown) {
  InputTimeline inputs = planned();
  tell(&inputs, 20ms, 40ms, AskedBy::kFallback, 9);
  inputs.add(60ms, 30ms, plan_of({11, 12, 13}), 90ms);
  InputTimeline other;
  ASSERT_TRUE(other.restore(inputs.pieces(40ms)));
  other.restore(inputs.told());
  EXPECT_EQ(visited(other, 40ms, 100ms), visited(inputs, 40ms, 100ms));
}

}  // namespace
}  // namespace gatefield::pilot
