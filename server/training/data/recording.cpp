#include "server/training/data/recording.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <utility>

namespace gatefield::training {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;
using Eigen::Vector3d;

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

/// Lines of a CSV file by the names of their columns.
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
      if (!each) return each.failure();
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

Result<std::vector<RecordedGate>> read_gates(const fs::path& file) {
  auto needed = Table::pose_columns("WG");
  for (const char* name : {"inner_half_m", "outer_half_m", "thickness_m"}) needed.emplace_back(name);
  const auto table = Table::read(file, needed);
  if (!table) return table.failure();
  std::vector<RecordedGate> gates;
  for (std::size_t row = 0; row < table->size(); ++row) {
    RecordedGate gate;
    const auto X_WG = table->pose(row, "WG");
    if (!X_WG) return X_WG.failure();
    gate.X_WG = *X_WG;
    const auto inner = table->value(row, "inner_half_m");
    if (!inner) return inner.failure();
    const auto outer = table->value(row, "outer_half_m");
    if (!outer) return outer.failure();
    const auto thickness = table->value(row, "thickness_m");
    if (!thickness) return thickness.failure();
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

}  // namespace

Error at_line(const std::filesystem::path& file, std::size_t line, const std::string& what) {
  return Error(file.string() + " line " + std::to_string(line) + ": " + what, ErrorCode::kUnreadable);
}

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
    if (!value) return value.failure();
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
  if (const Status valid = validate(camera.model); !valid) return valid.failure().within(file.string() + ": ");
  return camera;
}

Result<Recording> read_recording(const fs::path& folder) {
  if (!fs::is_directory(folder)) return Error{"recording " + folder.string() + " is not a folder"};
  Recording recording;
  recording.folder = folder;
  const auto camera = read_camera(folder / "camera.txt");
  if (!camera) return camera.failure();
  recording.camera = *camera;
  auto gates = read_gates(folder / "gates.csv");
  if (!gates) return gates.failure();
  recording.gates = std::move(gates).value();

  const fs::path poses = folder / "poses.csv";
  auto needed = Table::pose_columns("WC");
  needed.insert(needed.begin(), {"file", "time_s"});
  const auto table = Table::read(poses, needed);
  if (!table) return table.failure();
  for (std::size_t row = 0; row < table->size(); ++row) {
    RecordedFrame frame;
    frame.line = table->line(row);
    frame.image = folder / table->text(row, "file");
    const auto time_s = table->value(row, "time_s");
    if (!time_s) return time_s.failure();
    frame.time_s = *time_s;
    if (row > 0 && !(frame.time_s > recording.frames.back().time_s)) {
      return at_line(poses, frame.line,
                     "time_s is " + table->text(row, "time_s") + ", expected more than the " +
                         table->text(row - 1, "time_s") + " of the line before");
    }
    const auto X_WC = table->pose(row, "WC");
    if (!X_WC) return X_WC.failure();
    frame.X_WC = *X_WC;
    // Looked for now, so that a long import does not end at its last file.
    if (!fs::is_regular_file(frame.image))
      return at_line(poses, frame.line, "the image " + frame.image.string() + " is not there");
    recording.frames.push_back(std::move(frame));
  }
  return recording;
}

Result<std::vector<float>> read_depth_png(const fs::path& file, const RecordedCamera& camera) {
  const auto wrong = [&](const std::string& what) {
    return Error("the image " + file.string() + " " + what, ErrorCode::kUnreadable);
  };
  cv::Mat image;
  try {
    image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    image = cv::Mat();
  }
  if (image.empty()) return wrong("can't be read, expected a PNG");
  if (image.type() != CV_16UC1) {
    return wrong("has " + std::to_string(image.channels()) + " channel(s) of " + std::to_string(8 * image.elemSize1()) +
                 " bits, expected one of 16 bits");
  }
  if (image.cols != camera.model.width_px || image.rows != camera.model.height_px) {
    return wrong("is " + std::to_string(image.cols) + " x " + std::to_string(image.rows) + " pixels, expected " +
                 std::to_string(camera.model.width_px) + " x " + std::to_string(camera.model.height_px) +
                 " as in camera.txt");
  }
  std::vector<float> depth_m(static_cast<std::size_t>(image.cols) * static_cast<std::size_t>(image.rows));
  const auto unit_m = static_cast<float>(camera.unit_m);
  for (int v = 0; v < image.rows; ++v) {
    const auto* row = image.ptr<std::uint16_t>(v);
    for (int u = 0; u < image.cols; ++u) {
      depth_m[static_cast<std::size_t>(v) * static_cast<std::size_t>(image.cols) + static_cast<std::size_t>(u)] =
          unit_m * static_cast<float>(row[u]);
    }
  }
  return depth_m;
}

Result<std::vector<float>> read_depth(const Recording& recording, const RecordedFrame& frame) {
  auto depth_m = read_depth_png(frame.image, recording.camera);
  if (!depth_m) return at_line(recording.folder / "poses.csv", frame.line, depth_m.error());
  cut_to_range(recording.camera.model, &depth_m.value());
  return depth_m;
}

void cut_to_range(const CameraModel& camera, std::vector<float>* depth_m) {
  const auto nearest_m = static_cast<float>(camera.min_depth_m);
  const auto farthest_m = static_cast<float>(camera.max_depth_m);
  for (float& z_m : *depth_m) z_m = z_m >= nearest_m && z_m <= farthest_m ? z_m : 0.0f;
}

}  // namespace gatefield::training
