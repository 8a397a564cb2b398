#include "server/training/evaluation/grouping.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/statistics.h"
#include "server/training/evaluation/statistics.h"

namespace gatefield::training {
namespace {

std::vector<Group> make_groups() {
  std::vector<Group> out;
  const auto distance = [&](const std::string& name, double from, double to) {
    out.push_back({"distance", name, [=](const GateFacts& g) { return g.distance_m >= from && g.distance_m < to; }});
  };
  distance("below 1 m", 0, 1);
  distance("1 to 2 m", 1, 2);
  distance("2 to 4 m", 2, 4);
  distance("4 to 7 m", 4, 7);
  distance("7 to 10 m", 7, 10);
  distance("beyond 10 m", 10, 1e9);
  const auto angle = [&](const std::string& name, double from, double to) {
    out.push_back({"angle", name, [=](const GateFacts& g) { return g.axis_deg >= from && g.axis_deg < to; }});
  };
  angle("0 to 30 deg", 0, 30);
  angle("30 to 60 deg", 30, 60);
  angle("60 to 80 deg", 60, 80);
  angle("beyond 80 deg", 80, 1e9);
  const auto visible = [&](const std::string& name, double from, double to) {
    out.push_back({"visibility", name,
                   [=](const GateFacts& g) { return g.visible_fraction >= from && g.visible_fraction < to; }});
  };
  visible("25 to 50 %", 0, 0.5);  // what is less visible is no valid gate
  visible("50 to 75 %", 0.5, 0.75);
  visible("75 to 100 %", 0.75, 1e9);
  out.push_back({"gates in view", "1", [](const GateFacts& g) { return g.in_view == 1; }});
  out.push_back({"gates in view", "2", [](const GateFacts& g) { return g.in_view == 2; }});
  out.push_back({"gates in view", "3 and more", [](const GateFacts& g) { return g.in_view >= 3; }});
  out.push_back({"together", "core", [](const GateFacts& g) {
                   return g.distance_m >= 1.0 && g.distance_m < 4.0 && g.axis_deg < 60.0 && g.visible_fraction >= 0.5;
                 }});
  out.push_back({"together", "all", [](const GateFacts&) { return true; }});
  return out;
}

double median_of_coordinate(const std::vector<const FrameTruth*>& frames, int axis) {
  std::vector<double> values;
  for (const FrameTruth* frame : frames) values.push_back(frame->center_C[axis]);
  return quantile(std::move(values), 0.5);
}

}  // namespace

const char* name_of(Mode mode) noexcept { return mode == Mode::kPrior ? "prior" : "first look"; }

const std::vector<Group>& groups() {
  static const std::vector<Group> all = make_groups();
  return all;
}

Summary summarize(const std::vector<const Measured*>& frames, double validity_threshold) {
  const auto values = [&](const auto& get) {
    std::vector<double> out;
    for (const Measured* frame : frames) out.push_back(get(*frame));
    return out;
  };
  Summary out;
  out.count = static_cast<int>(frames.size());
  out.all_m = mean(values([](const Measured& m) { return m.all_m; }));
  out.near_m = mean(values([](const Measured& m) { return m.near_m; }));
  const auto box = values([](const Measured& m) { return m.box_m; });
  out.box_m = mean(box);
  out.box_median_m = quantile(box, 0.5);
  const auto sign = values([](const Measured& m) { return m.sign_percent; });
  out.sign_percent = mean(sign);
  out.sign_median_percent = quantile(sign, 0.5);
  const auto center = values([](const Measured& m) { return m.center_m; });
  out.center_median_m = quantile(center, 0.5);
  out.center_p90_m = quantile(center, 0.9);
  const auto normal = values([](const Measured& m) { return m.normal_deg; });
  out.normal_median_deg = quantile(normal, 0.5);
  out.normal_p90_deg = quantile(normal, 0.9);
  out.encoder_center_median_m = quantile(values([](const Measured& m) { return m.encoder_center_m; }), 0.5);
  out.fitted_percent = mean(values([](const Measured& m) { return m.fitted ? 100.0 : 0.0; }));
  out.valid_percent =
      mean(values([&](const Measured& m) { return m.encoded && m.validity >= validity_threshold ? 100.0 : 0.0; }));
  return out;
}

Constant constant_baseline(const std::vector<const FrameTruth*>& frames) {
  Constant out;
  std::vector<float> all, near, box;
  std::vector<double> prior;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  for (const FrameTruth* frame : frames) {
    all.insert(all.end(), frame->mix_m.begin(), frame->mix_m.end());
    near.insert(near.end(), frame->mix_m.begin(), frame->mix_m.begin() + static_cast<std::ptrdiff_t>(frame->near_n));
    box.insert(box.end(), frame->box_m.begin(), frame->box_m.end());
    prior.push_back(frame->prior_m);
    axes += frame->axis_C.cast<double>() * frame->axis_C.cast<double>().transpose();
  }
  out.all_m = constant_error(std::move(all));
  out.near_m = constant_error(std::move(near));
  out.sign_percent = constant_sign_percent(box);
  out.box_m = constant_error(std::move(box));
  out.prior_median_m = quantile(std::move(prior), 0.5);

  const Eigen::Vector3d center_C(median_of_coordinate(frames, 0), median_of_coordinate(frames, 1),
                                 median_of_coordinate(frames, 2));
  const Eigen::Vector3d axis_C = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(axes).eigenvectors().col(2);
  std::vector<double> center, normal;
  for (const FrameTruth* frame : frames) {
    center.push_back((frame->center_C.cast<double>() - center_C).norm());
    const double cosine = std::abs(axis_C.dot(frame->axis_C.cast<double>()));
    normal.push_back(std::acos(std::min(1.0, cosine)) * 180.0 / std::numbers::pi);
  }
  out.center_median_m = quantile(std::move(center), 0.5);
  out.normal_median_deg = quantile(std::move(normal), 0.5);
  return out;
}

}  // namespace gatefield::training
