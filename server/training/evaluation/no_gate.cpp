#include "server/training/evaluation/no_gate.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "common/model/bundle.h"
#include "server/perception/learned/encoder_pool.h"
#include "server/perception/learned/learned_sensor.h"
#include "server/perception/sight.h"
#include "server/training/evaluation/observer.h"
#include "server/training/evaluation/parallel.h"

namespace gatefield::training {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kNearest_m = 1.0, kFarthest_m = 8.0, kBehind_m = 0.5;
constexpr double kPassed_rad = 45.0 * std::numbers::pi / 180.0;
constexpr std::uint64_t kFrameStream = 1ull << 40, kGateStream = 2ull << 40;

/// What a course tells of one gate, in the camera's frame.
struct Told {
  Vector3d center_C;
  Vector3d axis_C;
};

/// One thread's perception: the network's numbers through Observer, the decision through what the server runs.
class Watcher {
 public:
  static Result<std::unique_ptr<Watcher>> create(const model::Bundle& bundle) {
    auto observer = Observer::create(bundle);
    if (!observer) return observer.failure();
    auto encoders = perception::EncoderPool::create(bundle, 1);
    if (!encoders) return encoders.failure();
    return std::unique_ptr<Watcher>(new Watcher(bundle, std::move(observer).value(), std::move(encoders).value()));
  }

  /// @param told  nothing: no prior
  GateLook look(std::span<const float> depth_m, CameraModel camera, const std::optional<Told>& told) {
    camera.X_BC = forward_camera_mount(0.0);
    const Told forward{{0.0, 0.0, 3.0}, Vector3d::UnitZ()};
    const Told& where = told ? *told : forward;
    Course course;
    course.closed = false;
    course.waypoints.emplace_back(camera.X_BC * where.center_C, camera.X_BC.linear() * where.axis_C, GateShape{});
    GateLook out;
    const auto encoding =
        observer_->encode(depth_m, camera, told ? std::optional<Vector3d>(told->center_C) : std::nullopt);
    if (encoding) {
      out.validity = static_cast<double>(encoding->validity);
      out.predicted_m = static_cast<double>(encoding->predicted_error_m);
      if (const auto pose = observer_->fit(*encoding, GateShape{}, where.center_C)) out.residual_m = pose->rms_m;
    }
    auto sensor = std::make_unique<perception::LearnedSensor>(bundle_, observer_->decoder(), encoders_.get());
    if (!told) {
      const gates::GateRecords records(course);
      const perception::View view{depth_m, camera, camera.X_BC};
      out.taken = sensor->look(view, records.expectation(0), perception::Where::kAnywhere).has_value();
      return out;
    }
    perception::Sight sight(camera, course, std::move(sensor), {});
    // Floats as they come over the wire.
    const std::span<const std::uint8_t> pixels(reinterpret_cast<const std::uint8_t*>(depth_m.data()),
                                               depth_m.size_bytes());
    sight.look(pixels, protocol::DepthEncoding::kMetres32, Stamp{0}, Isometry3d::Identity(), 0, 0);
    out.taken = sight.records().seen(0);
    return out;
  }

 private:
  Watcher(const model::Bundle& bundle, std::unique_ptr<Observer> observer,
          std::unique_ptr<perception::EncoderPool> encoders)
      : bundle_(&bundle), observer_(std::move(observer)), encoders_(std::move(encoders)) {}

