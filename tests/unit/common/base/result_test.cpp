#include "common/base/result.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace gatefield {
namespace {

Result<int> parse(const std::string& text) {
  if (text.empty()) return Error{"the text is empty, expected a number"};
  return static_cast<int>(text.size());
}

TEST(Result, HoldsAValue) {
  const Result<int> result = parse("abc");
  ASSERT_TRUE(result.ok());
  EXPECT_TRUE(static_cast<bool>(result));
  EXPECT_EQ(*result, 3);
}

TEST(Result, HoldsTheSentenceThatSaysWhyThereIsNone) {
  const Result<int> result = parse("");
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error(), "the text is empty, expected a number");
}

TEST(Result, GivesAwayWhatCanOnlyBeMoved) {
  Result<std::unique_ptr<int>> result(std::make_unique<int>(5));
  ASSERT_TRUE(result.ok());
  const std::unique_ptr<int> owned = std::move(result).value();
  EXPECT_EQ(*owned, 5);
}

TEST(Result, ValueCanBeChangedInPlace) {
  Result<std::string> result(std::string("a"));
  result.value() += "b";
  EXPECT_EQ(result->size(), 2u);
}

TEST(Status, IsGoodUnlessItHasAnError) {
  EXPECT_TRUE(Status().ok());
  const Status failed = Error{"camera.fx_px is -1, expected a positive focal length"};
  EXPECT_FALSE(failed.ok());
  EXPECT_FALSE(static_cast<bool>(failed));
  EXPECT_EQ(failed.error(), "camera.fx_px is -1, expected a positive focal length");
}

TEST(Status, AnEmptySentenceIsStillAnError) { EXPECT_FALSE(Status(Error{""}).ok()); }

}  // namespace
}  // namespace gatefield
