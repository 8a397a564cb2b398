#include "common/config/frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/config/course.h"
#include "tests/unit/common/config/temporary_file.h"

namespace gatefield::config {
namespace {

using testing::HasSubstr;

SavedFrame example() {
  SavedFrame frame;
  frame.depth_file = "depth.png";
  frame.camera = default_camera();
  frame.X_WC = Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized());
  frame.gate = SavedFrame::TrueGate{gate_pose({4, 5, 1.5}, Eigen::Vector3d(1, 1, 0).normalized()), GateShape{}};
  frame.gate->shape.opening = GateShape::Opening::kRound;
  frame.time_s = 2.5;
  return frame;
}

TEST(SavedFrame, ReadsBackAsWritten) {
  const SavedFrame frame = example();
  const TemporaryFile file(frame_text(frame), "frame.txt");
  const auto read = load_frame(file.path());
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(read->depth_file, file.path().parent_path() / "depth.png");
  EXPECT_TRUE(read->X_WC.isApprox(frame.X_WC, 1e-12));
  EXPECT_EQ(read->camera.fx_px, frame.camera.fx_px);
  EXPECT_EQ(read->camera.max_depth_m, frame.camera.max_depth_m);
  ASSERT_TRUE(read->gate);
  EXPECT_TRUE(read->gate->X_WG.isApprox(frame.gate->X_WG, 1e-12));
  EXPECT_EQ(read->gate->shape.opening, GateShape::Opening::kRound);
  EXPECT_EQ(read->time_s, 2.5);
}

TEST(SavedFrame, WithoutAGateThereIsNone) {
  SavedFrame frame = example();
  frame.gate.reset();
  const TemporaryFile file(frame_text(frame));
  const auto read = load_frame(file.path());
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_FALSE(read->gate);
}

TEST(SavedFrame, WrongValuesAreNamed) {
  const auto error_of = [](const SavedFrame& frame) {
    const TemporaryFile file(frame_text(frame), "frame.txt");
    const auto read = load_frame(file.path());
    return read ? std::string("accepted") : read.error();
  };
  SavedFrame flat = example();
  flat.camera.height_px = 2;
  EXPECT_THAT(error_of(flat), HasSubstr("frame.txt: camera.height_px is 2"));
  const std::string text = frame_text(example());
  const TemporaryFile scaled(replaced(text, "qw: ", "qw: 1"), "frame.txt");
  EXPECT_THAT(load_frame(scaled.path()).error(), HasSubstr("frame.txt: camera_pose has a quaternion of length"));
}

}  // namespace
}  // namespace gatefield::config
