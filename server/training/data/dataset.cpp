#include "server/training/data/dataset.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>

#include "common/base/multiversion.h"
#include "server/training/data/scenes.h"

namespace gatefield::training {
namespace {

using Eigen::Isometry3d;

std::uint8_t pack_surface(float cosine, float reflectance) {
  const auto high = static_cast<unsigned>(cosine * 15.0f + 0.5f);
  const auto low = static_cast<unsigned>(reflectance * 15.0f + 0.5f);
  return static_cast<std::uint8_t>(std::min(high, 15u) << 4 | std::min(low, 15u));
}

template <typename Container>
void sort_labels(Container* gates, int gate_count, int* valid_count) {
  std::sort(gates->begin(), gates->begin() + gate_count, [](const GateLabel& a, const GateLabel& b) {
    if (a.valid() != b.valid()) return a.valid();
    return a.p_CG.squaredNorm() < b.p_CG.squaredNorm();
  });
  *valid_count = static_cast<int>(
      std::count_if(gates->begin(), gates->begin() + gate_count, [](const GateLabel& gate) { return gate.valid(); }));
}

// --- The file. Little-endian, fixed-size records after one header; the number of records follows from the file's
// length. ---------

constexpr char kMagic[8] = {'G', 'F', 'D', 'A', 'T', 'A', 'S', 'T'};
constexpr std::uint32_t kVersion = 1;  ///< raise when the record or any distribution above changes

struct FileHeader {
  char magic[8];
  std::uint32_t version;
  std::uint32_t record_bytes;
  std::uint64_t seed;
  std::uint64_t first_index;
  std::uint32_t width_px;
  std::uint32_t height_px;
  double camera[6];  ///< fx, fy, cx, cy in pixels, smallest and largest depth in metres
  std::uint8_t reserved[40];
};
static_assert(sizeof(FileHeader) == 128 && std::is_trivially_copyable_v<FileHeader>);

struct GateRecord {
  float p_CG[3];
  float q_CG_xyzw[4];
  float visible_fraction;
  float inner_half_m;
  float outer_half_m;
  float thickness_m;
  std::uint32_t opening;
};
static_assert(sizeof(GateRecord) == 48);

struct Record {
  std::uint16_t clean_mm[kImageSize_px];
  std::uint8_t surface[kImageSize_px];
  GateRecord gates[kMaxGates];
  std::int32_t gate_count;
  std::int32_t valid_count;
  std::uint8_t reserved[24];
};
static_assert(sizeof(Record) % 32 == 0 && std::is_trivially_copyable_v<Record>);

FileHeader make_header(std::uint64_t seed, std::uint64_t first_index) {
  const CameraModel& camera = dataset_camera();
  FileHeader header{};
  std::copy_n(kMagic, 8, header.magic);
  header.version = kVersion;
  header.record_bytes = sizeof(Record);
  header.seed = seed;
  header.first_index = first_index;
  header.width_px = static_cast<std::uint32_t>(camera.width_px);
  header.height_px = static_cast<std::uint32_t>(camera.height_px);
  const double values[6] = {camera.fx_px, camera.fy_px,       camera.cx_px,
                            camera.cy_px, camera.min_depth_m, camera.max_depth_m};
  std::copy_n(values, 6, header.camera);
  return header;
}

void store(const Sample& sample, Record* record) {
  *record = Record{};
  std::copy_n(sample.clean_mm.begin(), kImageSize_px, record->clean_mm);
  std::copy_n(sample.surface.begin(), kImageSize_px, record->surface);
  record->gate_count = sample.gate_count;
  record->valid_count = sample.valid_count;
  for (std::size_t i = 0; i < static_cast<std::size_t>(sample.gate_count); ++i) {
    const GateLabel& gate = sample.gates[i];
    GateRecord& out = record->gates[i];
    std::copy_n(gate.p_CG.data(), 3, out.p_CG);
    std::copy_n(gate.q_CG.coeffs().data(), 4, out.q_CG_xyzw);
    out.visible_fraction = gate.visible_fraction;
    out.inner_half_m = static_cast<float>(gate.shape.inner_half_m);
    out.outer_half_m = static_cast<float>(gate.shape.outer_half_m);
    out.thickness_m = static_cast<float>(gate.shape.thickness_m);
    out.opening = gate.shape.opening == GateShape::Opening::kRound ? 1 : 0;
  }
}

Error file_error(const std::filesystem::path& file, const std::string& what) {
  return Error{"data set " + file.string() + ": " + what};
}
Error system_error(const std::filesystem::path& file, const char* what) {
  return file_error(file, std::string(what) + ": " + std::strerror(errno));
}

Status check_header(const std::filesystem::path& file, const FileHeader& header) {
  if (!std::equal(kMagic, kMagic + 8, header.magic)) return file_error(file, "is not a Gatefield data set");
  if (header.version != kVersion) {
    return file_error(file, "has format version " + std::to_string(header.version) + ", expected " +
                                std::to_string(kVersion) + "; delete it to have it made again");
  }
  const FileHeader expected = make_header(header.seed, header.first_index);
  if (std::memcmp(&header, &expected, sizeof(FileHeader)) != 0) {
    return file_error(file, "was made for another camera or record size (" + std::to_string(header.width_px) + " x " +
                                std::to_string(header.height_px) + " px, " + std::to_string(header.record_bytes) +
                                " bytes a record), expected " + std::to_string(expected.width_px) + " x " +
                                std::to_string(expected.height_px) + " px, " + std::to_string(expected.record_bytes) +
                                " bytes");
  }
  return {};
}

/// Closes what open() gave.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

bool write_all(int descriptor, const void* data, std::size_t size) {
  const char* next = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::write(descriptor, next, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    next += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

}  // namespace

const CameraModel& dataset_camera() {
  static const CameraModel camera = default_camera();
  return camera;
}

float visible_fraction(const CameraModel& camera, std::span<const std::uint16_t> clean_mm, const GateShape& shape,
                       const Eigen::Isometry3f& X_CG) {
  constexpr int kPoints = 64;
  constexpr float kTolerance_m = 0.15f;
  const auto middle_m = static_cast<float>(0.5 * (shape.inner_half_m + shape.outer_half_m));
  int seen = 0;
  for (int k = 0; k < kPoints; ++k) {
    Eigen::Vector3f p_G;
    if (shape.opening == GateShape::Opening::kRound) {
      const float angle_rad = 2.0f * std::numbers::pi_v<float> * static_cast<float>(k) / kPoints;
      p_G = {0.0f, middle_m * std::cos(angle_rad), middle_m * std::sin(angle_rad)};
    } else {
      constexpr int kPerSide = kPoints / 4;
      const int side = k / kPerSide;
      const float along_m = middle_m * (2.0f * (static_cast<float>(k % kPerSide) + 0.5f) / kPerSide - 1.0f);
      const float across_m = side < 2 ? middle_m : -middle_m;
      p_G = side % 2 == 0 ? Eigen::Vector3f(0.0f, across_m, along_m) : Eigen::Vector3f(0.0f, along_m, across_m);
    }
    const Eigen::Vector3f p_C = X_CG * p_G;
    if (!camera.sees(p_C.cast<double>())) continue;
    const auto u = static_cast<int>(camera.fx_px * p_C.x() / p_C.z() + camera.cx_px);
    const auto v = static_cast<int>(camera.fy_px * p_C.y() / p_C.z() + camera.cy_px);
    const float shown_m = 0.001f * static_cast<float>(clean_mm[static_cast<std::size_t>(v * camera.width_px + u)]);
    if (shown_m > 0.0f && std::abs(shown_m - p_C.z()) <= kTolerance_m) ++seen;
  }
  return static_cast<float>(seen) / kPoints;
}

Sample generate(std::uint64_t seed, std::uint64_t index) {
  const CameraModel& camera = dataset_camera();
  Random random(seed, index);
  const Scenario scenario = draw_scenario(camera, &random);

  static thread_local scene::DepthImage image;
  static thread_local scene::SurfaceImage surface;
  scene::DepthCamera(scenario.world).render(camera, scenario.X_WC, &image, &surface);

  Sample sample;
  sample.clean_mm.resize(kImageSize_px);
  sample.surface.resize(kImageSize_px);
  for (std::size_t i = 0; i < kImageSize_px; ++i) {
    sample.clean_mm[i] = static_cast<std::uint16_t>(image.depth_m[i] * 1000.0f + 0.5f);
    sample.surface[i] = pack_surface(surface.cos_incidence[i], surface.reflectance[i]);
  }
  const Isometry3d X_CW = scenario.X_WC.inverse();
  sample.gate_count = static_cast<int>(std::min<std::size_t>(scenario.gates, kMaxGates));
  for (std::size_t i = 0; i < static_cast<std::size_t>(sample.gate_count); ++i) {
    const Isometry3d X_CG = X_CW * scenario.world.gates[i].X_WG;
    GateLabel& label = sample.gates[i];
    label.p_CG = X_CG.translation().cast<float>();
    label.q_CG = Eigen::Quaterniond(X_CG.linear()).normalized().cast<float>();
    label.shape = scenario.world.gates[i].shape;
    label.visible_fraction = visible_fraction(camera, sample.clean_mm, label.shape, label.X_CG());
  }
  sort_labels(&sample.gates, sample.gate_count, &sample.valid_count);
  return sample;
}

void frame_mask(const SampleView& sample, const GateLabel& gate, std::span<std::uint8_t> mask) {
  constexpr float kGrow_m = 0.03f;
  const CameraModel& camera = dataset_camera();
  const Eigen::Matrix3f R_GC = gate.q_CG.conjugate().toRotationMatrix();
  const Eigen::Vector3f p_GC = -(R_GC * gate.p_CG);
  const float half_x_m = static_cast<float>(0.5 * gate.shape.thickness_m) + kGrow_m;
  const float inner_m = static_cast<float>(gate.shape.inner_half_m) - kGrow_m;
  const float outer_m = static_cast<float>(gate.shape.outer_half_m) + kGrow_m;
  const bool round = gate.shape.opening == GateShape::Opening::kRound;
  for (int v = 0; v < kImageHeight_px; ++v) {
    const auto ray_y = static_cast<float>((v + 0.5 - camera.cy_px) / camera.fy_px);
    for (int u = 0; u < kImageWidth_px; ++u) {
      const auto i = static_cast<std::size_t>(v * kImageWidth_px + u);
      const auto ray_x = static_cast<float>((u + 0.5 - camera.cx_px) / camera.fx_px);
      const float z_m = 0.001f * static_cast<float>(sample.clean_mm[i]);
      const Eigen::Vector3f p_G = z_m * (ray_x * R_GC.col(0) + ray_y * R_GC.col(1) + R_GC.col(2)) + p_GC;
      const float transverse_m = round ? std::hypot(p_G.y(), p_G.z()) : std::max(std::abs(p_G.y()), std::abs(p_G.z()));
      const bool on_frame =
          z_m > 0.0f && std::abs(p_G.x()) <= half_x_m && transverse_m >= inner_m && transverse_m <= outer_m;
      mask[i] = on_frame ? 1 : 0;
    }
  }
}

namespace {

GATEFIELD_MULTIVERSION void to_metres(const std::uint16_t* depth_mm, float* depth_m) {
  for (std::size_t i = 0; i < kImageSize_px; ++i) depth_m[i] = 0.001f * static_cast<float>(depth_mm[i]);
}

GATEFIELD_MULTIVERSION void unpack_surface(const std::uint8_t* surface, float* cosine, float* reflectance) {
  for (std::size_t i = 0; i < kImageSize_px; ++i) {
    cosine[i] = static_cast<float>(surface[i] >> 4) * (1.0f / 15.0f);
    reflectance[i] = static_cast<float>(surface[i] & 15) * (1.0f / 15.0f);
  }
}

}  // namespace

void draw_clean(const SampleView& sample, std::span<float> clean_m) {
  to_metres(sample.clean_mm.data(), clean_m.data());
}

void draw_noisy(const SampleView& sample, const scene::SensorNoise& noise, Random* random, std::span<float> noisy_m) {
  static thread_local scene::DepthImage clean;
  static thread_local scene::SurfaceImage surface;
  static thread_local scene::DepthImage noisy;
  clean.width_px = kImageWidth_px;
  clean.height_px = kImageHeight_px;
  clean.depth_m.resize(kImageSize_px);
  surface.cos_incidence.resize(kImageSize_px);
  surface.reflectance.resize(kImageSize_px);
  draw_clean(sample, clean.depth_m);
  unpack_surface(sample.surface.data(), surface.cos_incidence.data(), surface.reflectance.data());
  scene::apply_noise(noise, dataset_camera(), clean, surface, random, &noisy);
  std::copy_n(noisy.depth_m.begin(), kImageSize_px, noisy_m.begin());
}

Status generate_dataset(const std::filesystem::path& file, const DatasetOptions& options,
                        const std::function<bool(const Progress&)>& progress) {
  std::error_code folder_error;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), folder_error);
  if (folder_error) return file_error(file, "the folder can't be made: " + folder_error.message());
  const Descriptor descriptor(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (descriptor.number() < 0) return system_error(file, "can't be opened for writing");

  struct stat status {};
  if (::fstat(descriptor.number(), &status) != 0) return system_error(file, "can't be examined");
  const auto size = static_cast<std::uint64_t>(status.st_size);
  const FileHeader header = make_header(options.seed, options.first_index);
  std::uint64_t done = 0;
  if (size == 0) {
    if (!write_all(descriptor.number(), &header, sizeof(header))) return system_error(file, "can't be written");
  } else {
    FileHeader present{};
    if (size < sizeof(present) || ::pread(descriptor.number(), &present, sizeof(present), 0) != sizeof(present))
      return file_error(file, "is shorter than a header; delete it to have it made again");
    if (Status checked = check_header(file, present); !checked.ok()) return checked;
    if (present.seed != options.seed || present.first_index != options.first_index) {
      return file_error(file, "holds seed " + std::to_string(present.seed) + " from index " +
                                  std::to_string(present.first_index) + ", expected seed " +
                                  std::to_string(options.seed) + " from index " + std::to_string(options.first_index));
    }
    done = (size - sizeof(FileHeader)) / sizeof(Record);
  }
  if (done < options.count) {
    // What was cut short by a crash or a full disk goes away.
    const auto whole = static_cast<off_t>(sizeof(FileHeader) + done * sizeof(Record));
    if (::ftruncate(descriptor.number(), whole) != 0 || ::lseek(descriptor.number(), whole, SEEK_SET) != whole)
      return system_error(file, "can't be continued");
  }

  // Chunks are made side by side in memory and written in order, so that the file's length always says what is whole.
  constexpr std::uint64_t kChunk = 256;
  std::vector<Record> records(kChunk);
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t done_before = done;
  while (done < options.count) {
    const std::uint64_t count = std::min(kChunk, options.count - done);
    std::atomic<std::uint64_t> next{0};
    const auto work = [&] {
      for (std::uint64_t i = next++; i < count; i = next++)
        store(generate(options.seed, options.first_index + done + i), &records[i]);
    };
    {
      std::vector<std::jthread> helpers;
      for (int i = 1; i < options.threads; ++i) helpers.emplace_back(work);
      work();
    }
    if (!write_all(descriptor.number(), records.data(), count * sizeof(Record)))
      return system_error(file, "can't be written");
    done += count;

    if (progress) {
      const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const double rate_hz = static_cast<double>(done - done_before) / std::max(elapsed_s, 1e-9);
      if (!progress({done, options.count, rate_hz, static_cast<double>(options.count - done) / rate_hz})) break;
    }
  }
  return {};
}

struct Dataset::Mapping {
  const std::byte* data = nullptr;
  std::size_t bytes = 0;
  std::uint64_t count = 0;

