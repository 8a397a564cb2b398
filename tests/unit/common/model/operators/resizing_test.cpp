#include "common/model/operators/resizing.h"

#include <gmock/gmock.h>

#include "tests/unit/common/model/graph_answer.h"

// What OpenCV can be asked about, tests/unit/server/perception/learned/encoder_operators_test.cpp compares with it.

namespace gatefield::model {
namespace {

using testing::HasSubstr;

TEST(ResizingOperators, ResizesToTheNearest) {
  const auto resize = [](const std::string& rounding, const std::string& where) {
    return answer({2}, [=](auto& b) {
      b.constant("s", {1}, {2.5f}).node("Resize", {"x", "", "s"}, "y").with_word("nearest_mode", rounding);
      b.with_word("coordinate_transformation_mode", where);
    });
  };
  EXPECT_EQ(resize("floor", "asymmetric"), "[5] 0 0 0 1 1");  // 0, .4, .8, 1.2, 1.6
  EXPECT_EQ(resize("ceil", "asymmetric"), "[5] 0 1 1 1 1");
  EXPECT_EQ(resize("round_prefer_floor", "half_pixel"), "[5] 0 0 0 1 1");  // -.3, .1, .5, .9, 1.3
  EXPECT_EQ(resize("round_prefer_ceil", "half_pixel"), "[5] 0 0 1 1 1");
  EXPECT_EQ(resize("floor", "align_corners"), "[5] 0 0 0 0 1");
  EXPECT_THAT(resize("floor", "tf_crop_and_resize"), HasSubstr("tf_crop_and_resize"));
  EXPECT_THAT(answer({2},
                     [](auto& b) {
                       b.constant("s", {1}, {-1.0f}).node("Resize", {"x", "", "s"}, "y");
                     }),
              HasSubstr("enlarges by -1"));
}

}  // namespace
}  // namespace gatefield::model
