#include "server/training/data/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "common/scene/depth_camera.h"
#include "server/training/data/contact_sheet.h"
#include "server/training/data/example_recording.h"

namespace gatefield::training {
namespace {

using testing::AllOf;
using testing::HasSubstr;
namespace fs = std::filesystem;

class ImportTest : public testing::Test {
 protected:
  ImportTest() {
    folder_ = fs::temp_directory_path() / ("gatefield_import_" + std::to_string(::getpid()) + "_" +
                                           testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
  }
  ~ImportTest() override { fs::remove_all(folder_); }

  fs::path recording() const { return folder_ / "recording"; }
  fs::path file() const { return folder_ / "set.h5"; }

  std::string text_of(const char* name) const {
    std::ifstream in(recording() / name);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }
  void set_text(const char* name, const std::string& text) const {
    std::ofstream(recording() / name, std::ios::trunc) << text;
  }
  /// Replaces the first `from` after the header line.
  void change(const char* name, const std::string& from, const std::string& to) const {
    std::string text = text_of(name);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    set_text(name, text);
  }
  std::string error() const {
    const auto imported = import_recordings(file(), {.recordings = {recording()}, .note = ""});
    EXPECT_FALSE(imported.ok());
    EXPECT_FALSE(fs::exists(file()));
    return imported.ok() ? "" : imported.error();
  }

  fs::path folder_;
};

TEST_F(ImportTest, GivesTheLabelsAndImagesOfTheRenderedFrames) {
  ASSERT_TRUE(write_example_recording(recording(), 12).ok());
  const auto imported = import_recordings(file(), {.recordings = {recording(), recording()}, .note = "twice"});
  ASSERT_TRUE(imported.ok()) << imported.error();
  EXPECT_EQ(imported->frames, 24u);
  EXPECT_GT(imported->with_valid_gate, 20u);
  EXPECT_GT(imported->returns, 0.4);

  const auto dataset = Dataset::open(file());
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  EXPECT_EQ(dataset->kind(), DatasetKind::kRecording);
  EXPECT_EQ(dataset->info().note, "twice");
  ASSERT_EQ(dataset->size(), 24u);
  int both = 0;
  for (std::uint64_t i = 0; i < 24; ++i) {
    const SampleView view = dataset->at(i);
    ASSERT_TRUE(view.X_WC && view.sequence && view.time_s);
    EXPECT_EQ(*view.sequence, i / 12);
    EXPECT_NEAR(*view.time_s, static_cast<double>(i % 12) / 60.0, 1e-6);
    ASSERT_EQ(view.gate_count, 2);

    // The same gates, rendered for the data sets' own camera from the pose that was recorded.
    scene::World world;
    world.floor_z_m = 0.0;
    for (int g = 0; g < 2; ++g) {
      scene::Gate gate;
      gate.X_WG = (*view.X_WC * view.gates[static_cast<std::size_t>(g)].X_CG()).cast<double>();
      gate.shape = view.gates[static_cast<std::size_t>(g)].shape;
      world.gates.push_back(gate);
    }
    std::ranges::sort(world.gates, {}, [](const scene::Gate& gate) { return gate.X_WG.translation().x(); });
    EXPECT_TRUE(world.gates[0].X_WG.translation().isApprox(Eigen::Vector3d(5.0, 0.3, 1.4), 1e-5));
    EXPECT_TRUE(world.gates[1].X_WG.translation().isApprox(Eigen::Vector3d(9.0, -1.4, 1.6), 1e-5));
    EXPECT_NEAR(std::atan2(world.gates[0].X_WG.linear()(1, 0), world.gates[0].X_WG.linear()(0, 0)), 0.35, 1e-5);
    EXPECT_NEAR(std::atan2(world.gates[1].X_WG.linear()(1, 0), world.gates[1].X_WG.linear()(0, 0)), -0.6, 1e-5);
    scene::Box wall;
    wall.X_WO.translation() = Eigen::Vector3d(13.0, 0.0, 2.0);
    wall.half_m = Eigen::Vector3d(0.1, 8.0, 2.0);
    world.boxes.push_back(wall);
    scene::DepthImage image;
    scene::DepthCamera(world).render(dataset_camera(), view.X_WC->cast<double>(), &image);
    std::size_t near = 0;
    for (std::size_t k = 0; k < kImageSize_px; ++k) {
      // The nearest of the recorded pixels is up to half of one off, which matters most where the floor is far.
      const float tolerance_m = 0.02f + 0.02f * image.depth_m[k];
      near += std::abs(image.depth_m[k] - 0.001f * static_cast<float>(view.measured_mm[k])) < tolerance_m ? 1 : 0;
    }
    EXPECT_GT(near, 0.97 * kImageSize_px) << "frame " << i;  // the rest lies at edges
    both += view.valid_count == 2 ? 1 : 0;
    std::vector<std::uint16_t> rendered_mm(kImageSize_px);
    std::ranges::transform(image.depth_m, rendered_mm.begin(),
                           [](float z) { return static_cast<std::uint16_t>(z * 1000.0f + 0.5f); });
    for (std::size_t g = 0; g < 2; ++g) {
      const GateLabel& gate = view.gates[g];
      EXPECT_NEAR(gate.visible_fraction, visible_fraction(dataset_camera(), rendered_mm, gate.shape, gate.X_CG()), 0.1);
    }
  }
  EXPECT_GT(both, 4);
  EXPECT_TRUE(write_contact_sheet(*dataset, 8, {}, folder_ / "sheet.png").ok());
  EXPECT_GT(fs::file_size(folder_ / "sheet.png"), 5'000u);
}

TEST_F(ImportTest, AnotherConventionForPixelCentresAndDepthUnits) {
  ASSERT_TRUE(write_example_recording(recording(), 2).ok());
  ASSERT_TRUE(import_recordings(file(), {.recordings = {recording()}, .note = ""}).ok());
  const auto plain = Dataset::open(file());
  // cx and cy as OpenCV counts, and images in tenths of a millimetre.
  std::string text = text_of("camera.txt");
  text = text.substr(0, text.find("cx_px")) + "cx_px = 211.5\ncy_px: 119.5 # OpenCV\npixel_center 0\n" +
         "depth_unit_m 0.0001\n";
  set_text("camera.txt", text);
  for (const char* name : {"depth/000000.png", "depth/000001.png"}) {
    cv::Mat image = cv::imread((recording() / name).string(), cv::IMREAD_UNCHANGED);
    for (int v = 0; v < image.rows; ++v) {
      for (int u = 0; u < image.cols; ++u) {
        auto& z = image.at<std::uint16_t>(v, u);
        z = z > 6500 ? 0 : static_cast<std::uint16_t>(10 * z);
      }
    }
    ASSERT_TRUE(cv::imwrite((recording() / name).string(), image));
  }
  const auto imported = import_recordings(folder_ / "other.h5", {.recordings = {recording()}, .note = ""});
  ASSERT_TRUE(imported.ok()) << imported.error();
  const auto other = Dataset::open(folder_ / "other.h5");
  const SampleView a = plain->at(1);
  const SampleView b = other->at(1);
  for (std::size_t k = 0; k < kImageSize_px; ++k) {
    ASSERT_EQ(b.measured_mm[k], a.measured_mm[k] > 6500 ? 0 : a.measured_mm[k]) << k;
  }
}

TEST_F(ImportTest, KeepsTheFourGatesThatAreSeenBest) {
  ASSERT_TRUE(write_example_recording(recording(), 3).ok());
  std::string gates = text_of("gates.csv");
  for (const char* behind : {"-3,0,1.4", "-4,0,1.4", "-5,0,1.4", "-6,0,1.4"})
    gates += std::string(behind) + ",1,0,0,0,0.5,0.75,0.06,round\n";
  set_text("gates.csv", gates);
  ASSERT_TRUE(import_recordings(file(), {.recordings = {recording()}, .note = ""}).ok());
  const auto dataset = Dataset::open(file());
  const SampleView view = dataset->at(0);
  ASSERT_EQ(view.gate_count, 4);
  EXPECT_GE(view.valid_count, 1);
  for (int g = 0; g < view.valid_count; ++g) EXPECT_GT(view.gates[static_cast<std::size_t>(g)].p_CG.z(), 0.0f);
  EXPECT_EQ(view.gates[3].shape.opening, GateShape::Opening::kRound);
}

TEST_F(ImportTest, SaysWhatIsWrongAndWhere) {
  const auto fresh = [&] {
    fs::remove_all(recording());
    ASSERT_TRUE(write_example_recording(recording(), 3).ok());
  };
  fs::create_directories(folder_);
  EXPECT_THAT(error(), HasSubstr("is not a folder"));
  fresh();
  fs::remove(recording() / "gates.csv");
  EXPECT_THAT(error(), HasSubstr("gates.csv can't be opened"));
  fresh();
  change("camera.txt", "fx_px", "focal");
  EXPECT_THAT(error(), AllOf(HasSubstr("camera.txt line 4"), HasSubstr("'focal' is not known")));
  fresh();
  change("camera.txt", "width_px 424", "width_px wide");
  EXPECT_THAT(error(), HasSubstr("camera.txt line 2: width_px is 'wide', expected a number"));
  fresh();
  change("camera.txt", "height_px 240\n", "");
  EXPECT_THAT(error(), HasSubstr("camera.txt: height_px is missing"));
  fresh();
  change("camera.txt", "width_px 424", "width_px 320");
  EXPECT_THAT(error(),
              AllOf(HasSubstr("poses.csv line 2"), HasSubstr("000000.png is 424 x 240 pixels, expected 320 x 240")));
  fresh();
  change("camera.txt", "cx_px 212", "cx_px 636");  // of the image before it was decimated
  EXPECT_THAT(error(), AllOf(HasSubstr("camera.txt"), HasSubstr("cx_px is 636, expected 0 to 424")));
  fresh();
  change("poses.csv", "q_WC_w", "qw");
  EXPECT_THAT(error(), HasSubstr("poses.csv line 1: column 'q_WC_w' is missing"));
  fresh();
  change("poses.csv", "0.016667", "0.016667,1");
  EXPECT_THAT(error(), HasSubstr("poses.csv line 3: has 10 values, expected 9"));
  fresh();
  change("poses.csv", "0.016667", "soon");
  EXPECT_THAT(error(), HasSubstr("poses.csv line 3: time_s is 'soon', expected a number"));
  fresh();
  change("poses.csv", "0.033333", "0.01");
  EXPECT_THAT(error(), AllOf(HasSubstr("poses.csv line 4"), HasSubstr("expected more than the 0.016667")));
  fresh();
  change("poses.csv", "000001.png", "000007.png");
  EXPECT_THAT(error(), AllOf(HasSubstr("poses.csv line 3"), HasSubstr("000007.png is not there")));
  fresh();
  change("gates.csv", "\n5,", "\nnan,");
  EXPECT_THAT(error(), HasSubstr("gates.csv line 2: p_WG_x is 'nan', expected a number"));
  fresh();
  change("gates.csv", "0,0,0.1", "0,0,0.9");
  EXPECT_THAT(error(), AllOf(HasSubstr("gates.csv line 2: the norm of q_WG"), HasSubstr("expected 1 (w x y z)")));
  fresh();
  change("gates.csv", "square", "oval");
  EXPECT_THAT(error(), HasSubstr("gates.csv line 2: opening is 'oval', expected square or round"));
  fresh();
  change("gates.csv", "0.5,0.75", "0.8,0.75");
  EXPECT_THAT(error(), HasSubstr("gates.csv line 2: "));
  fresh();
  std::ofstream(recording() / "depth" / "000001.png", std::ios::trunc) << "no picture";
  EXPECT_THAT(error(), AllOf(HasSubstr("poses.csv line 3"), HasSubstr("can't be read, expected a PNG")));
  fresh();
  cv::imwrite((recording() / "depth" / "000002.png").string(), cv::Mat(240, 424, CV_8UC3, cv::Scalar(1, 2, 3)));
  EXPECT_THAT(error(), HasSubstr("has 3 channel(s) of 8 bits, expected one of 16 bits"));

  fresh();
  std::ofstream(file()) << "something of value";
  EXPECT_THAT(import_recordings(file(), {.recordings = {recording()}, .note = ""}).error(),
              HasSubstr("is there already"));
  fs::remove(file());
  EXPECT_THAT(import_recordings(file(), {}).error(), HasSubstr("no recording is named"));
  EXPECT_FALSE(import_recordings(file(), {.recordings = {recording()}, .note = ""}, [](std::uint64_t, std::uint64_t) {
                 return false;
               }).ok());
  EXPECT_FALSE(fs::exists(file()));
}

}  // namespace
}  // namespace gatefield::training