  Mapping() = default;
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping() {
    if (data != nullptr) ::munmap(const_cast<std::byte*>(data), bytes);
  }
  const FileHeader& header() const { return *reinterpret_cast<const FileHeader*>(data); }
  const Record* records() const { return reinterpret_cast<const Record*>(data + sizeof(FileHeader)); }
};

Dataset::Dataset(std::unique_ptr<Mapping> mapping) noexcept : mapping_(std::move(mapping)) {}
Dataset::~Dataset() = default;
Dataset::Dataset(Dataset&&) noexcept = default;
Dataset& Dataset::operator=(Dataset&&) noexcept = default;

Result<Dataset> Dataset::open(const std::filesystem::path& file) {
  const Descriptor descriptor(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  if (descriptor.number() < 0) return system_error(file, "can't be opened");
  struct stat status {};
  if (::fstat(descriptor.number(), &status) != 0) return system_error(file, "can't be examined");
  const auto bytes = static_cast<std::size_t>(status.st_size);
  if (bytes < sizeof(FileHeader)) return file_error(file, "is shorter than a header");
  void* const data = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, descriptor.number(), 0);
  if (data == MAP_FAILED) return system_error(file, "can't be mapped");
  auto mapping = std::make_unique<Mapping>();
  mapping->data = static_cast<const std::byte*>(data);
  mapping->bytes = bytes;
  if (Status checked = check_header(file, mapping->header()); !checked.ok()) return Error{checked.error()};
  mapping->count = (bytes - sizeof(FileHeader)) / sizeof(Record);
  return Dataset(std::move(mapping));
}

std::uint64_t Dataset::size() const noexcept { return mapping_->count; }
std::uint64_t Dataset::seed() const noexcept { return mapping_->header().seed; }
std::uint64_t Dataset::first_index() const noexcept { return mapping_->header().first_index; }

SampleView Dataset::at(std::uint64_t index) const noexcept {
  const Record& record = mapping_->records()[index];
  SampleView view;
  view.clean_mm = record.clean_mm;
  view.surface = record.surface;
  view.gate_count = std::clamp(record.gate_count, 0, kMaxGates);
  view.valid_count = std::clamp(record.valid_count, 0, view.gate_count);
  for (std::size_t i = 0; i < static_cast<std::size_t>(view.gate_count); ++i) {
    const GateRecord& in = record.gates[i];
    GateLabel& gate = view.gates[i];
    gate.p_CG = Eigen::Map<const Eigen::Vector3f>(in.p_CG);
    gate.q_CG.coeffs() = Eigen::Map<const Eigen::Vector4f>(in.q_CG_xyzw);
    gate.visible_fraction = in.visible_fraction;
    gate.shape.inner_half_m = static_cast<double>(in.inner_half_m);
    gate.shape.outer_half_m = static_cast<double>(in.outer_half_m);
    gate.shape.thickness_m = static_cast<double>(in.thickness_m);
    gate.shape.opening = in.opening == 1 ? GateShape::Opening::kRound : GateShape::Opening::kSquare;
  }
  return view;
}

}  // namespace gatefield::training
