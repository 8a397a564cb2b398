#include "common/model/operators/pooling.h"

#include <gmock/gmock.h>

#include "tests/unit/common/model/graph_answer.h"

// What OpenCV can be asked about, tests/unit/server/perception/learned/encoder_operators_test.cpp compares with it.

namespace gatefield::model {
namespace {

using testing::HasSubstr;

TEST(PoolingOperators, CountsPaddingWhenAskedToAndRefusesWhatItCannotDo) {
  EXPECT_EQ(answer({1, 1, 2, 2},
                   [](auto& b) {
                     b.node("AveragePool", {"x"}, "y").with("kernel_shape", {2, 2}).with("pads", {0, 0, 1, 1});
                     b.with("strides", {2, 2}).with("count_include_pad", 1);
                   }),
            "[1, 1, 1, 1] 1.5");
  EXPECT_EQ(answer({1, 1, 1, 2},
                   [](auto& b) {
                     b.node("AveragePool", {"x"}, "y").with("kernel_shape", {1, 2}).with("pads", {0, 1, 0, 1});
                     b.with("strides", {1, 3}).with("count_include_pad", 1);
                   }),
            "[1, 1, 1, 1] 0");
  EXPECT_THAT(answer({1, 1, 2, 2},
                     [](auto& b) {
                       b.node("MaxPool", {"x"}, "y").with("kernel_shape", {3, 3});
                     }),
              HasSubstr("kernel larger than its input"));
  EXPECT_THAT(answer({1, 1, 2, 2},
                     [](auto& b) {
                       b.node("MaxPool", {"x"}, "y").with("kernel_shape", {1, 1}).with("pads", {1, 1, 1, 1});
                     }),
              HasSubstr("lies in the padding as a whole"));
  EXPECT_THAT(answer({1, 1, 2, 2},
                     [](auto& b) {
                       b.node("MaxPool", {"x"}, "y").with("kernel_shape", {2, 2}).with("ceil_mode", 1);
                     }),
              HasSubstr("ceil_mode 1, expected 0"));
  EXPECT_THAT(answer({1, 1, 2, 2},
                     [](auto& b) {
                       b.node("MaxPool", {"x"}, "y").with("kernel_shape", {2, 2}).with_word("auto_pad", "SAME_UPPER");
                     }),
              HasSubstr("auto_pad 'SAME_UPPER', expected pads in numbers"));
}

}  // namespace
}  // namespace gatefield::model
