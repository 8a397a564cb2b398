#include "server/perception/learned/depth_encoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "common/geometry/gate.h"
#include "server/perception/learned/network.h"

namespace gatefield::perception {
namespace {

namespace fs = std::filesystem;

const fs::path kShipped = fs::path(GATEFIELD_SOURCE_DIR) / "deploy/models/race";

/// Depth of a gate that faces the camera before a wall, by intersecting each pixel's ray with the gate's plane: no
/// renderer needed.
std::vector<float> gate_before_wall(const CameraModel& camera, const Eigen::Vector3d& center_C, double wall_m) {
  const GateShape shape;
  std::vector<float> depth(static_cast<std::size_t>(camera.width_px) * camera.height_px);
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const Eigen::Vector3d p_C = camera.ray_C(u, v) * center_C.z();
      const double r = std::max(std::abs(p_C.x() - center_C.x()), std::abs(p_C.y() - center_C.y()));
      const bool frame = r >= shape.inner_half_m && r <= shape.outer_half_m;
      depth[static_cast<std::size_t>(v * camera.width_px + u)] = static_cast<float>(frame ? center_C.z() : wall_m);
    }
  }
  return depth;
}

class ShippedEncoder : public testing::Test {
 protected:
  void SetUp() override {
    auto bundle = model::Bundle::read(kShipped);
    ASSERT_TRUE(bundle.ok()) << bundle.error();
    auto created = DepthEncoder::create(*bundle);
    ASSERT_TRUE(created.ok()) << created.error();
    encoder_ = std::move(created).value();
    latent_size_ = bundle->manifest().latent_size;
    threshold_ = bundle->manifest().validity_threshold;
  }
  const CameraModel camera_ = default_camera();
  std::unique_ptr<DepthEncoder> encoder_;
  int latent_size_ = 0;
  double threshold_ = 0.0;
};

TEST(ShippedNetworks, RunThroughOneDnnAndOpenCvAlike) {
  for (const char* name : {"race", "paper"}) {
    const auto bundle = model::Bundle::read(fs::path(GATEFIELD_SOURCE_DIR) / "deploy/models" / name);
    ASSERT_TRUE(bundle.ok()) << bundle.error();
    for (const model::Network& network : bundle->networks()) {
      const auto opencv = opencv_network(network);
      ASSERT_TRUE(opencv.ok()) << opencv.error();
      EXPECT_EQ(disagreement(**opencv, network), "") << network.file;
      const auto onednn = onednn_network(network);
      if (!onednn_built_in()) {
        EXPECT_FALSE(onednn.ok());
        continue;
      }
      ASSERT_TRUE(onednn.ok()) << network.file << ": " << onednn.error();
      EXPECT_EQ(disagreement(**onednn, network), "") << network.file;
      // Again, with other numbers: nothing of the first run is left, and both still agree.
      for (const model::NetworkTensor& input : network.inputs) {
        for (std::size_t i = 0; i < input.values.size(); ++i)
          (*onednn)->input(input.name)[i] = (*opencv)->input(input.name)[i] = input.values[input.values.size() - 1 - i];
      }
      const auto a = (*onednn)->run(network.output.values.size()), b = (*opencv)->run(network.output.values.size());
      ASSERT_TRUE(a.has_value() && b.has_value());
      for (std::size_t i = 0; i < a->size(); ++i) EXPECT_NEAR((*a)[i], (*b)[i], 2e-3 * (1.0 + std::abs((*b)[i])));
    }
  }
}

TEST_F(ShippedEncoder, FindsAGateWithoutAPrior) {
  const Eigen::Vector3d center_C(0.3, -0.1, 3.0);
  const auto encoding = encoder_->encode(gate_before_wall(camera_, center_C, 7.0), camera_, std::nullopt);
  ASSERT_TRUE(encoding.has_value());
  EXPECT_EQ(encoding->latent.size(), static_cast<std::size_t>(latent_size_));
  EXPECT_LT((encoding->center_C.cast<double>() - center_C).norm(), 0.2);
  EXPECT_GT(encoding->validity, threshold_);
  EXPECT_LT(encoding->predicted_error_m, 0.2f);
}

