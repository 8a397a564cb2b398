#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <span>

#include "common/model/bundle.h"
#include "server/kernels/decoder/packed_layer.h"

/// Field decoder: s = g_phi(z, p) for many points p and one z (paper, "Gate-SDF Guided Safety Cost").
///
/// With z fixed the first layer is affine in the encoding e(p) of the point, so it is folded once per frame:
///   a_0 = e(p)                         p itself, or p and its sines and cosines
///   a_1 = relu(W_1 a_0 + b_1)          W_1 and b_1 (kHyper) or b_1 alone (kConcatenated) depend on z
///   a_{i+1} = relu(W_i a_i + b_i)
///   s = w a_n + b
/// Three objects, by what they depend on:
///   model::DecoderWeights   the model
///   PreparedDecoder         the model and the back end: weights as it reads them; megabytes at most, shared
///   FoldedDecoder           latent and pose, too: the first layer; a few kilobytes, copied from thread to thread
///
/// Tolerance against decode_reference() with trained weights:
///   single precision   |ds| <= 1e-4 m
///   avx3_int16         0.004 m within 10 m of the gate, as far as the planner asks: at most 0.0023 m was measured,
///                      0.0001 to 0.0004 m rms; it grows with the distance
///   avx3_amx           0.001 m there; 0.00015 m was measured with emulated tiles
namespace gatefield::kernels {

/// Coordinates in the camera frame saturate here, so that any finite point gives a finite value.
inline constexpr double kMaxCoordinate_m = 1e6;

struct FoldedDecoder;

/// A decoder's weights as one back end reads them: what depends on no latent. Backend::prepare() makes it.
/// Thread-safe: yes (const).   Real-time safe: all but the constructor, fold() from its second call on the same memory
/// on.
class PreparedDecoder {
 public:
  /// @pre weights as model::Bundle lets them through (shapes chain, widths <= kMaxWidth)
  explicit PreparedDecoder(const model::DecoderWeights& weights);
  PreparedDecoder(const PreparedDecoder&) = delete;
  PreparedDecoder& operator=(const PreparedDecoder&) = delete;
  virtual ~PreparedDecoder() = default;

  const model::DecoderWeights& weights() const noexcept { return weights_; }
  bool hyper() const noexcept { return weights_.kind == model::DecoderKind::kHyper; }
  /// Layers behind the folded one, the last of them the output.
  std::span<const model::Dense> inner() const noexcept { return std::span(weights_.layers).subspan(hyper() ? 0 : 1); }
  /// kConcatenated: the first layer's columns of the encoded point, [outputs][3 + 6 L], no bias. kHyper: empty.
  const model::Dense& point_columns() const noexcept { return point_columns_; }

  /// The first layer that `latent` makes, into `out`, whose pose stays. @pre latent.size() == weights().latent_size
  void fold(std::span<const float> latent, FoldedDecoder* out) const;
  /// Brings out->first into this back end's own layout, out->packed; nothing where `first` is read as it is.
  virtual void lay_out(FoldedDecoder* out) const = 0;

  /// s at points in the world frame, in the network's metres: FoldedDecoder::decode() makes the world's of them.
  virtual void decode(const FoldedDecoder& folded, std::span<const float> x_W, std::span<const float> y_W,
                      std::span<const float> z_W, std::span<float> sdf_m) const noexcept = 0;

 private:
  model::DecoderWeights weights_;
  model::Dense point_columns_;
};

/// A decoder with latent and pose folded in: a value of its own that needs the PreparedDecoder only, which it keeps
/// alive. Copying it into one that was used before allocates nothing.
/// Thread-safe: decode() yes.   Real-time safe: decode(), place(), copying into used memory.
struct FoldedDecoder {
  std::shared_ptr<const PreparedDecoder> prepared;
  /// Metres of the world in one of the network's: k times as large a gate as the network knows has k. Points are
  /// divided by it and s is multiplied by it, so that both are the world's.
  double unit_m = 1.0;
  Eigen::Matrix3f R_CW = Eigen::Matrix3f::Identity();  ///< the rotation, with 1 / unit_m in it
  /// p_C = R_CW p_W + t_CW, in the network's metres; kHyper: minus origin_C already
  Eigen::Vector3f t_CW = Eigen::Vector3f::Zero();
  Eigen::Vector3d origin_C = Eigen::Vector3d::Zero();  ///< kHyper: the latent's centre, from which p counts
  model::Dense first;  ///< as the latent makes it; kHyper: with 1 / S in its weights; kConcatenated: bias alone
  PackedLayer packed;  ///< the same in the back end's layout

  /// Moves the field with the camera to X_WC. The latent's part stays: the same bits as folding it again there.
  void place(const Eigen::Isometry3d& X_WC) noexcept;

  /// sdf_m[i] = s at (x_W, y_W, z_W)[i], any number of points; a point with a coordinate that isn't finite gets NaN. A
  /// point's value doesn't depend on its place in the span. @pre folded
  void decode(std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
              std::span<float> sdf_m) const noexcept {
    prepared->decode(*this, x_W, y_W, z_W, sdf_m);
    if (unit_m == 1.0) return;
    const auto unit = static_cast<float>(unit_m);
    for (float& s : sdf_m) s *= unit;
  }
};

/// Folds `latent`, captured from X_WC, into `out`, whose memory is used again.
/// @param unit_m  as FoldedDecoder has it
/// Not thread-safe on the same `out`; real-time safe from the second call with weights of the same shape on.
/// @pre latent.size() == prepared->weights().latent_size
void fold(const std::shared_ptr<const PreparedDecoder>& prepared, std::span<const float> latent,
          const Eigen::Isometry3d& X_WC, FoldedDecoder* out, double unit_m = 1.0);

/// Brings a latent's part that was folded for another back end (or in another process) over to this one: lays out
/// folded->first, and the field is the same within both tolerances. @pre *folded is of the same model
void adopt(const std::shared_ptr<const PreparedDecoder>& prepared, FoldedDecoder* folded);

/// The same as FoldedDecoder::decode() in double precision, readable, from weights that no back end laid out: what back
/// ends are held against.
void decode_reference(const FoldedDecoder& folded, std::span<const float> x_W, std::span<const float> y_W,
                      std::span<const float> z_W, std::span<float> sdf_m) noexcept;

}  // namespace gatefield::kernels
