#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <onnx/checker.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "common/model/bundle.h"
#include "common/model/two_look.h"
#include "server/kernels/backend.h"
#include "server/perception/learned/depth_encoder.h"
#include "server/training/learn/export.h"
#include "server/training/learn/train_loop.h"
#include "server/training/learn/trainer.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;

/// A small data set, rendered once for all tests of this program.
class Training : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("gatefield-training-test-" + std::to_string(getpid()));
    fs::create_directories(folder_);
    DatasetOptions options;
    options.seed = 7;
    options.count = 300;
    ASSERT_TRUE(generate_dataset(folder_ / "mini.h5", options).ok());
    dataset_ = std::make_unique<Dataset>(std::move(Dataset::open(folder_ / "mini.h5")).value());
  }
  static void TearDownTestSuite() {
    dataset_.reset();
    fs::remove_all(folder_);
  }

  static Design design(const char* name) { return find_design(name).value(); }
  static BatchOptions batch_options(const Design& design) {
    BatchOptions options;
    options.images = 6;
    options.crops_per_image = 2;
    options.design = design;
    options.seed = 3;
    return options;
  }
  static std::unique_ptr<Trainer> trainer(const Design& design, std::uint64_t total_steps, bool freeze = false) {
    TrainerOptions options;
    options.design = design;
    options.freeze_decoders = freeze;
    options.total_steps = total_steps;
    options.warmup_steps = 5;
    options.average_decay = 0.5;
    options.allow_bf16 = false;
    auto created = Trainer::create(options);
    EXPECT_TRUE(created.ok());
    return std::move(created).value();
  }
  static std::span<const Source> sources() {
    static Source source;
    source.dataset = dataset_.get();
    return {&source, 1};
  }
  static std::vector<StepLosses> steps(Trainer* trainer, std::uint64_t count) {
    std::vector<StepLosses> out;
    const BatchOptions options = batch_options(trainer->design());
    Batch batch;
    for (std::uint64_t i = 0; i < count; ++i) {
      make_batch(sources(), options, trainer->steps(), &batch);
      const auto losses = trainer->step(options, &batch);
      EXPECT_TRUE(losses.ok());
      out.push_back(*losses);
    }
    return out;
  }
  static std::vector<StepLosses> steps_on_one_batch(Trainer* trainer, int count) {
    std::vector<StepLosses> out;
    const BatchOptions options = batch_options(trainer->design());
    Batch batch;
    make_batch(sources(), options, 0, &batch);
    for (int i = 0; i < count; ++i) {
      const auto losses = trainer->step(options, &batch);
      EXPECT_TRUE(losses.ok());
      out.push_back(*losses);
    }
    return out;
  }
  /// A sample in whose image a gate shows, with noise.
  static std::vector<float> image_with_gate(GateLabel* gate) {
    for (std::uint64_t i = 0; i < dataset_->size(); ++i) {
      const SampleView sample = dataset_->at(i);
      if (sample.target() == nullptr || sample.target()->p_CG.norm() > 4.0f) continue;
      *gate = *sample.target();
      std::vector<float> image(kImageSize_px);
      Random random(5, i);
      draw_noisy(sample, {}, &random, image);
      return image;
    }
    ADD_FAILURE() << "no gate in the whole data set";
    return {};
  }
  /// The field that libtorch and the kernel give for a latent: the greatest difference over points around the gate.
  static double decoder_difference(const Trainer& trainer, const model::Bundle& bundle,
                                   const std::vector<float>& latent) {
    std::vector<float> points_C, x, y, z;
    Random random(11);
    for (int i = 0; i < 300; ++i) {
      const float p[3] = {static_cast<float>(random.uniform(-4, 4)), static_cast<float>(random.uniform(-3, 3)),
                          static_cast<float>(random.uniform(-1, 9))};
      points_C.insert(points_C.end(), p, p + 3);
      x.push_back(p[0]);
      y.push_back(p[1]);
      z.push_back(p[2]);
    }
    const std::vector<float> expected = trainer.decode(latent, points_C);
    kernels::FoldedDecoder folded;
    kernels::fold(kernels::best_backend().prepare(bundle.decoder()), latent, Eigen::Isometry3d::Identity(), &folded);
    std::vector<float> sdf_m(x.size());
    folded.decode(x, y, z, sdf_m);
    double worst = 0.0;
    double spread = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      worst = std::max(worst, static_cast<double>(std::abs(sdf_m[i] - expected[i])));
      spread = std::max(spread, static_cast<double>(std::abs(expected[i] - expected[0])));
    }
    EXPECT_GT(spread, 0.1) << "a field that is the same everywhere would prove nothing";
    return worst;
  }
  static void expect_valid_onnx(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    onnx::ModelProto model;
    ASSERT_TRUE(model.ParseFromIstream(&in)) << file;
    EXPECT_NO_THROW(onnx::checker::check_model(model)) << file;
  }

  /// What the exported files give is held against libtorch, step by step.
  static void expect_two_looks_exported(const Design& design) {
    SCOPED_TRACE(design.name);
    const auto net = trainer(design, 60);
    steps(net.get(), 40);
    const fs::path folder = folder_ / std::string(design.name);
    ASSERT_TRUE(export_bundle(net->weights(), design, "test", folder).ok());
    ASSERT_TRUE(export_bundle(net->weights(), design, "test", folder).ok()) << "a bundle can be replaced";
    for (const char* name : {"look1.onnx", "look2.onnx", "decoder.onnx"}) expect_valid_onnx(folder / name);
    const auto bundle = model::Bundle::read(folder);
    ASSERT_TRUE(bundle.ok()) << bundle.error();
    auto encoder = perception::DepthEncoder::create(*bundle);
    ASSERT_TRUE(encoder.ok()) << encoder.error();

    GateLabel gate;
    const std::vector<float> image = image_with_gate(&gate);
    const CameraModel& camera = dataset_camera();
    // Without a prior: the first look, then the second (again where the first correction is large), step by step
    // through libtorch.
    const auto shape = model::look_shape(camera.width_px, camera.height_px);
    std::vector<float> input(shape.input_size()), anchors(shape.anchor_size());
    model::first_look_input(image, camera, input, anchors);
    const auto seen = net->first_look(input, anchors);
    const model::CropShape crop = design.crop();
    std::vector<float> cut(crop.input_size()), context(model::kCropContext);
    const auto look = [&](const Eigen::Vector3d& center_C) {
      EXPECT_GT(model::crop_input(image, camera, crop, center_C, cut, context), 0);
      return net->second_look(cut, context);
    };
    for (const bool with_prior : {false, true}) {
      Eigen::Vector3d center_C = with_prior
                                     ? Eigen::Vector3d(gate.p_CG.cast<double>() + Eigen::Vector3d(0.05, -0.1, 0.08))
                                     : Eigen::Vector3d(seen[0], seen[1], std::max(seen[2], 0.3f));
      const auto prior = with_prior ? std::optional(center_C) : std::nullopt;
      auto code = look(center_C);
      Eigen::Vector3d moved_C = center_C + Eigen::Vector3d(code[0], code[1], code[2]);
      if ((moved_C - center_C).norm() > 0.05) {
        center_C = moved_C;
        code = look(center_C);
        moved_C = center_C + Eigen::Vector3d(code[0], code[1], code[2]);
      }
      const auto encoding = (*encoder)->encode(image, camera, prior);
      ASSERT_TRUE(encoding.has_value());
      EXPECT_LT((encoding->center_C.cast<double>() - moved_C).norm(), 1e-3) << "prior " << with_prior;
      const auto latent_n = static_cast<std::size_t>(design.latent_size());
      ASSERT_EQ(encoding->latent.size(), latent_n);
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_EQ(encoding->latent[i], encoding->center_C[static_cast<Eigen::Index>(i)]);
      for (std::size_t i = 3; i < latent_n; ++i) EXPECT_NEAR(encoding->latent[i], code[i], 1e-3) << i;
      EXPECT_NEAR(encoding->validity, 1.0 / (1.0 + std::exp(-code[latent_n])), 1e-3);
      EXPECT_NEAR(encoding->predicted_error_m, std::max(0.0, std::exp(code[latent_n + 1]) - 0.005), 1e-3);
      EXPECT_LT(decoder_difference(*net, *bundle, encoding->latent), 1e-3);
    }
  }
  static void expect_plain_exported(const Design& design) {
    SCOPED_TRACE(design.name);
    const auto net = trainer(design, 60);
    steps(net.get(), 40);
    const fs::path folder = folder_ / std::string(design.name);
    ASSERT_TRUE(export_bundle(net->weights(), design, "test", folder).ok());
    for (const char* name : {"encoder.onnx", "decoder.onnx"}) expect_valid_onnx(folder / name);
    const auto bundle = model::Bundle::read(folder);
    ASSERT_TRUE(bundle.ok()) << bundle.error();
    auto encoder = perception::DepthEncoder::create(*bundle);
    ASSERT_TRUE(encoder.ok()) << encoder.error();
    GateLabel gate;
    const std::vector<float> image = image_with_gate(&gate);
    const auto encoding = (*encoder)->encode(image, dataset_camera(), std::nullopt);
    ASSERT_TRUE(encoding.has_value());
    std::vector<float> input(2 * kImageSize_px);
    model::plain_input(image, input);
    const auto code = net->plain(input);
    const auto latent_n = static_cast<std::size_t>(design.latent_size());
    ASSERT_EQ(encoding->latent.size(), latent_n);
    for (std::size_t i = 0; i < latent_n; ++i) EXPECT_NEAR(encoding->latent[i], code[i], 1e-3) << i;
    EXPECT_NEAR(encoding->validity, 1.0 / (1.0 + std::exp(-code[latent_n])), 1e-3);
    EXPECT_LT(decoder_difference(*net, *bundle, encoding->latent), 1e-3);
  }

  static inline fs::path folder_;
  static inline std::unique_ptr<Dataset> dataset_;
};