TEST_F(ShippedEncoder, LooksWhereThePriorSays) {
  const Eigen::Vector3d center_C(-0.4, 0.1, 4.0);
  const auto image = gate_before_wall(camera_, center_C, 8.0);
  const Eigen::Vector3d wrong_by_half_a_metre = center_C + Eigen::Vector3d(0.35, 0.2, -0.3);
  const auto at_gate = encoder_->encode(image, camera_, wrong_by_half_a_metre);
  ASSERT_TRUE(at_gate.has_value());
  EXPECT_LT((at_gate->center_C.cast<double>() - center_C).norm(), 0.2);
  EXPECT_GT(at_gate->validity, threshold_);
  // On the bare wall beside it there is none.
  const auto at_wall = encoder_->encode(image, camera_, Eigen::Vector3d(4.5, 0.1, 7.5));
  ASSERT_TRUE(at_wall.has_value());
  EXPECT_LT(at_wall->validity, threshold_);
}

TEST_F(ShippedEncoder, AnotherCameraIsResampled) {
  const Eigen::Vector3d center_C(0.2, 0.15, 2.5);
  CameraModel fine = camera_from_fov(424, 240, 1.6, 1.1);
  fine.max_depth_m = 20.0;
  const auto mine = encoder_->encode(gate_before_wall(camera_, center_C, 6.0), camera_, center_C);
  const auto other = encoder_->encode(gate_before_wall(fine, center_C, 6.0), fine, center_C);
  ASSERT_TRUE(mine.has_value() && other.has_value());
  EXPECT_LT((mine->center_C - other->center_C).norm(), 0.06f);
  EXPECT_LT((other->center_C.cast<double>() - center_C).norm(), 0.15);
}

TEST_F(ShippedEncoder, NothingToSeeIsNothing) {
  const std::vector<float> empty(160 * 90, 0.0f);
  EXPECT_FALSE(encoder_->encode(empty, camera_, std::nullopt).has_value());
  const std::vector<float> saturated(160 * 90, 65.0f);
  EXPECT_FALSE(encoder_->encode(saturated, camera_, std::nullopt).has_value()) << "all beyond the range";
  const std::vector<float> broken(160 * 90, std::numeric_limits<float>::quiet_NaN());
  EXPECT_FALSE(encoder_->encode(broken, camera_, std::nullopt).has_value());
  const std::vector<float> endless(160 * 90, std::numeric_limits<float>::infinity());
  EXPECT_FALSE(encoder_->encode(endless, camera_, std::nullopt).has_value());
}

TEST_F(ShippedEncoder, WrongSizesAndImpossiblePriorsAreNothing) {
  const auto image = gate_before_wall(camera_, {0.0, 0.0, 3.0}, 7.0);
  const std::span<const float> cut_short(image.data(), image.size() - 1);
  EXPECT_FALSE(encoder_->encode(cut_short, camera_, std::nullopt).has_value());
  EXPECT_FALSE(encoder_->encode({}, camera_, std::nullopt).has_value());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(encoder_->encode(image, camera_, Eigen::Vector3d(nan, 0.0, 3.0)).has_value());
  EXPECT_FALSE(encoder_->encode(image, camera_, Eigen::Vector3d(0.0, 0.0, -2.0)).has_value()) << "behind the camera";
  EXPECT_FALSE(encoder_->encode(image, camera_, Eigen::Vector3d(30.0, 0.0, 2.0)).has_value())
      << "far outside the image";
}

TEST_F(ShippedEncoder, SameImageSameLatent) {
  const auto image = gate_before_wall(camera_, {0.1, 0.0, 3.5}, 7.0);
  const auto first = encoder_->encode(image, camera_, std::nullopt);
  encoder_->encode(gate_before_wall(camera_, {-0.5, 0.2, 2.0}, 5.0), camera_, std::nullopt);
  const auto again = encoder_->encode(image, camera_, std::nullopt);
  ASSERT_TRUE(first.has_value() && again.has_value());
  EXPECT_EQ(first->latent, again->latent) << "nothing may be carried from one frame to the next";
}

TEST(DepthEncoder, RunsWhatWasCheckedAndNotWhatLiesThereNow) {
  const fs::path folder = fs::temp_directory_path() / "gatefield-depth-encoder-test";
  fs::remove_all(folder);
  fs::copy(kShipped, folder);
  const auto bundle = model::Bundle::read(folder);
  ASSERT_TRUE(bundle.ok()) << bundle.error();
  fs::resize_file(folder / "look2.onnx", 1000);
  const auto created = DepthEncoder::create(*bundle);
  EXPECT_TRUE(created.ok()) << created.error();
  fs::remove_all(folder);
}

}  // namespace
}  // namespace gatefield::perception
