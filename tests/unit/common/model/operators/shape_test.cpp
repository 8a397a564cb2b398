#include "common/model/operators/shape.h"

#include <gmock/gmock.h>

#include "tests/unit/common/model/graph_answer.h"

// What OpenCV can be asked about, tests/unit/server/perception/learned/encoder_operators_test.cpp compares with it.

namespace gatefield::model {
namespace {

using testing::HasSubstr;

TEST(ShapeOperators, Reshapes) {
  const auto reshape = [](const std::vector<std::int64_t>& to) {
    return answer({2, 3}, [=](auto& b) { b.integers("s", to).node("Reshape", {"x", "s"}, "y"); });
  };
  EXPECT_EQ(reshape({3, -1}), "[3, 2] 0 1 2 3 4 5");
  EXPECT_EQ(reshape({0, 1, -1}), "[2, 1, 3] 0 1 2 3 4 5");
  EXPECT_THAT(reshape({4, -1}), HasSubstr("can't make shape [4, 1] of [2, 3]"));
  EXPECT_THAT(reshape({-1, -1}), HasSubstr("leaves two sizes open"));
  EXPECT_THAT(reshape({0, 0, 0}), HasSubstr("takes over a size"));
  EXPECT_THAT(reshape({-7}), HasSubstr("has the size -7"));
  EXPECT_EQ(answer({1, 2, 1}, [](auto& b) { b.node("Squeeze", {"x"}, "y"); }), "[2] 0 1");
  EXPECT_EQ(answer({1, 2, 1}, [](auto& b) { b.integers("a", {-1}).node("Squeeze", {"x", "a"}, "y"); }), "[1, 2] 0 1");
  EXPECT_EQ(
      answer(
          {1, 2, 1}, [](auto& b) { b.node("Squeeze", {"x"}, "y").with("axes", std::vector<std::int64_t>{0}); }, 11),
      "[2, 1] 0 1");
  EXPECT_THAT(answer({1, 2},
                     [](auto& b) {
                       b.integers("a", {1}).node("Squeeze", {"x", "a"}, "y");
                     }),
              HasSubstr("removes dimension 1 of [1, 2]"));
  EXPECT_EQ(answer({2}, [](auto& b) { b.integers("a", {0, -1}).node("Unsqueeze", {"x", "a"}, "y"); }), "[1, 2, 1] 0 1");
}

}  // namespace
}  // namespace gatefield::model