// Six images, seen again and again, must be learned nearly by heart: on ever new ones some dozen steps show little.
TEST_F(Training, TwoLooksLearn) {
  const auto net = trainer(design("two-look"), 60);
  const auto losses = steps_on_one_batch(net.get(), 60);
  EXPECT_LT(losses.back().field_m, 0.6 * losses.front().field_m);
  EXPECT_LT(losses.back().field_m, 0.6 * losses.back().constant_m);
  EXPECT_LT(losses.back().total, 0.6 * losses.front().total);
}

TEST_F(Training, PlainNetworksLearn) {
  const auto net = trainer(design("paper"), 80);
  const auto losses = steps_on_one_batch(net.get(), 80);
  EXPECT_LT(losses.back().field_m, 0.7 * losses.front().field_m);
  EXPECT_LT(losses.back().field_m, 0.8 * losses.back().constant_m);
  EXPECT_LT(losses.back().depth, losses.front().depth);
}

TEST_F(Training, ResumedRunGivesTheSameWeights) {
  for (const Design& each : designs()) {
    const auto whole = trainer(each, 12);
    steps(whole.get(), 12);
    const auto first = trainer(each, 12);
    steps(first.get(), 5);
    const fs::path file = folder_ / "resume.pt";
    ASSERT_TRUE(first->save(file).ok());
    const auto second = trainer(each, 12);
    ASSERT_TRUE(second->load(file).ok());
    EXPECT_EQ(second->steps(), 5u);
    steps(second.get(), 7);
    const Weights expected = whole->weights();
    const Weights resumed = second->weights();
    ASSERT_EQ(expected.size(), resumed.size());
    for (const auto& [name, tensor] : expected) EXPECT_EQ(tensor.values, resumed.at(name).values) << name;
  }
}

