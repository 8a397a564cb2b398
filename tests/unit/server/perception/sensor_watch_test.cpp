#include "server/perception/sensor_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "server/perception/sight.h"

namespace gatefield::perception {
namespace {

using namespace std::chrono_literals;
using protocol::bit;
using protocol::Problem;
using protocol::Problems;

constexpr Problems kUnit = bit(Problem::kDepthUnitLooksWrong);
constexpr Problems kMounting = bit(Problem::kMountingLooksWrong);
constexpr double kHalfWidth_m = 0.75;

/// Sees flat square plates that face the camera, as wide as a gate: what has one depth is one plate.
class PlateSensor final : public GateSensor {
 public:
  struct Script {
    int looks = 0;
    bool steerable = true;
    bool throws_anywhere = false;
  };
  explicit PlateSensor(std::shared_ptr<Script> script) : script_(std::move(script)) {}

  bool steerable() const noexcept override { return script_->steerable; }
  std::optional<Observation> look(const View& view, const gates::Expectation& gate, Where where) override {
    ++script_->looks;
    if (where == Where::kAnywhere && script_->throws_anywhere) throw std::runtime_error("no");
    struct Plate {
      int least_u = 1 << 20, largest_u = 0, least_v = 1 << 20, largest_v = 0;
    };
    std::map<float, Plate> plates;  // the nearest first
    for (int v = 0; v < view.camera.height_px; ++v)
      for (int u = 0; u < view.camera.width_px; ++u) {
        const float z = view.depth_m[static_cast<std::size_t>(v * view.camera.width_px + u)];
        if (z <= 0.0f) continue;
        Plate& plate = plates[z];
        plate.least_u = std::min(plate.least_u, u), plate.largest_u = std::max(plate.largest_u, u);
        plate.least_v = std::min(plate.least_v, v), plate.largest_v = std::max(plate.largest_v, v);
      }
    for (const auto& [z, plate] : plates) {
      const double z_m = static_cast<double>(z);
      const double width_m = (plate.largest_u - plate.least_u + 1) * z_m / view.camera.fx_px;
      if (std::abs(width_m / (2.0 * kHalfWidth_m) - 1.0) > 0.15) continue;
      const Eigen::Vector3d p_C(
          (0.5 * (plate.least_u + plate.largest_u + 1) - view.camera.cx_px) * z_m / view.camera.fx_px,
          (0.5 * (plate.least_v + plate.largest_v + 1) - view.camera.cy_px) * z_m / view.camera.fy_px, z_m);
      const Eigen::Vector3d p_W = view.X_WC * p_C;
      if (where == Where::kExpected && (p_W - gate.center_W).norm() > 1.2) continue;
      Observation seen;
      seen.gate.X_WG.translation() = seen.glimpse_W = p_W;
      return seen;
    }
    return std::nullopt;
  }
  std::shared_ptr<const gates::Field> field(const Eigen::Isometry3d&, const Eigen::Isometry3d&,
                                            const GateShape&) override {
    return nullptr;
  }
  FieldSource source_of(const gates::Field&) const override { return {}; }
  Result<std::shared_ptr<const gates::Field>> restore(const FieldSource&, const GateShape&) override {
    return Error{"none"};
  }

 private:
  std::shared_ptr<Script> script_;
};

class Watching : public ::testing::Test {
 protected:
  Watching() {
    true_X_BC_ = camera_.X_BC;
    course_.closed = false;
    course_.waypoints = {{{5, 0, 1.5}, Eigen::Vector3d::UnitX()},
                         {{9, 4, 1.5}, Eigen::Vector3d::UnitX()},
                         {{-4, 0.5, 1.0}, Eigen::Vector3d::UnitX()}};
    plates_W_ = {course_.waypoints[0].p_W};
    begin();
  }
  void begin() {
    sight_ = std::make_unique<Sight>(camera_, course_, std::make_unique<PlateSensor>(sensor_), SightOptions{});
  }
  /// What the camera measures, metres.
  std::vector<float> image() const {
    std::vector<float> depth(static_cast<std::size_t>(camera_.width_px * camera_.height_px), background_m_);
    const Eigen::Isometry3d X_CW = (X_WB_ * Eigen::Isometry3d(true_X_BC_)).inverse();
    for (const Eigen::Vector3d& plate_W : plates_W_) {
      const Eigen::Vector3d p_C = X_CW * plate_W;
      if (p_C.z() <= 0) continue;
      for (int v = 0; v < camera_.height_px; ++v)
        for (int u = 0; u < camera_.width_px; ++u) {
          const Eigen::Vector3d at_C = p_C.z() * camera_.ray_C(u, v);
          if (std::max(std::abs(at_C.x() - p_C.x()), std::abs(at_C.y() - p_C.y())) < half_width_m_)
            depth[static_cast<std::size_t>(v * camera_.width_px + u)] = static_cast<float>(p_C.z());
        }
    }
    return depth;
  }
  /// Looks at frames for so long, 30 a second, with every depth off by `factor`, while the vehicle moves ahead.
  /// @return what is wrong at the end
  Problems fly(Stamp time, float factor = 1.0f) {
    for (const Stamp end = now_ + time; now_ < end; now_ += 33ms) {
      X_WB_.translation().x() += 0.02;
      std::vector<float> depth = image();
      for (float& z : depth) z *= factor;
      std::vector<std::uint8_t> bytes(4 * depth.size());
      std::memcpy(bytes.data(), depth.data(), bytes.size());
      outcome_ = sight_->look(bytes, protocol::DepthEncoding::kMetres32, now_, X_WB_, 0, 1);
    }
    return sight_->problems();
  }
  bool seen() const { return sight_->records().seen(0); }

