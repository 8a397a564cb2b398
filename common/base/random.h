#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>

namespace gatefield {

/// Philox4x32-10, the counter-based generator of Salmon et al., "Parallel random numbers: as easy as 1, 2, 3",
/// SC'11, doi:10.1145/2063384.2063405. The same key and counter give the same numbers on every machine and in any
/// order. Thread-safe: yes (pure).   Real-time safe: yes.
constexpr std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                              std::array<std::uint32_t, 2> key) noexcept {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t product0 = std::uint64_t{0xD2511F53u} * counter[0];
    const std::uint64_t product1 = std::uint64_t{0xCD9E8D57u} * counter[2];
    counter = {static_cast<std::uint32_t>(product1 >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(product1),
               static_cast<std::uint32_t>(product0 >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(product0)};
    key[0] += 0x9E3779B9u;
    key[1] += 0xBB67AE85u;
  }
  return counter;
}

/// The name of a stream of random numbers, "gatefield.<who>.<what for>": every use has one of its own. It is hashed
/// when the program is compiled (64-bit FNV-1a), so it costs nothing and can't be made up at run time.
class Stream {
 public:
  explicit consteval Stream(std::string_view name) {
    for (const char c : name) hash_ = (hash_ ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  }
  constexpr std::uint64_t hash() const noexcept { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ull;
};

/// The key of a stream: the finalizer of SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number
/// generators", OOPSLA'14, doi:10.1145/2660193.2660195; constants of Stafford's Mix13) over seed ^ hash(name). It is a
/// bijection: one name has another key for each seed, and two names a and b share a key only for two seeds that differ
/// by exactly hash(a) ^ hash(b), a number of 64 bits that no two seeds of a campaign are apart. Since philox mixes
/// counters under the key, streams of different names have nothing in common, whatever their counters mean.
/// Thread-safe: yes (pure).   Real-time safe: yes.
constexpr std::uint64_t stream_key(std::uint64_t seed, Stream name) noexcept {
  std::uint64_t key = seed ^ name.hash();
  key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9ull;
  key = (key ^ (key >> 27)) * 0x94d049bb133111ebull;
  return key ^ (key >> 31);
}

/// Random numbers on top of philox, in a stream of one's own, so that none depends on how much another one drew.
/// Thread-safe: no (one per user).   Real-time safe: yes.
class Random {
 public:
  /// The stream of that name: key stream_key(seed, name), counter (draws, index).
  /// @param index  tells apart what draws in parallel under one name: the flight, the frame, the row
  Random(std::uint64_t seed, Stream name, std::uint64_t index = 0) noexcept : Random(stream_key(seed, name), index) {}

  /// The same with the key itself: (seed, stream) are key and upper half of the counter. Only for keys that are drawn
  /// or belong to one user: all that takes the same seed this way has the same key, and streams are then told apart by
  /// counters alone.
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) noexcept
      : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)},
        counter_{0, 0, static_cast<std::uint32_t>(stream), static_cast<std::uint32_t>(stream >> 32)} {}

  std::uint32_t bits() noexcept {
    if (next_ == 4) {
      block_ = philox(counter_, key_);
      if (++counter_[0] == 0) ++counter_[1];
      next_ = 0;
    }
    return block_[static_cast<std::size_t>(next_++)];
  }

  /// Uniform in [0, 1).
  double uniform() noexcept { return (bits() >> 8) * 0x1p-24; }
  /// Uniform in [low, high).
  double uniform(double low, double high) noexcept { return low + (high - low) * uniform(); }
  /// Uniform in {0, ..., count - 1}. @pre count > 0
  std::uint32_t below(std::uint32_t count) noexcept {
    return static_cast<std::uint32_t>((std::uint64_t{bits()} * count) >> 32);
  }
  bool chance(double probability) noexcept { return uniform() < probability; }

  /// Standard normal (Box-Muller).
  double normal() noexcept {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    const double angle = 6.283185307179586 * uniform();
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }

 private:
  std::array<std::uint32_t, 2> key_;
  std::array<std::uint32_t, 4> counter_;
  std::array<std::uint32_t, 4> block_{};
  int next_ = 4;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace gatefield
