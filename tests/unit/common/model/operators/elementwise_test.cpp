#include "common/model/operators/elementwise.h"

#include <gmock/gmock.h>

#include "tests/unit/common/model/graph_answer.h"

// What OpenCV can be asked about, tests/unit/server/perception/learned/encoder_operators_test.cpp compares with it.

namespace gatefield::model {
namespace {

using testing::HasSubstr;

TEST(ElementwiseOperators, ChoosesByAnotherArray) {
  EXPECT_EQ(answer({3},
                   [](auto& b) {
                     b.constant("one", {}, {1.0f}).node("Equal", {"x", "one"}, "e").constant("c", {1}, {7.0f});
                     b.node("Where", {"e", "c", "x"}, "y");
                   }),
            "[3] 0 7 2");
}

TEST(ElementwiseOperators, ClipsAndComparesWithSpreadBounds) {
  EXPECT_EQ(answer({4}, [](auto& b) { b.constant("h", {}, {2.0f}).node("Clip", {"x", "", "h"}, "y"); }), "[4] 0 1 2 2");
  EXPECT_EQ(answer({4}, [](auto& b) { b.constant("l", {}, {2.0f}).node("Max", {"x", "l"}, "y"); }), "[4] 2 2 2 3");
  EXPECT_EQ(answer({4}, [](auto& b) { b.constant("l", {}, {2.0f}).node("Min", {"x", "l"}, "y"); }), "[4] 0 1 2 2");
}

TEST(ElementwiseOperators, KnowsIntegers) {
  EXPECT_EQ(answer({7, 2},
                   [](auto& b) {
                     b.node("Shape", {"x"}, "s").integers("two", {2}, true).node("Div", {"s", "two"}, "y");
                   }),
            "[2] 3 1");
  EXPECT_EQ(answer({3},
                   [](auto& b) {
                     b.constant("h", {}, {0.6f}).node("Mul", {"x", "h"}, "m").node("Cast", {"m"}, "y").with("to", 7);
                   }),
            "[3] 0 0 1");
  EXPECT_THAT(answer({2},
                     [](auto& b) {
                       b.node("Shape", {"x"}, "s").integers("none", {0}, true).node("Div", {"s", "none"}, "y");
                     }),
              HasSubstr("divides an integer by zero"));
}

}  // namespace
}  // namespace gatefield::model
