#include "server/training/data/import.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "common/model/two_look.h"
#include "common/scene/depth_camera.h"
#include "common/scene/world.h"

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;
using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

Error at_line(const fs::path& file, std::size_t line, const std::string& what) {
  return Error{file.string() + " line " + std::to_string(line) + ": " + what};
}

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

Result<double> number(const fs::path& file, std::size_t line, const std::string& name, const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    return at_line(file, line, name + " is '" + text + "', expected a number");
  return value;
}

// --- CSV ----------------------------------------------------------------------------------------------------------

class Table {
 public:
  static Result<Table> read(const fs::path& file, const std::vector<std::string>& needed) {
    std::ifstream in(file);
    if (!in) return Error{file.string() + " can't be opened"};
    Table table;
    table.file_ = file;
    std::string text;
    for (std::size_t line = 1; std::getline(in, text); ++line) {
      if (line == 1 && text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
      if (trimmed(text).empty()) continue;
      std::vector<std::string> values;
      std::istringstream parts(text);
      for (std::string part; std::getline(parts, part, ',');) values.push_back(trimmed(part));
      if (table.columns_.empty()) {
        for (std::size_t i = 0; i < values.size(); ++i) table.columns_.emplace(values[i], i);
        table.width_ = values.size();
        for (const std::string& name : needed) {
          if (!table.has(name)) return at_line(file, line, "column '" + name + "' is missing");
        }
        continue;
      }
      if (values.size() != table.width_) {
        return at_line(file, line,
                       "has " + std::to_string(values.size()) + " values, expected " + std::to_string(table.width_) +
                           " as the first line");
      }
      table.rows_.push_back({line, std::move(values)});
    }
    if (table.rows_.empty()) return Error{file.string() + " has no lines below its column names"};
    return table;
  }

  std::size_t size() const { return rows_.size(); }
  std::size_t line(std::size_t row) const { return rows_[row].line; }
  bool has(const std::string& name) const { return columns_.contains(name); }
  const std::string& text(std::size_t row, const std::string& name) const {
    return rows_[row].values[columns_.at(name)];
  }
  Result<double> value(std::size_t row, const std::string& name) const {
    return number(file_, line(row), name, text(row, name));
  }
  /// Columns p_<frames>_x to q_<frames>_z.
  Result<Isometry3d> pose(std::size_t row, const std::string& frames) const {
    std::array<double, 7> values{};
    for (std::size_t i = 0; i < 7; ++i) {
      const auto each = value(row, pose_columns(frames)[i]);
      if (!each) return Error{each.error()};
      values[i] = *each;
    }
    const Eigen::Quaterniond q(values[3], values[4], values[5], values[6]);
    if (!(std::abs(q.norm() - 1.0) < 0.01)) {
      return at_line(file_, line(row),
                     "the norm of q_" + frames + " is " + std::to_string(q.norm()) + ", expected 1 (w x y z)");
    }
    Isometry3d X = Isometry3d::Identity();
    X.linear() = q.normalized().toRotationMatrix();
    X.translation() = Vector3d(values[0], values[1], values[2]);
    return X;
  }
  static std::vector<std::string> pose_columns(const std::string& frames) {
    std::vector<std::string> names;
    for (const char* axis : {"_x", "_y", "_z"}) names.push_back("p_" + frames + axis);
    for (const char* axis : {"_w", "_x", "_y", "_z"}) names.push_back("q_" + frames + axis);
    return names;
  }

 private:
  struct Row {
    std::size_t line;
    std::vector<std::string> values;
  };
  fs::path file_;
  std::map<std::string, std::size_t> columns_;
  std::size_t width_ = 0;
  std::vector<Row> rows_;
};

// --- One recording ------------------------------------------------------------------------------------------------

struct RecordedCamera {
  CameraModel model;
  double unit_m = 0.001;
};

Result<RecordedCamera> read_camera(const fs::path& file) {
  std::ifstream in(file);
  if (!in) return Error{file.string() + " can't be opened"};
  std::map<std::string, double> values{
      {"min_depth_m", 0.3}, {"max_depth_m", 10.0}, {"depth_unit_m", 0.001}, {"pixel_center", 0.5}};
  std::string text;
  for (std::size_t line = 1; std::getline(in, text); ++line) {
    text = trimmed(text.substr(0, text.find('#')));
    if (text.empty()) continue;
    const auto gap = text.find_first_of(" \t:=");
    const std::string name = text.substr(0, gap);
    const auto begin = gap == std::string::npos ? gap : text.find_first_not_of(" \t:=", gap);
    constexpr std::array kNames{"width_px", "height_px",   "fx_px",       "fy_px",        "cx_px",
                                "cy_px",    "min_depth_m", "max_depth_m", "depth_unit_m", "pixel_center"};
    if (std::ranges::find(kNames, name) == kNames.end()) {
      return at_line(file, line,
                     "'" + name + "' is not known, expected width_px, height_px, fx_px, fy_px, cx_px, " +
                         "cy_px, min_depth_m, max_depth_m, depth_unit_m or pixel_center");
    }
    const auto value = number(file, line, name, begin == std::string::npos ? "" : text.substr(begin));
    if (!value) return Error{value.error()};
    values[name] = *value;
  }
  for (const char* name : {"width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px"}) {
    if (!values.contains(name)) return Error{file.string() + ": " + name + " is missing"};
  }
  for (const char* name : {"width_px", "height_px"}) {
    const double value = values[name];
    if (value != std::floor(value) || value < 1.0 || value > 10'000.0)
      return Error{file.string() + ": " + name + " is " + std::to_string(value) +
                   ", expected a whole number of pixels"};
  }
  RecordedCamera camera;
  camera.model.width_px = static_cast<int>(values["width_px"]);
  camera.model.height_px = static_cast<int>(values["height_px"]);
  camera.model.fx_px = values["fx_px"];
  camera.model.fy_px = values["fy_px"];
  camera.model.cx_px = values["cx_px"] + 0.5 - values["pixel_center"];
  camera.model.cy_px = values["cy_px"] + 0.5 - values["pixel_center"];
  camera.model.min_depth_m = values["min_depth_m"];
  camera.model.max_depth_m = values["max_depth_m"];
  camera.unit_m = values["depth_unit_m"];
  if (!(camera.unit_m >= 1e-6 && camera.unit_m <= 0.1)) {
    return Error{file.string() + ": depth_unit_m is " + std::to_string(camera.unit_m) +
                 ", expected 0.000001 to 0.1 m per grey level"};
  }
  if (values["pixel_center"] != 0.0 && values["pixel_center"] != 0.5) {
    return Error{file.string() + ": pixel_center is " + std::to_string(values["pixel_center"]) + ", expected 0.5 or 0"};
  }
  if (const Status valid = validate(camera.model); !valid) return Error{file.string() + ": " + valid.error()};
  return camera;
}

struct RecordedGate {
  Isometry3d X_WG;
  GateShape shape;
};

Result<std::vector<RecordedGate>> read_gates(const fs::path& file) {
  auto needed = Table::pose_columns("WG");
  for (const char* name : {"inner_half_m", "outer_half_m", "thickness_m"}) needed.emplace_back(name);
  const auto table = Table::read(file, needed);
  if (!table) return Error{table.error()};
  std::vector<RecordedGate> gates;
  for (std::size_t row = 0; row < table->size(); ++row) {
    RecordedGate gate;
    const auto X_WG = table->pose(row, "WG");
    if (!X_WG) return Error{X_WG.error()};
    gate.X_WG = *X_WG;
    const auto inner = table->value(row, "inner_half_m");
    if (!inner) return Error{inner.error()};
    const auto outer = table->value(row, "outer_half_m");
    if (!outer) return Error{outer.error()};
    const auto thickness = table->value(row, "thickness_m");
    if (!thickness) return Error{thickness.error()};
    gate.shape.inner_half_m = *inner;
    gate.shape.outer_half_m = *outer;
    gate.shape.thickness_m = *thickness;
    if (table->has("opening")) {
      const std::string& opening = table->text(row, "opening");
      if (opening != "square" && opening != "round")
        return at_line(file, table->line(row), "opening is '" + opening + "', expected square or round");
      gate.shape.opening = opening == "round" ? GateShape::Opening::kRound : GateShape::Opening::kSquare;
    }
    if (const Status valid = validate(gate.shape); !valid) return at_line(file, table->line(row), valid.error());
    gates.push_back(gate);
  }
  return gates;
}

struct RecordedFrame {
  fs::path image;
  std::size_t line = 0;
  double time_s = 0.0;
  Isometry3d X_WC;
};

struct Recording {
  fs::path folder;
  RecordedCamera camera;
  std::vector<RecordedGate> gates;
  std::vector<RecordedFrame> frames;
};

Result<Recording> read_recording(const fs::path& folder) {
  if (!fs::is_directory(folder)) return Error{"recording " + folder.string() + " is not a folder"};
  Recording recording;
  recording.folder = folder;
  const auto camera = read_camera(folder / "camera.txt");
  if (!camera) return Error{camera.error()};
  recording.camera = *camera;
  auto gates = read_gates(folder / "gates.csv");
  if (!gates) return Error{gates.error()};
  recording.gates = std::move(gates).value();

  const fs::path poses = folder / "poses.csv";
  auto needed = Table::pose_columns("WC");
  needed.insert(needed.begin(), {"file", "time_s"});
  const auto table = Table::read(poses, needed);
  if (!table) return Error{table.error()};
  for (std::size_t row = 0; row < table->size(); ++row) {
    RecordedFrame frame;
    frame.line = table->line(row);
    frame.image = folder / table->text(row, "file");
    const auto time_s = table->value(row, "time_s");
    if (!time_s) return Error{time_s.error()};
    frame.time_s = *time_s;
    if (row > 0 && !(frame.time_s > recording.frames.back().time_s)) {
      return at_line(poses, frame.line,
                     "time_s is " + table->text(row, "time_s") + ", expected more than the " +
                         table->text(row - 1, "time_s") + " of the line before");
    }
    const auto X_WC = table->pose(row, "WC");
    if (!X_WC) return Error{X_WC.error()};
    frame.X_WC = *X_WC;
    // Looked for now, so that a long import does not end at its last file.
    if (!fs::is_regular_file(frame.image))
      return at_line(poses, frame.line, "the image " + frame.image.string() + " is not there");
    recording.frames.push_back(std::move(frame));
  }
  return recording;
}

Result<std::vector<float>> read_depth(const Recording& recording, const RecordedFrame& frame) {
  const CameraModel& camera = recording.camera.model;
  cv::Mat image;
  try {
    image = cv::imread(frame.image.string(), cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    image = cv::Mat();
  }
  const fs::path poses = recording.folder / "poses.csv";
  if (image.empty())
    return at_line(poses, frame.line, "the image " + frame.image.string() + " can't be read, expected a PNG");
  if (image.type() != CV_16UC1) {
    return at_line(poses, frame.line,
                   "the image " + frame.image.string() + " has " + std::to_string(image.channels()) +
                       " channel(s) of " + std::to_string(8 * image.elemSize1()) + " bits, expected one of 16 bits");
  }
  if (image.cols != camera.width_px || image.rows != camera.height_px) {
    return at_line(poses, frame.line,
                   "the image " + frame.image.string() + " is " + std::to_string(image.cols) + " x " +
                       std::to_string(image.rows) + " pixels, expected " + std::to_string(camera.width_px) + " x " +
                       std::to_string(camera.height_px) + " as in camera.txt");
  }
  std::vector<float> depth_m(static_cast<std::size_t>(image.cols) * static_cast<std::size_t>(image.rows));
  const auto unit_m = static_cast<float>(recording.camera.unit_m);
  const auto nearest_m = static_cast<float>(camera.min_depth_m);
  const auto farthest_m = static_cast<float>(camera.max_depth_m);
  for (int v = 0; v < image.rows; ++v) {
    const auto* row = image.ptr<std::uint16_t>(v);
    for (int u = 0; u < image.cols; ++u) {
      const float z_m = unit_m * static_cast<float>(row[u]);
      depth_m[static_cast<std::size_t>(v) * static_cast<std::size_t>(image.cols) + static_cast<std::size_t>(u)] =
          z_m >= nearest_m && z_m <= farthest_m ? z_m : 0.0f;
    }
  }
  return depth_m;
}

/// Labels of one frame: of all gates the four that a sample has room for, valid ones and near ones first.
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
  std::ranges::stable_sort(labels, [](const GateLabel& a, const GateLabel& b) {
    if (a.valid() != b.valid()) return a.valid();
    return a.p_CG.squaredNorm() < b.p_CG.squaredNorm();
  });
  sample->gate_count = static_cast<int>(std::min<std::size_t>(labels.size(), kMaxGates));
  std::copy_n(labels.begin(), sample->gate_count, sample->gates.begin());
  sort_gates(sample);
}

Result<ImportSummary> write_all(const std::vector<Recording>& recordings, DatasetWriter* writer,
                                const std::function<bool(std::uint64_t, std::uint64_t)>& progress) {
  ImportSummary summary;
  std::uint64_t total = 0;
  for (const Recording& recording : recordings) total += recording.frames.size();
  if (const Status room = writer->reserve(total); !room) return Error{room.error()};
  std::vector<float> resampled_m;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const Recording& recording = recordings[r];
    for (const RecordedFrame& frame : recording.frames) {
      const auto depth_m = read_depth(recording, frame);
      if (!depth_m) return Error{depth_m.error()};
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
      if (const Status added = writer->append(sample); !added) return Error{added.error()};
      ++summary.frames;
      summary.with_valid_gate += sample.valid_count > 0 ? 1 : 0;
      summary.returns += static_cast<double>(returns) / kImageSize_px / static_cast<double>(total);
      if (progress && !progress(summary.frames, total)) return Error{"the import was stopped"};
    }
  }
  if (const Status closed = writer->close(); !closed) return Error{closed.error()};
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
    if (!recording) return Error{recording.error()};
    recordings.push_back(std::move(recording).value());
  }
  DatasetInfo info;
  info.kind = DatasetKind::kRecording;
  info.note = options.note;
  auto writer = DatasetWriter::open(file, info, {.X_WC = true, .sequence = true, .time = true});
  if (!writer) return Error{writer.error()};
  auto summary = write_all(recordings, &writer.value(), progress);
  if (!summary) {
    std::error_code ignored;
    fs::remove(file, ignored);
  }
  return summary;
}

