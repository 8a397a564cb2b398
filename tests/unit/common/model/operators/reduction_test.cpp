#include "common/model/operators/reduction.h"

#include <gmock/gmock.h>

#include "tests/unit/common/model/graph_answer.h"

// What OpenCV can be asked about, tests/unit/server/perception/learned/encoder_operators_test.cpp compares with it.

namespace gatefield::model {
namespace {

TEST(ReducingOperators, Reduces) {
  EXPECT_EQ(answer({2, 3}, [](auto& b) { b.integers("a", {1}).node("ReduceSum", {"x", "a"}, "y"); }), "[2, 1] 3 12");
  EXPECT_EQ(answer({2, 3}, [](auto& b) { b.node("ReduceSum", {"x"}, "y").with("keepdims", 0); }), "[] 15");
  EXPECT_EQ(answer({2, 3}, [](auto& b) { b.node("ReduceSum", {"x"}, "y").with("noop_with_empty_axes", 1); }),
            "[2, 3] 0 1 2 3 4 5");
}

}  // namespace
}  // namespace gatefield::model
