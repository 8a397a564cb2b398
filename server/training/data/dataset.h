#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/random.h"
#include "common/base/result.h"
#include "common/geometry/camera.h"
#include "common/geometry/gate.h"
#include "common/scene/depth_camera.h"
#include "common/scene/sensor_noise.h"

/// What the networks are trained on: rendered depth images of gates among clutter, with the true gate poses.
/// Nothing here includes libtorch.
namespace gatefield::training {

inline constexpr int kImageWidth_px = 160;
inline constexpr int kImageHeight_px = 90;
inline constexpr int kImageSize_px = kImageWidth_px * kImageHeight_px;
inline constexpr int kMaxGates = 4;
/// A gate counts as seen (valid) when at least this part of its frame's midline shows in the clean image.
inline constexpr float kValidVisibleFraction = 0.25f;

/// A true gate of a sample. Frame C is the camera's (optical), G the gate's (x through the opening).
struct GateLabel {
  Eigen::Vector3f p_CG = Eigen::Vector3f::Zero();            ///< centre of the opening, metres
  Eigen::Quaternionf q_CG = Eigen::Quaternionf::Identity();  ///< gate's axes in the camera frame
  float visible_fraction = 0.0f;                             ///< see visible_fraction()
  GateShape shape;

  bool valid() const noexcept { return visible_fraction >= kValidVisibleFraction; }
  Eigen::Isometry3f X_CG() const noexcept {
    Eigen::Isometry3f X = Eigen::Isometry3f::Identity();
    X.linear() = q_CG.toRotationMatrix();
    X.translation() = p_CG;
    return X;
  }
};

/// One image as it lies in memory or in a mapped file; copying it copies no pixels. Pixels are row-major, kImageSize_px
/// of them, or none where the kind of data set has no such image.
struct SampleView {
  std::span<const std::uint16_t> clean_mm;  ///< z-depth without noise in millimetres, 0 = no return; or empty
  std::span<const std::uint8_t> surface;  ///< high 4 bits: cosine of incidence * 15, low 4: reflectance * 15; or empty
  std::span<const std::uint16_t> measured_mm;  ///< what a sensor gave, millimetres, 0 = no return; empty in simulation
  std::array<GateLabel, kMaxGates> gates;      ///< valid ones first, nearest first within each kind
  int gate_count = 0;                          ///< gates of the right size that exist in the world, in view or not
  int valid_count = 0;                         ///< of these, how many are valid: gates[0 .. valid_count - 1]

  std::optional<Eigen::Isometry3f> X_WC;  ///< the camera's pose, where the set has it
  std::optional<std::uint32_t> sequence;  ///< the flight or room that the frame belongs to
  std::optional<double> time_s;           ///< within the sequence
  std::span<const float> points_C;        ///< stored query points [P][3], metres, camera frame; or empty
  std::span<const float> sdf_m;           ///< [P], the target's field at them; NaN without a valid gate

  /// The nearest valid gate, or nullptr when none is in view.
  const GateLabel* target() const noexcept { return valid_count > 0 ? &gates[0] : nullptr; }
  /// The depth that labels are judged by: clean, or measured where there is no clean image.
  std::span<const std::uint16_t> reference_mm() const noexcept { return clean_mm.empty() ? measured_mm : clean_mm; }
};

/// A sample that owns its pixels; members as in SampleView.
struct Sample {
  std::vector<std::uint16_t> clean_mm;
  std::vector<std::uint8_t> surface;
  std::vector<std::uint16_t> measured_mm;
  std::array<GateLabel, kMaxGates> gates;
  int gate_count = 0;
  int valid_count = 0;
  std::optional<Eigen::Isometry3f> X_WC;
  std::optional<std::uint32_t> sequence;
  std::optional<double> time_s;
  std::vector<float> points_C;
  std::vector<float> sdf_m;

