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

TEST(Error, APlaceStandsBeforeTheSentenceAndInTheFields) {
  const Error error = Error::invalid("gate.inner_half_m", "-1", "more than 0").at("circle.txt", 3, 7);
  EXPECT_EQ(error.message, "circle.txt:3:7: gate.inner_half_m is -1, expected more than 0");
  EXPECT_EQ(error.file, "circle.txt");
  EXPECT_EQ(error.line, 3);
  EXPECT_EQ(error.field, "gate.inner_half_m");
}

TEST(Error, AnExacterPlaceInTheSameFileReplacesTheFirst) {
  const Error error = Error{"speed is 99, expected 0.5 to 50"}.at("c.txt").at("c.txt", 12, 0, "cell 'a': ");
  EXPECT_EQ(error.message, "c.txt:12: cell 'a': speed is 99, expected 0.5 to 50");
}

TEST(Error, APlaceInAnotherFileStaysInTheSentence) {
  const Error error = Error{"mass is -1"}.at("v.txt", 2).at("c.txt", 12);
  EXPECT_EQ(error.message, "c.txt:12: v.txt:2: mass is -1");
  EXPECT_EQ(error.file, "c.txt");
  EXPECT_EQ(error.line, 12);
}

TEST(Error, WithinPutsWordsBeforeTheSentenceAndThePath) {
  const Error error = Error::invalid("scale", "9", "0 to 3").at("n.txt").within("sensor_noise_file: ", "noise.");
  EXPECT_EQ(error.message, "sensor_noise_file: n.txt: scale is 9, expected 0 to 3");
  EXPECT_EQ(error.field, "noise.scale");
  EXPECT_EQ(error.at("s.txt").message, "s.txt: sensor_noise_file: n.txt: scale is 9, expected 0 to 3");
}

}  // namespace
}  // namespace gatefield