  CameraModel camera_ = default_camera();
  PlainIsometry true_X_BC_;
  Course course_;
  std::vector<Eigen::Vector3d> plates_W_;
  double half_width_m_ = kHalfWidth_m;
  float background_m_ = 0.0f;
  Eigen::Isometry3d X_WB_ = Eigen::Isometry3d(Eigen::Translation3d(0, 0, 1.5));
  Stamp now_ = 10s;
  std::shared_ptr<PlateSensor::Script> sensor_ = std::make_shared<PlateSensor::Script>();
  std::unique_ptr<Sight> sight_;
  Sight::Outcome outcome_{};
};

TEST_F(Watching, NothingIsWrongWithAGateThatIsSeen) {
  EXPECT_EQ(fly(1s), 0u);
  EXPECT_TRUE(seen());
}

TEST_F(Watching, FindsAnotherUnitOfDepth) {
  for (const float factor : {0.001f, 0.1f, 0.2f, 0.25f, 0.5f, 2.0f, 4.0f, 5.0f, 10.0f, 100.0f, 1000.0f}) {
    X_WB_.translation().x() = 0;
    begin();
    EXPECT_EQ(fly(1500ms, factor), kUnit) << factor;
    EXPECT_FALSE(seen()) << factor;
  }
}

TEST_F(Watching, ATurnedCameraIsFound) {
  for (const double degrees : {180.0, 90.0, -90.0}) {
    true_X_BC_ = camera_.X_BC * Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ());
    X_WB_.translation().x() = -0.5;
    X_WB_.translation().z() = degrees == 180.0 ? 1.5 : 2.5;  // far enough from the axis for a quarter turn to matter
    begin();
    EXPECT_EQ(fly(1s), kMounting) << degrees;
    EXPECT_FALSE(seen()) << degrees;
  }
}

TEST_F(Watching, AGateThatMovesWithTheVehicleTellsOfATurnedCameraThoughItIsTaken) {
  for (const double degrees : {180.0, 90.0, -90.0, 0.0}) {
    true_X_BC_ = camera_.X_BC * Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ());
    X_WB_ = Eigen::Translation3d(0, 0, 1.5);
    begin();
    for (int i = 0; i < 24; ++i) {
      X_WB_.linear() = Eigen::AngleAxisd(0.02 * i, Eigen::Vector3d::UnitY()).toRotationMatrix();
      fly(33ms);
    }
    EXPECT_TRUE(seen());
    EXPECT_EQ(sight_->problems(), degrees == 0.0 ? 0u : kMounting) << degrees;
  }
}

TEST_F(Watching, AVehicleThatOnlyJustLeansForwardTellsOfACameraUpsideDown) {
  true_X_BC_ = camera_.X_BC * Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ());
  begin();
  fly(200ms);
  for (int i = 0; i < 6; ++i) {
    X_WB_.linear() = Eigen::AngleAxisd(0.05 * i, Eigen::Vector3d::UnitY()).toRotationMatrix();
    fly(33ms);
  }
  plates_W_.clear();  // it leaves the image
  EXPECT_EQ(fly(200ms), kMounting);
}

TEST_F(Watching, ACameraThatLooksBackwardsIsFoundByAnotherGateOfTheCourse) {
  true_X_BC_ = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ()) * camera_.X_BC;
  course_.waypoints[2].p_W = {-3, 2, 1};
  plates_W_ = {course_.waypoints[0].p_W, course_.waypoints[2].p_W};
  begin();
  EXPECT_EQ(fly(1s), kMounting);
}

