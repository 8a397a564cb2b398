#include "common/model/operators/matrix.h"

#include <gmock/gmock.h>

#include "tests/unit/common/model/graph_answer.h"

// What OpenCV can be asked about, tests/unit/server/perception/learned/encoder_operators_test.cpp compares with it.

namespace gatefield::model {
namespace {

using testing::HasSubstr;

TEST(MatrixOperators, GemmScalesTransposesAndSpreads) {
  EXPECT_EQ(answer({1, 2},
                   [](auto& b) {
                     b.constant("w", {2, 2}, {1.0f, 2.0f, 3.0f, 4.0f}).constant("c", {1}, {10.0f});
                     b.node("Gemm", {"x", "w", "c"}, "y").with("transB", 1).with_number("alpha", 2.0f);
                     b.with_number("beta", 0.5f);
                   }),
            "[1, 2] 9 13");
}

TEST(MatrixOperators, MatMulSpreadsBatches) {
  EXPECT_EQ(answer({2, 1, 2},
                   [](auto& b) {
                     b.constant("w", {2, 1}, {1.0f, 10.0f}).node("MatMul", {"x", "w"}, "y");
                   }),
            "[2, 1, 1] 10 32");
  EXPECT_THAT(answer({2, 3},
                     [](auto& b) {
                       b.weight("w", {2, 2}).node("MatMul", {"x", "w"}, "y");
                     }),
              HasSubstr("multiplies [2, 3] and [2, 2], which don't fit"));
}

}  // namespace
}  // namespace gatefield::model
