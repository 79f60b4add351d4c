// The entropy coder of transform coefficients: blocks of whole numbers [component][function], most of them zero, that
// shrink along both axes.
//
// Each coefficient is coded as zero or not, its sign, whether it is more than one, and the rest by an adaptive
// exponential-Golomb code, all of it with range_coder.h. What to expect of a coefficient is told by
//
//   - the stream's spectrum: for each component and frequency band the mean magnitude over the whole stream, in powers
//     of two (0: the band is empty, nothing is coded);
//   - the magnitudes nearby that are known already: the three lower functions of the component, the three components
//     before it at the same function, and the same frequency in the block before.
//
// The bands: the constant, the line, then half octaves of frequency. Layers are runs of bands; a layer is coded for all
// blocks before the next, and nothing in it needs a later layer, so layers can be left out from the end.
//
// Models start from what the encoder found (LearnedStart), so that groups of blocks can be decoded alone.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kinespace/entropy/range_coder.h"

namespace kinespace {

inline constexpr int band_count = 18;
inline constexpr int layer_count = 5;
// The bands of layer l are [layer_bands[l], layer_bands[l + 1]).
inline constexpr std::array<int, layer_count + 1> layer_bands{0, 5, 8, 11, 13, band_count};

// First function of each band (and the end) in a block of so many functions, `points` points long, at a frame rate.
[[nodiscard]] std::array<int, band_count + 1> band_edges(int functions, int points, double rate_hz);

struct CodingStatistics;

// Coefficients below this, in steps, will be coded as zero whatever stands around them.
inline constexpr double surely_zero = 0.62;

// Levels by component and band.
struct Spectrum {
  static constexpr int levels = 14;  // 0: empty; then mean magnitudes below 2^-8, 2^-7, .. 2^3, and above
  int components = 0;
  std::vector<std::uint8_t> level;  // [component][band]

  [[nodiscard]] std::uint8_t at(int component, int band) const {
    return level[static_cast<std::size_t>(component) * band_count + static_cast<std::size_t>(band)];
  }
  // The functions that a block needs: the end of the last band that any component fills.
  [[nodiscard]] int functions_used(const std::array<int, band_count + 1>& edges) const;
  [[nodiscard]] static std::uint8_t level_of(double mean_magnitude);
  [[nodiscard]] static Spectrum of(const CodingStatistics& statistics, int components);
};

[[nodiscard]] Bytes pack_spectrum(const Spectrum& spectrum);
// Throws Error{bad_input} naming `source`.
[[nodiscard]] Spectrum unpack_spectrum(std::span<const std::byte> bytes, int components, const std::string& source);

// All that adapts.
struct CoefficientModels {
  static constexpr int neighbourhoods = 14;
  static constexpr int exponents = 48;
  static constexpr std::size_t count = 2 * Spectrum::levels * neighbourhoods + neighbourhoods * exponents + exponents;
  std::array<std::array<AdaptiveBit, neighbourhoods>, Spectrum::levels> nonzero;
  std::array<std::array<AdaptiveBit, neighbourhoods>, Spectrum::levels> more;
  std::array<std::array<AdaptiveBit, exponents>, neighbourhoods> exponent;
  std::array<AdaptiveBit, exponents> mantissa;
};

// Where the models of a stream start: probabilities in 64 steps on a logistic scale; 0: nothing known.
struct LearnedStart {
  std::vector<std::uint8_t> steps;
  [[nodiscard]] CoefficientModels models() const;
};
[[nodiscard]] Bytes pack_start(const LearnedStart& start);
[[nodiscard]] LearnedStart unpack_start(std::span<const std::byte> bytes, const std::string& source);

// How often each model saw a 0 and a 1; from which a LearnedStart is made. Sums of groups may be added.
struct ModelCounts {
  std::vector<std::array<std::uint32_t, 2>> seen;
  void add(const ModelCounts& other);
  [[nodiscard]] LearnedStart learn() const;
};

// One block as the coder sees it.
struct CoefficientBlock {
  int functions = 0;                        // coded at all, the stride of `values`
  std::array<int, band_count + 1> edges{};  // of the bands, at most `functions`
  bool follows = false;                     // goes on from the block before it in the group
  std::span<const double> wanted;           // encoder: [component][function], in quantiser steps
  std::span<double> values;                 // out: what the decoder will have, in quantiser steps
};

// What |q| = 1, 2, more are decoded to beside themselves, by spectrum level, in 1/64 steps: coefficients lie nearer to
// zero than the middle of their step, or farther where the quantiser dropped the small ones.
struct ReconstructionPoints {
  std::array<std::array<std::int8_t, 3>, Spectrum::levels> shift{};
  [[nodiscard]] double value(std::int64_t quantised, std::uint8_t level) const;
};

// What the encoder learns while coding.
struct CodingStatistics {
  ModelCounts counts;
  std::vector<double> magnitude;                                                  // [component][band]: sums of |q|
  std::vector<double> coefficients;                                               // their number
  std::array<std::array<std::array<double, 2>, 3>, Spectrum::levels> residual{};  // sum of |wanted| - |q|, count
  double squared_error = 0;                                                       // in squared steps

  void add(const CodingStatistics& other);
  // Counts what plain rounding would give of a block of so many points, which is where the spectrum starts from.
  // `wanted`: [component][functions], in steps.
  void add_plain(std::span<const double> wanted, int functions, int points, double rate_hz, int components);
  [[nodiscard]] ReconstructionPoints reconstruction() const;
};

struct CoefficientTables {
  Spectrum spectrum;
  LearnedStart start;
  ReconstructionPoints points;
};

// Codes one group, layer by layer, choosing each value for least squared error + rate_weight * bits (rate_weight in
// squared steps a bit; 0 rounds to the nearest). Fills the blocks' values. Adds to `statistics`.
[[nodiscard]] std::vector<Bytes> encode_group(std::span<CoefficientBlock> blocks, const CoefficientTables& tables,
                                              double rate_weight, CodingStatistics& statistics);

// Decodes the first layers.size() layers of a group; the rest of `values` must be zero. Throws Error{bad_input} when a
// layer's bytes end early, are too many, or give numbers beyond 2^46.
void decode_group(std::span<CoefficientBlock> blocks, const CoefficientTables& tables,
                  std::span<const std::span<const std::byte>> layers, const std::string& source);

}  // namespace kinespace
