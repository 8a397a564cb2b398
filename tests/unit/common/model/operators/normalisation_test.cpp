#include "common/model/operators/normalisation.h"

#include <gmock/gmock.h>

#include "tests/unit/common/model/graph_answer.h"

// What OpenCV can be asked about, tests/unit/server/perception/learned/encoder_operators_test.cpp compares with it.

namespace gatefield::model {
namespace {

TEST(NormalisingOperators, SoftmaxMeantSomethingElseOnce) {
  const Build softmax = [](auto& b) {
    b.constant("none", {}, {0.0f}).node("Mul", {"x", "none"}, "zero").node("Softmax", {"zero"}, "y").with("axis", 0);
  };
  EXPECT_EQ(answer({2, 2}, softmax, 12), "[2, 2] 0.25 0.25 0.25 0.25");
  EXPECT_EQ(answer({2, 2}, softmax, 13), "[2, 2] 0.5 0.5 0.5 0.5");
}

}  // namespace
}  // namespace gatefield::model
