#include "common/config/text_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/config/course.pb.h"
#include "common/config/locate.h"
#include "tests/unit/common/config/temporary_file.h"

namespace gatefield::config {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST(TextFile, ReadsValues) {
  const TemporaryFile file("x: 1\ny: -2.5\nz: 3e2  # a comment\n");
  Vector v;
  ASSERT_TRUE(load_text(file.path(), &v).ok());
  EXPECT_EQ(v.x(), 1);
  EXPECT_EQ(v.y(), -2.5);
  EXPECT_EQ(v.z(), 300);
}

TEST(TextFile, UnknownFieldIsNamedWithItsPlaceAndTheKnownOnes) {
  const TemporaryFile file("x: 1\n  height: 2\n");
  Vector v;
  const auto status = load_text(file.path(), &v);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), StartsWith(file.path().string() + ":2:"));
  EXPECT_THAT(status.error(), HasSubstr("unknown field 'height', expected one of: x, y, z"));
  EXPECT_EQ(status.failure().code, ErrorCode::kInvalid);
  EXPECT_EQ(status.failure().field, "height");
  EXPECT_EQ(status.failure().file, file.path().string());
  EXPECT_EQ(status.failure().line, 2);
}

TEST(TextFile, WrongTypeSaysWhatWasExpected) {
  Vector v;
  const auto status = parse_text("x: 1\ny: \"two\"\n", "v.txt", &v);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), StartsWith("v.txt:2:4: "));
  EXPECT_THAT(status.error(), HasSubstr("expected double"));
}

TEST(TextFile, UnknownEnumValueIsNamed) {
  GateSpec gate;
  const auto status = parse_text("opening: TRIANGLE", "gate.txt", &gate);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), StartsWith("gate.txt:1:"));
  EXPECT_THAT(status.error(), HasSubstr("TRIANGLE"));
  EXPECT_THAT(status.error(), HasSubstr("expected"));
}

TEST(TextFile, MissingRequiredFieldIsNamed) {
  Vector v;
  const auto status = parse_text("x: 1\nz: 2", "v.txt", &v);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), HasSubstr("v.txt: required field 'y' is missing"));
  EXPECT_EQ(status.failure().code, ErrorCode::kInvalid);
  EXPECT_EQ(status.failure().field, "y");
  EXPECT_EQ(status.failure().file, "v.txt");
}

TEST(TextFile, CutOffFileNamesItsLastLine) {
  CourseFile course;
  const auto status = parse_text("title: \"x\"\nwaypoint { position { x: 1\n", "cut.txt", &course);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), StartsWith("cut.txt:3:"));
}

TEST(TextFile, BinaryGarbageIsRefused) {
  Vector v;
  const auto status = parse_text(std::string("\x7f\x45\x4c\x46\0\1\2", 7), "program", &v);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), StartsWith("program:1:"));
}

TEST(TextFile, AValidationsPlaceIsTheFile) {
  const Error error = in_file("a/b.txt", Error::invalid("x", "1", "2"));
  EXPECT_EQ(error.message, "a/b.txt: x is 1, expected 2");
  EXPECT_EQ(error.file, "a/b.txt");
  EXPECT_EQ(in_file("a/b.txt", Error{"twice"}.at("a/b.txt", 3)).message, "a/b.txt:3: twice");
}

TEST(TextFile, DeepNestingIsRefusedInsteadOfUsingUpTheStack) {
  CourseFile course;
  std::string text;
  for (int i = 0; i < 100000; ++i) text += "waypoint { ";
  EXPECT_FALSE(parse_text(text, "deep.txt", &course).ok());
}

TEST(TextFile, MissingFileAndFolderAreTold) {
  Vector v;
  EXPECT_THAT(load_text("/nowhere/at-all.txt", &v).error(), HasSubstr("/nowhere/at-all.txt: does not exist"));
  EXPECT_THAT(load_text("/tmp", &v).error(), HasSubstr("/tmp: is a folder"));
  EXPECT_EQ(load_text("/tmp", &v).failure().code, ErrorCode::kUnreadable);
  EXPECT_EQ(load_text("/tmp", &v).failure().file, "/tmp");
}

TEST(Locate, FindsShippedNamesAndListsThemWhenTheNameIsWrong) {
  const auto found = find_config("courses", "circle");
  ASSERT_TRUE(found.ok()) << found.error();
  EXPECT_EQ(found->filename(), "circle.txt");
  const auto missing = find_config("courses", "no-such-course");
  ASSERT_FALSE(missing.ok());
  EXPECT_THAT(missing.error(), HasSubstr("'no-such-course'"));
  EXPECT_THAT(missing.error(), HasSubstr("circle"));
  EXPECT_EQ(missing.failure().code, ErrorCode::kUnknownName);
}

TEST(Locate, TakesAPathRelativeToTheFileThatNamesIt) {
  const TemporaryFile file("", "own.txt");
  const auto found = find_config("courses", "own.txt", file.path().parent_path());
  ASSERT_TRUE(found.ok()) << found.error();
  EXPECT_TRUE(std::filesystem::equivalent(*found, file.path()));
  EXPECT_FALSE(find_config("courses", "own.txt").ok());
}

}  // namespace
}  // namespace gatefield::config