TEST_F(Watching, TellsWithinASecondAndUntilTheGateWasTakenForOne) {
  EXPECT_EQ(fly(400ms, 4.0f), 0u) << "one try is not enough";
  EXPECT_EQ(fly(600ms, 4.0f), kUnit);
  EXPECT_EQ(fly(900ms), kUnit) << "not before a second of agreement";
  EXPECT_EQ(fly(200ms), 0u);
  EXPECT_TRUE(seen());
}

TEST_F(Watching, LooksOnceMoreInFourTenthsOfASecondAtMost) {
  plates_W_.clear();
  background_m_ = 5.0f * 4.0f;  // a quarter of it lies at the gate's distance
  fly(2s);
  EXPECT_LE(sensor_->looks, 6);
  EXPECT_GE(sensor_->looks, 3);
}

TEST_F(Watching, GatesThatStandElsewhereGiveNoProblem) {
  for (const Eigen::Vector3d& off :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(-0.7, 0.7, 0.2),
        Eigen::Vector3d(0, 2.5, 0), Eigen::Vector3d(-2.5, 0, 0)}) {
    plates_W_ = {course_.waypoints[0].p_W + off};
    X_WB_.translation().x() = 0;
    begin();
    EXPECT_EQ(fly(3s), 0u) << off.transpose();
  }
}

TEST_F(Watching, GatesOfAnotherSizeGiveNoProblem) {
  for (const double half_width_m : {0.15, 0.375, 1.5, 3.0}) {
    half_width_m_ = half_width_m;
    for (const double x_m : {0.0, 2.0, 3.0}) {
      X_WB_.translation().x() = x_m;
      begin();
      EXPECT_EQ(fly(1s), 0u) << half_width_m << " m from " << x_m << " m";
    }
  }
}

TEST_F(Watching, OtherGatesOfTheCourseGiveNoProblemWhereTheTargetIsMissing) {
  plates_W_ = {course_.waypoints[1].p_W, course_.waypoints[2].p_W};
  EXPECT_EQ(fly(3s), 0u);
}

TEST_F(Watching, AnEmptyWorldOrAWallGivesNoProblem) {
  plates_W_.clear();
  for (const float background_m :
       {0.0f, 2.5f, 5.0f, 20.0f, 1000.0f, 65504.0f, std::numeric_limits<float>::infinity()}) {
    background_m_ = background_m;
    X_WB_.translation().x() = 0;
    begin();
    EXPECT_EQ(fly(2s), 0u) << background_m;
  }
}

TEST_F(Watching, ASensorThatCantBeSteeredOrThatThrowsGivesNoProblem) {
  sensor_->steerable = false;
  EXPECT_EQ(fly(1s), 0u);
  EXPECT_TRUE(seen());
  begin();
  sensor_->throws_anywhere = true;
  X_WB_.translation().x() = 0;
  EXPECT_EQ(fly(1s, 4.0f), 0u);
  EXPECT_EQ(outcome_, Sight::Outcome::kSaturated) << "what the frame itself is";
}

TEST_F(Watching, NothingIsTriedWhileTheGateIsOutOfView) {
  X_WB_.linear() = Eigen::AngleAxisd(1.6, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  background_m_ = 20.0f;
  fly(1s);
  EXPECT_EQ(sensor_->looks, 0);
}

TEST_F(Watching, FloatsThatAreMillimetresAreFoundWithoutASensor) {
  X_WB_.linear() = Eigen::AngleAxisd(1.6, Eigen::Vector3d::UnitZ()).toRotationMatrix();  // the target is out of view
  course_.waypoints[2].p_W = {0, 6, 1.5};
  plates_W_ = {{0, 4, 1.5}, {1.5, 6, 1.5}};
  begin();
  EXPECT_EQ(fly(450ms, 1000.0f), 0u);
  EXPECT_EQ(fly(200ms, 1000.0f), kUnit);
  EXPECT_EQ(outcome_, Sight::Outcome::kSaturated);
  EXPECT_EQ(fly(34ms), 0u);
}

TEST_F(Watching, ATimeLineThatBeginsAnewBeginsTheWaitsAnew) {
  EXPECT_EQ(fly(400ms, 4.0f), 0u);
  now_ = 0s;
  EXPECT_EQ(fly(400ms, 4.0f), 0u);
  EXPECT_EQ(fly(600ms, 4.0f), kUnit);
}

}  // namespace
}  // namespace gatefield::perception