TEST_F(Training, CheckpointOfOtherNetworksIsRefused) {
  const fs::path file = folder_ / "plain.pt";
  ASSERT_TRUE(trainer(design("paper"), 10)->save(file).ok());
  const Status loaded = trainer(design("two-look"), 10)->load(file);
  ASSERT_FALSE(loaded.ok());
  EXPECT_THAT(loaded.error(), testing::HasSubstr("belongs to the design 'paper'"));
  std::ofstream(file, std::ios::trunc) << "no checkpoint";
  EXPECT_THAT(trainer(design("paper"), 10)->load(file).error(), testing::HasSubstr("can't be read"));
  EXPECT_THAT(trainer(design("paper"), 10)->load(folder_ / "nowhere.pt").error(), testing::HasSubstr("does not exist"));
}

TEST_F(Training, ExportedTwoLooksEqualLibtorch) {
  for (const char* name : {"two-look", "two-look-z64", "two-look-48"}) expect_two_looks_exported(design(name));
}

TEST_F(Training, ExportedPlainNetworksEqualLibtorch) {
  for (const char* name : {"paper", "plain-hyper"}) expect_plain_exported(design(name));
}

TEST_F(Training, ExportNamesAMissingWeight) {
  Weights weights = trainer(design("two-look"), 10)->weights();
  weights.erase("first.deep2.weight");
  const Status status = export_bundle(weights, design("two-look"), "test", folder_ / "broken");
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), testing::HasSubstr("first.deep2.weight"));
  EXPECT_FALSE(fs::exists(folder_ / "broken"));
}