  SampleView view() const noexcept {
    return {clean_mm, surface, measured_mm, gates, gate_count, valid_count, X_WC, sequence, time_s, points_C, sdf_m};
  }
};

/// Puts gates[0 .. gate_count - 1] into the order that a sample has them in and counts the valid ones.
/// @pre 0 <= sample->gate_count <= kMaxGates
void sort_gates(Sample* sample);
void sort_gates(SampleView* sample);
/// Gives the sample its gates in order: of more than it has room for, the valid ones first, then the nearest.
void set_gates(std::vector<GateLabel> gates, Sample* sample);

/// The camera of every sample: default_camera().
const CameraModel& dataset_camera();

/// Makes sample `index` of the set named by `seed`, from (seed, index) alone: poses all over the approach volume of a
/// target gate (0.4 to 10 m, up to 80 deg off its axis from either side, attitudes as in racing), one to four gates,
/// clutter; about a fifth of the samples show no valid gate.
/// @param round_part of the gates have round openings. @param rendered  dataset_camera(), or the same that sees beyond
/// its range for the noise's sake (scene::rendered_camera()). Thread-safe: yes.   Real-time safe: no.
Sample generate(std::uint64_t seed, std::uint64_t index, double round_part = 0.0,
                const CameraModel& rendered = dataset_camera());

/// The part of 64 points on the frame's midline (half-way between inner and outer edge, x = 0) that the image shows:
/// inside the image and the depth range, with the image's depth within 0.15 m of the point's.
/// @param clean_mm row-major depth of `camera`, millimetres
float visible_fraction(const CameraModel& camera, std::span<const std::uint16_t> clean_mm, const GateShape& shape,
                       const Eigen::Isometry3f& X_CG);

/// Marks the pixels that show the gate's frame: mask[i] = 1 when the clean pixel's point lies in the frame's solid
/// grown by 0.03 m, else 0. For segmentation targets. On the measured depth where there is no clean one.
/// @pre mask.size() == kImageSize_px
/// Thread-safe: yes.
void frame_mask(const SampleView& sample, const GateLabel& gate, std::span<std::uint8_t> mask);

/// Draws the sensor's noise over a sample afresh. A sample with a measured image is given as measured: its sensor's
/// noise is in it already, nothing is drawn.
/// @param noisy_m z-depth in metres, 0 = no return; kImageSize_px values
/// Thread-safe: yes (each thread with its own `random`).   Real-time safe: allocates on a thread's first call.
void draw_noisy(const SampleView& sample, const scene::SensorNoise& noise, Random* random, std::span<float> noisy_m);
/// The same without noise; zeros when the sample has no clean image (recordings).
void draw_clean(const SampleView& sample, std::span<float> clean_m);

// --- The file: HDF5, docs/datasets.md has the schema and how to write one with h5py --------------------------------

/// Where a set's images come from, and so what each sample has.
enum class DatasetKind {
  kSimulation,  ///< clean depth and surface; noise is drawn afresh whenever a sample is used
  kStereo,      ///< clean and measured depth (a simulated sensor of another kind)
  kRecording,   ///< measured depth of a real sensor
};
/// "simulation", "stereo", "recording": the root attribute `kind`.
const char* name(DatasetKind kind) noexcept;

/// What names a set.
struct DatasetInfo {
  DatasetKind kind = DatasetKind::kSimulation;
  std::uint64_t seed = 0;
  std::uint64_t first_index = 0;
  std::string note = {};    ///< for people
  double round_part = 0.0;  ///< of the simulated gates
};

/// What a set has beside what its kind has in any case.
struct DatasetColumns {
  bool X_WC = false;
  bool sequence = false;
  bool time = false;
  int points = 0;  ///< stored query points an image, 0 to 1'000'000
};

/// Creates such a file, or continues one.
///
/// What is on disk is whole at every moment, also when the process is killed: HDF5 lays the file out with room for
/// reserve()d samples and is closed; samples then go straight to their places, and the number of whole samples
/// (`written`) is stored after them. Making more room is prepared by a copy of the file's few kilobytes of structure in
/// <file>.journal; the next DatasetWriter puts them back if it was cut short. One writer a file at a time.
/// Thread-safe: no.   Real-time safe: no.
class DatasetWriter {
 public:
  /// Creates the file (and its folder) or opens it to append to it.
  /// Errors: folder or file can't be written; file of another format, kind, seed, first index, camera or other columns;
  /// being written by somebody else; its storage compressed or contiguous.
  static Result<DatasetWriter> open(const std::filesystem::path& file, const DatasetInfo& info,
                                    const DatasetColumns& columns = {});
  /// flush() without its error.
  ~DatasetWriter();
  DatasetWriter(DatasetWriter&&) noexcept;
  DatasetWriter& operator=(DatasetWriter&&) noexcept;

