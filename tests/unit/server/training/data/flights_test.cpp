#include "server/training/data/flights.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <set>

#include "server/training/data/scene_parts.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Flights : public testing::Test {
 protected:
  fs::path folder_ = fs::path(testing::TempDir()) / ("gatefield-flights-" + std::to_string(::getpid()));
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
};

TEST_F(Flights, FlyAtRacingSpeedsAndAttitudesThroughFreeSpace) {
  FlightOptions options;
  options.seed = 5;
  double slowest_m_s = 1e9;
  double fastest_m_s = 0.0;
  double most_tilted_rad = 0.0;
  std::set<std::size_t> gate_counts;
  for (std::uint64_t index = 0; index < 60; ++index) {
    const Flight flight = draw_flight(options, index);
    ASSERT_EQ(flight.X_WC.size(), options.frames);
    gate_counts.insert(flight.world.gates.size());
    const std::vector<scene::Box> solids = scene::solid_boxes(flight.world);
    Eigen::Vector3d before_m_s = Eigen::Vector3d::Zero();
    for (std::size_t frame = 0; frame < flight.X_WC.size(); ++frame) {
      const Eigen::Isometry3d& X_WC = flight.X_WC[frame];
      EXPECT_NEAR((X_WC.linear() * X_WC.linear().transpose() - Eigen::Matrix3d::Identity()).norm(), 0.0, 1e-9);
      EXPECT_GT(X_WC.translation().z(), 0.3);
      for (const scene::Box& box : solids) {
        ASSERT_GT(distance_m(box, X_WC.translation()), 0.1) << "flight " << index << " frame " << frame;
      }
      const Eigen::Matrix3d R_WB = X_WC.linear() * dataset_camera().X_BC.linear().transpose();
      most_tilted_rad = std::max(most_tilted_rad, std::acos(std::min(R_WB(2, 2), 1.0)));
      if (frame == 0) continue;
      const Eigen::Vector3d v_m_s = (X_WC.translation() - flight.X_WC[frame - 1].translation()) * options.rate_hz;
      slowest_m_s = std::min(slowest_m_s, v_m_s.norm());
      fastest_m_s = std::max(fastest_m_s, v_m_s.norm());
      if (frame > 1) {
        // Smooth: what changes between two frames is what a racing drone can do.
        EXPECT_LT((v_m_s - before_m_s).norm() * options.rate_hz, 35.0) << "flight " << index << " frame " << frame;
      }
      const Eigen::AngleAxisd turned(flight.X_WC[frame - 1].linear().transpose() * X_WC.linear());
      EXPECT_LT(turned.angle() * options.rate_hz, 15.0) << "flight " << index << " frame " << frame;
      before_m_s = v_m_s;
    }
  }
  EXPECT_GT(slowest_m_s, 1.5);
  EXPECT_LT(slowest_m_s, 4.0);
  EXPECT_GT(fastest_m_s, 7.0);
  EXPECT_LT(fastest_m_s, 9.2);
  EXPECT_GT(most_tilted_rad, 0.8);
  EXPECT_LT(most_tilted_rad, 1.35);
  EXPECT_EQ(gate_counts, (std::set<std::size_t>{3, 4, 5, 6}));
}

TEST_F(Flights, ComeBackToARoomWithItsGatesElsewhere) {
  FlightOptions options;
  options.rooms = 3;
  const Flight first = draw_flight(options, 1);
  const Flight again = draw_flight(options, 4);
  const Flight other = draw_flight(options, 2);
  EXPECT_EQ(first.texture_seed, again.texture_seed);
  EXPECT_NE(first.texture_seed, other.texture_seed);
  ASSERT_EQ(first.world.gates.size(), again.world.gates.size());
  for (std::size_t k = 0; k < first.world.gates.size(); ++k) {
    const double moved_m = (first.world.gates[k].X_WG.translation() - again.world.gates[k].X_WG.translation()).norm();
    EXPECT_GT(moved_m, 0.0);
    EXPECT_LT(moved_m, 2.0 * std::hypot(0.7, 0.35) + 0.8);
  }
  options.seed = 1'000'021;
  EXPECT_NE(draw_flight(options, 1).texture_seed, first.texture_seed);
}

