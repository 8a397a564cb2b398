#include "server/training/data/import.h"

#include <Eigen/Geometry>
#include <utility>

#include "common/model/two_look.h"
#include "server/training/data/recording.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;

void set_labels(const Recording& recording, const Isometry3d& X_WC, Sample* sample) {
  std::vector<GateLabel> labels;
  for (const RecordedGate& gate : recording.gates) {
    const Isometry3d X_CG = X_WC.inverse() * gate.X_WG;
    GateLabel label;
    label.p_CG = X_CG.translation().cast<float>();
    label.q_CG = Eigen::Quaterniond(X_CG.linear()).normalized().cast<float>();
    label.shape = gate.shape;
    label.visible_fraction = visible_fraction(dataset_camera(), sample->measured_mm, gate.shape, label.X_CG());
    labels.push_back(label);
  }
  set_gates(std::move(labels), sample);
}

Result<ImportSummary> write_all(const std::vector<Recording>& recordings, DatasetWriter* writer,
                                const std::function<bool(std::uint64_t, std::uint64_t)>& progress) {
  ImportSummary summary;
  std::uint64_t total = 0;
  for (const Recording& recording : recordings) total += recording.frames.size();
  if (const Status room = writer->reserve(total); !room) return room.failure();
  std::vector<float> resampled_m;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const Recording& recording = recordings[r];
    for (const RecordedFrame& frame : recording.frames) {
      const auto depth_m = read_depth(recording, frame);
      if (!depth_m) return depth_m.failure();
      model::resample_nearest(*depth_m, recording.camera.model, dataset_camera(), &resampled_m);
      Sample sample;
      sample.measured_mm.resize(kImageSize_px);
      std::uint64_t returns = 0;
      for (std::size_t i = 0; i < kImageSize_px; ++i) {
        sample.measured_mm[i] = static_cast<std::uint16_t>(resampled_m[i] * 1000.0f + 0.5f);
        returns += sample.measured_mm[i] > 0 ? 1 : 0;
      }
      sample.X_WC = frame.X_WC.cast<float>();
      sample.sequence = static_cast<std::uint32_t>(r);
      sample.time_s = frame.time_s;
      set_labels(recording, frame.X_WC, &sample);
      if (const Status added = writer->append(sample); !added) return added.failure();
      ++summary.frames;
      summary.with_valid_gate += sample.valid_count > 0 ? 1 : 0;
      summary.returns += static_cast<double>(returns) / kImageSize_px / static_cast<double>(total);
      if (progress && !progress(summary.frames, total)) return Error{"the import was stopped"};
    }
  }
  if (const Status closed = writer->close(); !closed) return closed.failure();
  return summary;
}

}  // namespace

Result<ImportSummary> import_recordings(const fs::path& file, const ImportOptions& options,
                                        const std::function<bool(std::uint64_t, std::uint64_t)>& progress) {
  if (options.recordings.empty()) return Error{"no recording is named to import"};
  if (fs::exists(file)) return Error{"data set " + file.string() + " is there already; expected a new file's name"};
  std::vector<Recording> recordings;
  for (const fs::path& folder : options.recordings) {
    auto recording = read_recording(folder);
    if (!recording) return recording.failure();
    recordings.push_back(std::move(recording).value());
  }
  DatasetInfo info;
  info.kind = DatasetKind::kRecording;
  info.note = options.note;
  auto writer = DatasetWriter::open(file, info, {.X_WC = true, .sequence = true, .time = true});
  if (!writer) return writer.failure();
  auto summary = write_all(recordings, &writer.value(), progress);
  if (!summary) {
    std::error_code ignored;
    fs::remove(file, ignored);
  }
  return summary;
}

}  // namespace gatefield::training