TEST_F(Training, BatchesDependOnTheStepAlone) {
  const BatchOptions options = batch_options(design("two-look"));
  std::vector<std::vector<float>> inputs;
  for (const int threads : {1, 3}) {
    BatchQueue queue({sources().begin(), sources().end()}, options, 4, threads, 3);
    for (std::uint64_t step = 4; step < 9; ++step) {
      auto batch = queue.next();
      EXPECT_EQ(batch->step, step);
      if (threads == 1) {
        inputs.push_back(batch->look_input);
      } else {
        EXPECT_EQ(batch->look_input, inputs[step - 4]);
      }
      queue.recycle(std::move(batch));
    }
  }
}

TEST_F(Training, CropsTellGatesFromEmptyPlaces) {
  // Over many crops: valid ones lie at a gate and carry its field, the others are asked to say that nothing is there.
  BatchOptions options = batch_options(design("two-look"));
  options.predicted_part = options.predicted_part_empty = 0.0;
  int valid = 0, empty = 0;
  Batch batch;
  for (std::uint64_t step = 0; step < 20; ++step) {
    make_batch(sources(), options, step, &batch);
    for (std::size_t crop = 0; crop < static_cast<std::size_t>(batch.crops); ++crop) {
      const Eigen::Vector3f center(&batch.crop_center[3 * crop]);
      const auto& gates = batch.gates[crop / 2];
      float nearest = 1e9f;
      for (int g = 0; g < batch.gate_count[crop / 2]; ++g) {
        if (gates[static_cast<std::size_t>(g)].visible_fraction < kDimVisibleFraction) continue;
        nearest = std::min(nearest, (gates[static_cast<std::size_t>(g)].p_CG - center).norm());
      }
      if (batch.validity[crop] == 1.0f) {
        ++valid;
        EXPECT_LE(nearest, kCropCaptureRadius_m);
        EXPECT_GT(batch.target_weight[crop], 0.0f);
      } else if (batch.validity_weight[crop] == 1.0f) {
        ++empty;
        EXPECT_GT(nearest, kCropCaptureRadius_m);
        EXPECT_EQ(batch.target_weight[crop], 0.0f);
      }
    }
  }
  EXPECT_GT(valid, 60);
  EXPECT_GT(empty, 40);
}

