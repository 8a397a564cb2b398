#include "common/model/operators/convolution.h"

#include <gmock/gmock.h>

#include "tests/unit/common/model/graph_answer.h"

// What OpenCV can be asked about, tests/unit/server/perception/learned/encoder_operators_test.cpp compares with it.

namespace gatefield::model {
namespace {

using testing::HasSubstr;

TEST(ConvolutionOperators, SumWeightsTimesPlacesAndPaddingIsZero) {
  EXPECT_EQ(answer({1, 1, 2, 2},
                   [](auto& b) {
                     b.constant("w", {1, 1, 1, 3}, {1.0f, 10.0f, 100.0f}).constant("o", {1}, {1000.0f});
                     b.node("Conv", {"x", "w", "o"}, "y").with("pads", {0, 1, 0, 1});
                   }),
            "[1, 1, 2, 2] 1100 1010 1320 1032");
}

TEST(ConvolutionOperators, RefuseWeightsThatDoNotFit) {
  EXPECT_THAT(answer({1, 2, 2, 2},
                     [](auto& b) {
                       b.weight("w", {1, 1, 1, 1}).node("Conv", {"x", "w"}, "y");
                     }),
              HasSubstr("has weights of shape [1, 1, 1, 1] and group 1 for an input of shape [1, 2, 2, 2]"));
  EXPECT_THAT(answer({1, 1, 2, 2},
                     [](auto& b) {
                       b.weight("w", {1, 1, 1, 1}).node("Conv", {"x", "w"}, "y").with("kernel_shape", {2, 1});
                     }),
              HasSubstr("says kernel_shape [2, 1]"));
}

}  // namespace
}  // namespace gatefield::model