  /// Makes room for `count` samples in all; does nothing when there is enough. Not needed: append() grows the file by
  /// itself, but the final layout (not the content) depends on it.
  Status reserve(std::uint64_t count);
  /// Adds a sample to a block of 256 in memory, written when full. Must have what the kind and columns ask for, finite
  /// poses and gates in order (sort_gates). Errors: what is missing or wrong in the sample, disk full.
  Status append(const Sample& sample);
  /// Writes what is in memory; from then on Dataset::open() sees it.
  Status flush();
  /// flush(), and room that was never used is given back. The writer can't be used any more.
  Status close();
  /// Samples in the file and in memory.
  std::uint64_t count() const noexcept;
  /// As the file has it.
  const DatasetInfo& info() const noexcept;

 private:
  struct State;
  explicit DatasetWriter(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

/// What generate_dataset() reports while it runs.
struct Progress {
  std::uint64_t done_n = 0;
  std::uint64_t total_n = 0;
  double rate_hz = 0.0;  ///< samples per second in this run
  double time_left_s = 0.0;
};

struct DatasetOptions {
  std::uint64_t seed = 1;
  std::uint64_t first_index = 0;  ///< record i of the file is generate(seed, first_index + i)
  std::uint64_t count = 250'000;
  int threads = 2;
  double round_part = 0.0;  ///< of the gates, 0 to 1; another one makes another set
  int points = 0;  ///< stored query points an image (SamplingMix's defaults); 0: none, ours are drawn at every pass
};

/// Fills the file with `count` samples of kind kSimulation. A file that is there already and has the same seed, first
/// index, format, camera and points is continued where it stopped; one that is long enough is left as it is. A run that
/// was stopped or killed and is repeated leaves the same bytes as one that was not. `progress` is called from the
/// calling thread after every 256 samples; it returns false to stop (the file stays usable). Errors: folder or file
/// can't be written, disk full, file of another kind, another set or other scenes.
Status generate_dataset(const std::filesystem::path& file, const DatasetOptions& options,
                        const std::function<bool(const Progress&)>& progress = {});

/// Random access to such a file. Images that lie in it uncompressed are memory-mapped (the kernel's page cache is the
/// cache); what is compressed, converted or chunked across images is read into memory when opened, up to 4 GiB.
/// Thread-safe: yes (const).
class Dataset {
 public:
  /// Checks the schema, the camera and every label. A file still being written can be opened: size() is the number of
  /// whole samples at that moment.
  /// Errors: file missing, no HDF5, other format or version, cut short, other camera, a data set missing or of another
  /// shape or type, a label that can't be: a sentence with the data set, the frame, the value and what was expected.
  static Result<Dataset> open(const std::filesystem::path& file);
  ~Dataset();
  Dataset(Dataset&&) noexcept;
  Dataset& operator=(Dataset&&) noexcept;

  std::uint64_t size() const noexcept;
  const DatasetInfo& info() const noexcept;
  DatasetKind kind() const noexcept { return info().kind; }
  std::uint64_t seed() const noexcept { return info().seed; }
  std::uint64_t first_index() const noexcept { return info().first_index; }
  const DatasetColumns& columns() const noexcept;
  /// True when all images are used where they lie in the file; false when some had to be read into memory.
  bool mapped() const noexcept;
  /// @pre index < size(). The view's spans live as long as this object.
  SampleView at(std::uint64_t index) const noexcept;

 private:
  struct Content;
  explicit Dataset(std::unique_ptr<Content> content) noexcept;
  std::unique_ptr<Content> content_;
};

}  // namespace gatefield::training