TEST_F(Training, LoopWritesLogAndBundleAndContinues) {
  TrainRun run;
  run.data = {{folder_ / "mini.h5"}};
  run.folder = folder_ / "loop";
  run.bundle_folder = folder_ / "loop-bundle";
  run.batch = 2;
  run.images = 240;  // 120 steps: one full line of the log and the last one
  run.allow_bf16 = false;
  stop_requested = true;
  const auto at_once = train(run);
  ASSERT_TRUE(at_once.ok()) << at_once.error();
  EXPECT_FALSE(*at_once) << "stopped before the first step";
  stop_requested = false;
  const auto complete = train(run);
  ASSERT_TRUE(complete.ok()) << complete.error();
  EXPECT_TRUE(*complete);
  EXPECT_TRUE(model::Bundle::read(run.bundle_folder).ok());
  std::ifstream log(run.folder / "log.csv");
  std::vector<std::string> lines;
  for (std::string line; std::getline(log, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_THAT(lines[1], testing::StartsWith("100,200,"));
  EXPECT_THAT(lines[2], testing::StartsWith("120,240,"));
}

TEST_F(Training, FrozenDecodersStayAsTheyAre) {
  const auto first = trainer(design("two-look"), 12);
  steps(first.get(), 6);
  const fs::path file = folder_ / "stage1.pt";
  ASSERT_TRUE(first->save(file).ok());
  const auto second = trainer(design("two-look"), 12, true);
  const auto left = second->start_from(file);
  ASSERT_TRUE(left.ok()) << left.error();
  EXPECT_TRUE(left->empty());
  EXPECT_EQ(second->steps(), 0u);
  steps(second.get(), 4);
  const Weights before = first->weights();
  bool encoder_moved = false;
  for (const auto& [name, tensor] : second->weights()) {
    if (name.rfind("decoder.", 0) == 0 || name.rfind("depth.", 0) == 0) {
      EXPECT_EQ(tensor.values, before.at(name).values) << name;
    } else {
      encoder_moved = encoder_moved || tensor.values != before.at(name).values;
    }
  }
  EXPECT_TRUE(encoder_moved);
}

TEST_F(Training, AnotherDesignTakesTheWeightsThatFit) {
  const auto wide = trainer(design("two-look"), 12);
  steps(wide.get(), 3);
  const fs::path file = folder_ / "wide.pt";
  ASSERT_TRUE(wide->save(file).ok());
  const auto narrow = trainer(design("two-look-z64"), 12);
  const auto left = narrow->start_from(file);
  ASSERT_TRUE(left.ok()) << left.error();
  EXPECT_THAT(*left, testing::UnorderedElementsAre("second.output.weight", "second.output.bias",
                                                   "decoder.generator.weight", "depth.dense.weight", "normal.weight"));
  EXPECT_EQ(narrow->weights().at("second.conv1.weight").values, wide->weights().at("second.conv1.weight").values);
}

TEST_F(Training, SourcesAreMixedByTheirParts) {
  BatchOptions options = batch_options(design("paper"));
  options.images = 200;
  // The second source is rendered afresh; what differs between the two is the images themselves.
  const std::vector<Source> both = {{dataset_.get(), 1.0, 0}, {nullptr, 3.0, 77}};
  Batch batch;
  make_batch(both, options, 0, &batch);
  int from_set = 0;
  for (std::size_t i = 0; i < 200; ++i) {
    bool found = false;
    for (std::uint64_t k = 0; k < dataset_->size() && !found; ++k) {
      const auto view = dataset_->at(k);
      float sum = 0.0f;
      for (const auto mm : view.clean_mm) sum += 0.001f * static_cast<float>(mm);
      const auto* clean = batch.clean_m.data() + i * kImageSize_px;
      float mine = 0.0f;
      for (int p = 0; p < kImageSize_px; ++p) mine += clean[p];
      found = std::abs(sum - mine) < 1e-4f * sum;
    }
    from_set += found ? 1 : 0;
  }
  EXPECT_GT(from_set, 25);
  EXPECT_LT(from_set, 80);
}

TEST_F(Training, UnknownDesignIsNamed) {
  const auto none = find_design("tree-look");
  ASSERT_FALSE(none.ok());
  EXPECT_THAT(none.error(), testing::AllOf(testing::HasSubstr("'tree-look'"), testing::HasSubstr("'paper'")));
}

TEST_F(Training, MissingDataSetIsNamed) {
  TrainRun run;
  run.data = {{folder_ / "none.h5"}};
  run.folder = folder_ / "none";
  const auto result = train(run);
  ASSERT_FALSE(result.ok());
  EXPECT_THAT(result.error(), testing::HasSubstr("none.h5"));
}

}  // namespace
}  // namespace gatefield::training
