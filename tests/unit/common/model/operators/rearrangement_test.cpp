#include "common/model/operators/rearrangement.h"

#include <gmock/gmock.h>

#include "tests/unit/common/model/graph_answer.h"

// What OpenCV can be asked about, tests/unit/server/perception/learned/encoder_operators_test.cpp compares with it.

namespace gatefield::model {
namespace {

using testing::HasSubstr;

TEST(RearrangingOperators, PicksAndRepeats) {
  EXPECT_EQ(answer({2, 3},
                   [](auto& b) {
                     b.integers("i", {2, 0, -1}).node("Gather", {"x", "i"}, "y").with("axis", 1);
                   }),
            "[2, 3] 2 0 2 5 3 5");
  EXPECT_EQ(answer({2, 3}, [](auto& b) { b.integers("i", {1}, true).node("Gather", {"x", "i"}, "y"); }), "[3] 3 4 5");
  EXPECT_EQ(answer({2, 2},
                   [](auto& b) {
                     b.integers("r", {2, 3}).node("Tile", {"x", "r"}, "y");
                   }),
            "[4, 6] 0 1 0 1 0 1 2 3 2 3 2 3 0 1 0 1 0 1 2 3 2 3 2 3");
  EXPECT_EQ(answer({2, 1},
                   [](auto& b) {
                     b.integers("s", {1, 3}).node("Expand", {"x", "s"}, "y");
                   }),
            "[2, 3] 0 0 0 1 1 1");
  EXPECT_EQ(answer({3},
                   [](auto& b) {
                     b.integers("s", {2, 1}).node("Expand", {"x", "s"}, "y");
                   }),
            "[2, 3] 0 1 2 0 1 2");
}

TEST(RearrangingOperators, IndicesAreIntegers) {
  EXPECT_THAT(answer({2}, [](auto& b) { b.node("Gather", {"x", "x"}, "y"); }), HasSubstr("no integers"));
}

TEST(RearrangingOperators, Slices) {
  const auto slice = [](std::int64_t from, std::int64_t to, std::int64_t step) {
    return answer({5}, [=](auto& b) {
      b.integers("f", {from}).integers("t", {to}).integers("a", {0}).integers("s", {step});
      b.node("Slice", {"x", "f", "t", "a", "s"}, "y");
    });
  };
  constexpr std::int64_t kEnd = INT64_MAX, kBegin = INT64_MIN;
  EXPECT_EQ(slice(1, 4, 1), "[3] 1 2 3");
  EXPECT_EQ(slice(-2, kEnd, 1), "[2] 3 4");
  EXPECT_EQ(slice(0, kEnd, 2), "[3] 0 2 4");
  EXPECT_EQ(slice(kEnd, kBegin, -1), "[5] 4 3 2 1 0");
  EXPECT_EQ(slice(3, 0, -2), "[2] 3 1");
  EXPECT_EQ(slice(3, 3, 1), "[0]");
  EXPECT_EQ(slice(9, 12, 1), "[0]");
  EXPECT_THAT(slice(0, 3, 0), HasSubstr("node 'y' (Slice) has a step of 0"));
}

TEST(RearrangingOperators, Splits) {
  EXPECT_EQ(answer({5},
                   [](auto& b) {
                     b.integers("s", {2, 3}).node("Split", {"x", "s"}, "first").node("first").add_output("y");
                   }),
            "[3] 2 3 4");
  EXPECT_THAT(answer({5}, [](auto& b) { b.node("Split", {"x"}, "y").node("y").add_output("z"); }),
              HasSubstr("into 2 equal parts"));
  EXPECT_THAT(answer({5},
                     [](auto& b) {
                       b.integers("s", {2, 2}).node("Split", {"x", "s"}, "y").node("y").add_output("z");
                     }),
              HasSubstr("[2, 2] for 2 outputs"));
}

}  // namespace
}  // namespace gatefield::model