TEST_F(Flights, AFileHasMeasuredAndTrueDepthPosesAndTimes) {
  FlightOptions options;
  options.count = 14;
  options.frames = 4;
  options.rooms = 3;
  options.threads = 2;
  const fs::path file = folder_ / "flights.h5";
  double part = 0.0;
  ASSERT_TRUE(generate_flights(file, options, [&](const Progress& progress) {
                part = static_cast<double>(progress.done_n) / static_cast<double>(progress.total_n);
                return true;
              }).ok());
  EXPECT_EQ(part, 1.0);
  const auto dataset = Dataset::open(file);
  ASSERT_TRUE(dataset.ok()) << dataset.error();
  ASSERT_EQ(dataset->size(), 14u);
  EXPECT_EQ(dataset->kind(), DatasetKind::kStereo);
  double close = 0.0;
  double both = 0.0;
  double truth = 0.0;
  for (std::uint64_t i = 0; i < dataset->size(); ++i) {
    const SampleView sample = dataset->at(i);
    ASSERT_TRUE(sample.X_WC && sample.sequence && sample.time_s);
    EXPECT_EQ(*sample.sequence, i / 4);
    EXPECT_DOUBLE_EQ(*sample.time_s, static_cast<double>(i % 4) / 60.0);
    EXPECT_LT((sample.X_WC->translation() - draw_flight(options, i / 4).X_WC[i % 4].translation().cast<float>()).norm(),
              1e-4f);
    EXPECT_GE(sample.gate_count, 3);
    for (std::size_t k = 0; k < kImageSize_px; ++k) {
      if (sample.clean_mm[k] == 0) continue;
      truth += 1.0;
      if (sample.measured_mm[k] == 0) continue;
      both += 1.0;
      const double difference_px =
          0.05 * dataset_camera().fx_px * 1000.0 * std::abs(1.0 / sample.measured_mm[k] - 1.0 / sample.clean_mm[k]);
      close += difference_px < 0.2 ? 1.0 : 0.0;  // at 160 px image width
    }
  }
  EXPECT_GT(both / truth, 0.4);
  EXPECT_GT(close / both, 0.8);
}

TEST_F(Flights, AStoppedFileGoesOnToTheSameContentWhateverTheThreads) {
  FlightOptions options;
  options.count = 10;
  options.frames = 4;
  options.threads = 1;
  const fs::path whole_file = folder_ / "whole.h5";
  const fs::path stopped_file = folder_ / "stopped.h5";
  ASSERT_TRUE(generate_flights(whole_file, options).ok());
  options.count = 6;  // ends within a flight
  ASSERT_TRUE(generate_flights(stopped_file, options).ok());
  options.count = 10;
  options.threads = 2;
  ASSERT_TRUE(generate_flights(stopped_file, options).ok());
  const auto whole = Dataset::open(whole_file);
  const auto stopped = Dataset::open(stopped_file);
  ASSERT_TRUE(whole.ok() && stopped.ok());
  ASSERT_EQ(whole->size(), 10u);
  ASSERT_EQ(stopped->size(), 10u);
  for (std::uint64_t i = 0; i < 10; ++i) {
    const SampleView a = whole->at(i);
    const SampleView b = stopped->at(i);
    EXPECT_TRUE(std::equal(a.measured_mm.begin(), a.measured_mm.end(), b.measured_mm.begin())) << i;
    EXPECT_TRUE(std::equal(a.clean_mm.begin(), a.clean_mm.end(), b.clean_mm.begin())) << i;
    EXPECT_EQ(*a.sequence, *b.sequence);
  }
  options.rooms = 7;
  options.count = 12;
  EXPECT_THAT(generate_flights(stopped_file, options).error(), HasSubstr("7 rooms"));
}

TEST_F(Flights, ValidationNamesTheField) {
  FlightOptions options;
  options.rooms = 0;
  EXPECT_THAT(validate(options).error(), HasSubstr("flights.rooms"));
  options = {};
  options.frames = 0;
  EXPECT_THAT(validate(options).error(), HasSubstr("flights.frames"));
  options = {};
  options.rate_hz = NAN;
  EXPECT_THAT(validate(options).error(), HasSubstr("flights.rate_hz"));
}

}  // namespace
}  // namespace gatefield::training