Status write_example_recording(const fs::path& folder, int frames) {
  if (frames < 2) return Error{"an example recording of " + std::to_string(frames) + " frames, expected at least 2"};
  std::error_code code;
  fs::create_directories(folder / "depth", code);
  if (code) return Error{"folder " + folder.string() + " can't be made: " + code.message()};

  scene::World world;
  world.floor_z_m = 0.0;
  world.gates.resize(2);
  world.gates[0].X_WG.translation() = Vector3d(5.0, 0.3, 1.4);
  world.gates[0].X_WG.linear() = AngleAxisd(0.35, Vector3d::UnitZ()).toRotationMatrix();
  world.gates[1].X_WG.translation() = Vector3d(9.0, -1.4, 1.6);
  world.gates[1].X_WG.linear() = AngleAxisd(-0.6, Vector3d::UnitZ()).toRotationMatrix();
  scene::Box wall;
  wall.X_WO.translation() = Vector3d(13.0, 0.0, 2.0);
  wall.half_m = Vector3d(0.1, 8.0, 2.0);
  world.boxes.push_back(wall);
  scene::DepthCamera renderer(world);
  const CameraModel camera =
      camera_from_fov(424, 240, 87.0 * std::numbers::pi / 180.0, 58.0 * std::numbers::pi / 180.0);

  std::ofstream intrinsics(folder / "camera.txt", std::ios::trunc);
  intrinsics << "# depth camera; a pixel's centre lies at +0.5 (pixel_center 0: intrinsics of OpenCV, ROS, RealSense)\n"
             << "width_px " << camera.width_px << "\nheight_px " << camera.height_px << '\n';
  char line[256];
  std::snprintf(line, sizeof line, "fx_px %.9g\nfy_px %.9g\ncx_px %.9g\ncy_px %.9g\ndepth_unit_m 0.001\n", camera.fx_px,
                camera.fy_px, camera.cx_px, camera.cy_px);
  intrinsics << line << "min_depth_m 0.3\nmax_depth_m 10\n";

  const auto pose_text = [&](const Isometry3d& X) -> std::string {
    const Vector3d p = X.translation();
    const Eigen::Quaterniond q(X.linear());
    std::snprintf(line, sizeof line, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g", p.x(), p.y(), p.z(), q.w(), q.x(), q.y(),
                  q.z());
    return line;
  };
  std::ofstream gates(folder / "gates.csv", std::ios::trunc);
  gates << "p_WG_x,p_WG_y,p_WG_z,q_WG_w,q_WG_x,q_WG_y,q_WG_z,inner_half_m,outer_half_m,thickness_m,opening\n";
  for (const scene::Gate& gate : world.gates) {
    const std::string pose = pose_text(gate.X_WG);
    std::snprintf(line, sizeof line, "%g,%g,%g,square", gate.shape.inner_half_m, gate.shape.outer_half_m,
                  gate.shape.thickness_m);
    gates << pose << ',' << line << '\n';
  }

  std::ofstream poses(folder / "poses.csv", std::ios::trunc);
  poses << "file,time_s,p_WC_x,p_WC_y,p_WC_z,q_WC_w,q_WC_x,q_WC_y,q_WC_z\n";
  for (int i = 0; i < frames; ++i) {
    const double part = static_cast<double>(i) / (frames - 1);
    Isometry3d X_WB = Isometry3d::Identity();
    X_WB.translation() = Vector3d(3.2 * part, 0.8 * std::sin(2.0 * part) - 0.5, 1.2 + 0.3 * part);
    X_WB.linear() = (AngleAxisd(0.15 - 0.2 * part, Vector3d::UnitZ()) * AngleAxisd(0.25, Vector3d::UnitY()) *
                     AngleAxisd(0.3 * std::sin(4.0 * part), Vector3d::UnitX()))
                        .toRotationMatrix();
    const Isometry3d X_WC = X_WB * dataset_camera().X_BC;
    scene::DepthImage image;
    renderer.render(camera, X_WC, &image);
    cv::Mat depth_mm(camera.height_px, camera.width_px, CV_16UC1);
    for (int v = 0; v < camera.height_px; ++v) {
      for (int u = 0; u < camera.width_px; ++u) {
        const float z_m = image.depth_m[static_cast<std::size_t>(v * camera.width_px + u)];
        depth_mm.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(z_m * 1000.0f + 0.5f);
      }
    }
    char name[32];
    std::snprintf(name, sizeof name, "depth/%06d.png", i);
    bool written = false;
    try {
      written = cv::imwrite((folder / name).string(), depth_mm);
    } catch (const cv::Exception&) {
      written = false;
    }
    if (!written) return Error{"image " + (folder / name).string() + " can't be written"};
    const std::string pose = pose_text(X_WC);
    std::snprintf(line, sizeof line, "%.6f", i / 60.0);
    poses << name << ',' << line << ',' << pose << '\n';
  }
  for (std::ofstream* each : {&intrinsics, &gates, &poses}) {
    each->close();
    if (!*each) return Error{"a file of the recording " + folder.string() + " can't be written"};
  }
  return {};
}

}  // namespace gatefield::training