  const model::Bundle* bundle_;
  std::unique_ptr<Observer> observer_;
  std::unique_ptr<perception::EncoderPool> encoders_;
};

/// Where a course could say that a gate is, for all that the frame shows.
Told draw_place(std::span<const float> depth_m, const CameraModel& camera, Random* random) {
  Told told{{0.0, 0.0, 3.0}, Vector3d::UnitZ()};
  for (int attempt = 0; attempt < 50; ++attempt) {
    const int u = static_cast<int>(random->below(static_cast<std::uint32_t>(camera.width_px)));
    const int v = static_cast<int>(random->below(static_cast<std::uint32_t>(camera.height_px)));
    const auto seen_m = static_cast<double>(depth_m[static_cast<std::size_t>(v) * camera.width_px + u]);
    const double limit_m = seen_m > 0.0 ? std::min(kFarthest_m, seen_m + kBehind_m) : kFarthest_m;
    const double turn_rad = random->uniform(-kPassed_rad, kPassed_rad);
    const double z_m = kNearest_m + (limit_m - kNearest_m) * random->uniform();
    if (limit_m <= kNearest_m) continue;
    told.center_C = z_m * camera.ray_C(u, v);
    told.axis_C = Eigen::AngleAxisd(turn_rad, Vector3d::UnitY()) * Vector3d::UnitZ();
    break;
  }
  return told;
}

Vector3d draw_direction(Random* random) {
  const double z = random->uniform(-1.0, 1.0), heading = random->uniform(0.0, 2.0 * std::numbers::pi);
  const double level = std::sqrt(1.0 - z * z);
  return {level * std::cos(heading), level * std::sin(heading), z};
}

double returns_of(std::span<const float> depth_m) {
  const auto seen = std::ranges::count_if(depth_m, [](float z_m) { return z_m > 0.0f; });
  return static_cast<double>(seen) / static_cast<double>(depth_m.size());
}

NoGateFrame look_at_frame(const NoGateOptions& options, std::span<const float> depth_m, const CameraModel& camera,
                          std::uint64_t index, Watcher* watcher) {
  NoGateFrame frame;
  frame.returns = returns_of(depth_m);
  frame.free = watcher->look(depth_m, camera, std::nullopt);
  Random random(options.seed, kFrameStream + index);
  for (int place = 0; place < options.places; ++place)
    frame.told.push_back(watcher->look(depth_m, camera, draw_place(depth_m, camera, &random)));
  return frame;
}

NoGateFrame look_at_gate(const NoGateOptions& options, std::uint64_t index, Watcher* watcher) {
  const CameraModel& camera = dataset_camera();
  const CameraModel rendered = scene::rendered_camera(options.noise, camera);
  Random random(options.seed, kGateStream + index);
  // The image with this number, or the next that shows a gate: one in five shows none.
  Sample sample;
  for (std::uint64_t next = 16 * index; next < 16 * (index + 1); ++next) {
    sample = generate(options.gate_seed, next, 0.0, rendered);
    if (sample.valid_count > 0) break;
  }
  NoGateFrame frame;
  std::vector<float> depth_m(kImageSize_px);
  draw_noisy(sample.view(), options.noise, &random, depth_m);
  frame.returns = returns_of(depth_m);
  frame.free = watcher->look(depth_m, camera, std::nullopt);
  const GateLabel& gate = sample.gates[0];
  const Vector3d off = options.told_off_m * random.uniform() * draw_direction(&random);
  Vector3d axis_C = (gate.q_CG * Eigen::Vector3f::UnitX()).cast<double>();
  if (axis_C.z() < 0.0) axis_C = -axis_C;
  frame.told.push_back(watcher->look(depth_m, camera, Told{gate.p_CG.cast<double>() + off, axis_C}));
  return frame;
}

}  // namespace

Result<NoGateResult> evaluate_no_gate(const NoGateOptions& options, const std::function<bool(double)>& progress) {
  const auto found = find_frames(options.frames);
  if (!found) return found.failure();
  const DepthFrames& frames = *found;
  std::vector<std::vector<float>> images;
  for (std::size_t i = 0; i < frames.images.size(); ++i) {
    auto image = read_frame(frames, i);
    if (!image) return image.failure();
    images.push_back(std::move(image).value());
    cut_to_range(frames.camera.model, &images.back());
  }
  const auto bundle = model::Bundle::read(options.bundle.path);
  if (!bundle) return bundle.failure();
  const int threads = std::max(1, options.threads);
  std::vector<std::unique_ptr<Watcher>> watchers;
  for (int i = 0; i < threads; ++i) {
    auto watcher = Watcher::create(*bundle);
    if (!watcher) return watcher.failure();
    watchers.push_back(std::move(watcher).value());
  }
  NoGateResult result;
  result.options = options;
  result.validity_threshold = bundle->manifest().validity_threshold;
  result.frames.resize(images.size());
  result.gates.resize(static_cast<std::size_t>(options.gates));
  const std::uint64_t total = result.frames.size() + result.gates.size();
  const auto look = [&](int thread, std::uint64_t index) {
    Watcher* const watcher = watchers[static_cast<std::size_t>(thread)].get();
    if (index < images.size()) {
      result.frames[index] = look_at_frame(options, images[index], frames.camera.model, index, watcher);
      result.frames[index].name = frames.images[index].filename().string();
    } else {
      result.gates[index - images.size()] = look_at_gate(options, index - images.size(), watcher);
    }
  };
  const auto report = [&](std::uint64_t done) {
    return !progress || progress(static_cast<double>(done) / static_cast<double>(total));
  };
  if (!for_each_index(total, threads, look, report)) return Error{"evaluation stopped"};
  return result;
}

}  // namespace gatefield::training
