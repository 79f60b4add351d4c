#include "kinespace/entropy/coefficient_coder.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "kinespace/base/error.h"
#include "kinespace/entropy/integer_coder.h"

namespace kinespace {
namespace {

// Of the neighbours' weighted sum of magnitudes, for sums up to 255; larger ones take the last.
constexpr std::array<int, CoefficientModels::neighbourhoods - 1> sum_edges{1,  2,  3,  4,  6,  9,  13,
                                                                           19, 28, 41, 62, 95, 150};

constexpr std::array<std::uint8_t, 256> make_sum_levels() {
  std::array<std::uint8_t, 256> out{};
  for (std::size_t sum = 0; sum < out.size(); ++sum) {
    for (const int edge : sum_edges) out[sum] = static_cast<std::uint8_t>(out[sum] + (static_cast<int>(sum) >= edge));
  }
  return out;
}
constexpr auto sum_levels = make_sum_levels();

constexpr std::int64_t largest_magnitude = std::int64_t{1} << 46;

// Magnitudes of a block, capped, with a margin of zeros on all sides that neighbours reach into.
class Magnitudes {
 public:
  static constexpr int before = 3;
  static constexpr int after = 1;
  static constexpr std::int64_t cap = 40;

  Magnitudes(int components, int functions)
      : functions_(functions),
        stride_(static_cast<std::size_t>(functions + before + after)),
        values_(stride_ * static_cast<std::size_t>(components + before), 0) {}

  [[nodiscard]] std::uint8_t* row(int component) {
    return values_.data() + static_cast<std::size_t>(component + before) * stride_ + before;
  }
  [[nodiscard]] const std::uint8_t* row(int component) const {
    return values_.data() + static_cast<std::size_t>(component + before) * stride_ + before;
  }
  [[nodiscard]] std::ptrdiff_t stride() const { return static_cast<std::ptrdiff_t>(stride_); }
  [[nodiscard]] int functions() const { return functions_; }

 private:
  int functions_;
  std::size_t stride_;
  std::vector<std::uint8_t> values_;
};

// The same frequency in the block before: function k of n is function k n' / n of n'.
struct Earlier {
  const Magnitudes* block = nullptr;
  std::uint64_t ratio = 0;  // 32 fractional bits

  Earlier(const Magnitudes* earlier, int points_ratio_top, int points_ratio_bottom)
      : block(earlier),
        ratio((static_cast<std::uint64_t>(points_ratio_top) << 32) / static_cast<std::uint64_t>(points_ratio_bottom)) {}
  [[nodiscard]] int at(int component, int k) const {
    if (block == nullptr) return 0;
    const auto there = static_cast<int>((static_cast<std::uint64_t>(2 * k + 1) * ratio) >> 33);
    if (there >= block->functions()) return 0;
    const std::uint8_t* row = block->row(component) + there;
    return 2 * row[0] + row[1] + row[-1];
  }
};

inline std::uint8_t neighbourhood(const std::uint8_t* at, std::ptrdiff_t stride, int earlier) {
  const std::uint8_t* b = at - stride;
  const std::uint8_t* c = b - stride;
  const std::uint8_t* d = c - stride;
  const int sum = 3 * at[-1] + 3 * at[-2] + 2 * at[-3] + 2 * b[0] + b[1] + b[-1] + 2 * c[0] + d[0] + earlier;
  return sum_levels[static_cast<std::size_t>(std::min(sum, 255))];
}

struct Context {
  std::uint8_t level = 0;
  std::uint8_t near = 0;
};

// Visits every coefficient of a layer that is coded: code(block index, component, k, context) gives its magnitude.
template <typename Code>
void visit_layer(std::span<const CoefficientBlock> blocks, std::vector<Magnitudes>& magnitudes,
                 const Spectrum& spectrum, int layer, const Code& code) {
  const auto first = layer_bands[static_cast<std::size_t>(layer)];
  const auto last = layer_bands[static_cast<std::size_t>(layer) + 1];
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const CoefficientBlock& block = blocks[b];
    Magnitudes& own = magnitudes[b];
    const bool follows = block.follows && b > 0;
    const Earlier earlier(follows ? &magnitudes[b - 1] : nullptr, follows ? blocks[b - 1].functions : 1,
                          std::max(block.functions, 1));
    for (int c = 0; c < spectrum.components; ++c) {
      std::uint8_t* row = own.row(c);
      for (int band = first; band < last; ++band) {
        const std::uint8_t level = spectrum.at(c, band);
        if (level == 0) continue;
        const int end = block.edges[static_cast<std::size_t>(band) + 1];
        for (int k = block.edges[static_cast<std::size_t>(band)]; k < end; ++k) {
          const std::uint8_t near = neighbourhood(row + k, own.stride(), earlier.at(c, k));
          const std::int64_t magnitude = code(b, c, k, band, Context{level, near});
          row[k] = static_cast<std::uint8_t>(std::min(magnitude, Magnitudes::cap));
        }
      }
    }
  }
}

std::vector<Magnitudes> no_magnitudes(std::span<const CoefficientBlock> blocks, int components) {
  std::vector<Magnitudes> out;
  out.reserve(blocks.size());
  for (const CoefficientBlock& block : blocks) out.emplace_back(components, block.functions);
  return out;
}

// What a decision of this probability costs, in bits.
float cost_of(const AdaptiveBit& model, bool bit) {
  static const std::array<float, 257> table = [] {
    std::array<float, 257> out{};
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i] = static_cast<float>(-std::log2(std::max(static_cast<double>(i), 0.25) / 256));
    }
    return out;
  }();
  const std::uint32_t p = bit ? model.probability() : 65536 - model.probability();
  return table[(p + 128) >> 8];
}

class Writer {
 public:
  Writer(const LearnedStart& start, ModelCounts& counts) : models_(start.models()), counts_(counts) {
    counts_.seen.resize(CoefficientModels::count);
  }

  // Of a value one, two or more: bits beside the sign.
  [[nodiscard]] float cost(std::int64_t magnitude, Context at) const {
    float bits = cost_of(models_.nonzero[at.level][at.near], magnitude > 0);
    if (magnitude == 0) return bits;
    bits += 1 + cost_of(models_.more[at.level][at.near], magnitude > 1);
    if (magnitude == 1) return bits;
    const auto rest = static_cast<std::uint64_t>(magnitude - 1);
    const int exponent = bit_length(rest) - 1;
    for (int e = 0; e <= exponent; ++e)
      bits += cost_of(models_.exponent[at.near][static_cast<std::size_t>(e)], e < exponent);
    return bits + static_cast<float>(exponent);
  }

  void write(std::int64_t value, Context at) {
    const std::int64_t magnitude = std::abs(value);
    bit(magnitude > 0, models_.nonzero[at.level][at.near]);
    if (magnitude == 0) return;
    coder_.encode_even(value < 0);
    bit(magnitude > 1, models_.more[at.level][at.near]);
    if (magnitude == 1) return;
    const auto rest = static_cast<std::uint64_t>(magnitude - 1);
    const int exponent = bit_length(rest) - 1;
    for (int e = 0; e <= exponent; ++e) bit(e < exponent, models_.exponent[at.near][static_cast<std::size_t>(e)]);
    for (int i = exponent - 1; i >= 0; --i) {
      const bool b = ((rest >> i) & 1) != 0;
      if (i == exponent - 1) {
        bit(b, models_.mantissa[static_cast<std::size_t>(exponent)]);
      } else {
        coder_.encode_even(b);
      }
    }
  }
  [[nodiscard]] Bytes finish() { return std::move(coder_).finish(); }

 private:
  void bit(bool b, AdaptiveBit& model) {
    const auto number = static_cast<std::size_t>(&model - &models_.nonzero[0][0]);
    ++counts_.seen[number][b ? 1 : 0];
    coder_.encode(b, model);
  }
  CoefficientModels models_;
  RangeEncoder coder_;
  ModelCounts& counts_;
};
static_assert(sizeof(CoefficientModels) == CoefficientModels::count * sizeof(AdaptiveBit),
              "models are numbered by their address");

class Reader {
 public:
  Reader(const CoefficientModels& start, std::span<const std::byte> bytes) : models_(start), coder_(bytes) {}

  // Signed; 2^47 for what cannot be.
  std::int64_t read(Context at) {
    if (!coder_.decode(models_.nonzero[at.level][at.near])) return 0;
    const bool negative = coder_.decode_even();
    std::int64_t magnitude = 1;
    if (coder_.decode(models_.more[at.level][at.near])) magnitude = 1 + rest(at);
    return negative ? -magnitude : magnitude;
  }
  [[nodiscard]] bool whole() const { return !coder_.overrun() && coder_.used_up(); }
  [[nodiscard]] bool overrun() const { return coder_.overrun(); }

 private:
  std::int64_t rest(Context at) {
    int exponent = 0;
    while (coder_.decode(models_.exponent[at.near][static_cast<std::size_t>(exponent)])) {
      if (++exponent == CoefficientModels::exponents - 1) return 2 * largest_magnitude;
    }
    std::int64_t out = 1;
    for (int i = exponent - 1; i >= 0; --i) {
      const bool b = i == exponent - 1 ? coder_.decode(models_.mantissa[static_cast<std::size_t>(exponent)])
                                       : coder_.decode_even();
      out = 2 * out + (b ? 1 : 0);
    }
    return out;
  }
  CoefficientModels models_;
  RangeDecoder coder_;
};

// The best of the nearest values, by squared error and bits.
std::int64_t choose(double wanted, Context at, double rate_weight, const Writer& writer) {
  const double size = std::abs(wanted);
  if (!(size < static_cast<double>(largest_magnitude))) {
    throw Error(ErrorKind::usage, {.found = "a coefficient of more than 2^46 quantiser steps",
                                   .expected = "a larger error",
                                   .remedy = "ask for less precision"});
  }
  const auto nearest = static_cast<std::int64_t>(size + 0.5);
  if (nearest == 0) return 0;
  std::int64_t best = nearest;
  double least = (size - static_cast<double>(nearest)) * (size - static_cast<double>(nearest)) +
                 rate_weight * static_cast<double>(writer.cost(nearest, at));
  const std::int64_t lowest = nearest <= 2 ? 0 : nearest - 1;
  for (std::int64_t m = nearest - 1; m >= lowest; --m) {
    const double off = size - static_cast<double>(m);
    const double price = off * off + rate_weight * static_cast<double>(writer.cost(m, at));
    if (price < least) {
      least = price;
      best = m;
    }
  }
  return wanted < 0 ? -best : best;
}

}  // namespace

double ReconstructionPoints::value(std::int64_t quantised, std::uint8_t level) const {
  if (quantised == 0) return 0;
  const auto magnitude = static_cast<std::size_t>(std::min<std::int64_t>(std::abs(quantised), 3));
  const double size = static_cast<double>(std::abs(quantised)) + shift[level][magnitude - 1] / 64.0;
  return quantised < 0 ? -size : size;
}

std::vector<Bytes> encode_group(std::span<CoefficientBlock> blocks, const CoefficientTables& tables, double rate_weight,
                                CodingStatistics& statistics) {
  const int components = tables.spectrum.components;
  const std::size_t cells = static_cast<std::size_t>(components) * band_count;
  statistics.magnitude.resize(cells);
  statistics.coefficients.resize(cells);
  std::vector<Magnitudes> magnitudes = no_magnitudes(blocks, components);
  std::vector<Bytes> out;
  for (int layer = 0; layer < layer_count; ++layer) {
    Writer writer(tables.start, statistics.counts);
    visit_layer(blocks, magnitudes, tables.spectrum, layer, [&](std::size_t b, int c, int k, int band, Context at) {
      const std::size_t place =
          static_cast<std::size_t>(c) * static_cast<std::size_t>(blocks[b].functions) + static_cast<std::size_t>(k);
      const double wanted = blocks[b].wanted[place];
      const std::int64_t value = choose(wanted, at, rate_weight, writer);
      writer.write(value, at);
      const std::int64_t size = std::abs(value);
      const std::size_t cell = static_cast<std::size_t>(c) * band_count + static_cast<std::size_t>(band);
      statistics.magnitude[cell] += static_cast<double>(size);
      statistics.coefficients[cell] += 1;
      if (size > 0) {
        auto& sums = statistics.residual[at.level][static_cast<std::size_t>(std::min<std::int64_t>(size, 3)) - 1];
        sums[0] += std::abs(wanted) - static_cast<double>(size);
        sums[1] += 1;
      }
      const double decoded = tables.points.value(value, at.level);
      statistics.squared_error += (wanted - decoded) * (wanted - decoded);
      blocks[b].values[place] = decoded;
      return size;
    });
    out.push_back(writer.finish());
  }
  return out;
}

void decode_group(std::span<CoefficientBlock> blocks, const CoefficientTables& tables,
                  std::span<const std::span<const std::byte>> layers, const std::string& source) {
  const CoefficientModels start = tables.start.models();
  std::vector<Magnitudes> magnitudes = no_magnitudes(blocks, tables.spectrum.components);
  for (std::size_t layer = 0; layer < layers.size() && layer < layer_count; ++layer) {
    Reader reader(start, layers[layer]);
    std::int64_t largest = 0;
    visit_layer(blocks, magnitudes, tables.spectrum, static_cast<int>(layer),
                [&](std::size_t b, int c, int k, int /*band*/, Context at) {
                  const std::int64_t value = reader.read(at);
                  if (value == 0) return std::int64_t{0};
                  const std::int64_t size = std::abs(value);
                  largest = std::max(largest, size);
                  blocks[b].values[static_cast<std::size_t>(c) * static_cast<std::size_t>(blocks[b].functions) +
                                   static_cast<std::size_t>(k)] = tables.points.value(value, at.level);
                  return size;
                });
    if (!reader.whole() || largest > largest_magnitude) {
      throw Error(ErrorKind::bad_input, {.file = source,
                                         .found = "coefficients that end too early or too late",
                                         .expected = "as many as the tables say (damaged)"});
    }
  }
}

// The tables of the coefficient coder: what they are made of, and as bytes.

namespace {

// How a level differs from what its neighbours suggest: the mean of the component before and the band before.
int expected_level(const Spectrum& spectrum, int component, int band) {
  const int left = band > 0 ? spectrum.at(component, band - 1) : -1;
  const int above = component > 0 ? spectrum.at(component - 1, band) : -1;
  if (left < 0 && above < 0) return 6;
  if (above < 0) return left;
  if (left < 0) return above;
  const int corner = spectrum.at(component - 1, band - 1);
  const int plane = left + above - corner;
  return plane < 0 ? 0 : plane > Spectrum::levels - 1 ? Spectrum::levels - 1 : plane;
}

int spectrum_context(int expected) {
  return expected == 0 ? 0 : expected < 4 ? 1 : 2;
}

// The models as one row of numbered decisions, for counting.
template <typename Models, typename Visit>
void visit_models(Models& models, const Visit& visit) {
  for (auto& row : models.nonzero) {
    for (auto& model : row) visit(model);
  }
  for (auto& row : models.more) {
    for (auto& model : row) visit(model);
  }
  for (auto& row : models.exponent) {
    for (auto& model : row) visit(model);
  }
  for (auto& model : models.mantissa) visit(model);
}

}  // namespace

std::array<int, band_count + 1> band_edges(int functions, int points, double rate_hz) {
  // Function k stands for k rate / (2 points) Hz: bands begin at 0.35 Hz times powers of sqrt 2.
  std::array<int, band_count + 1> out{};
  out[1] = std::min(1, functions);
  out[2] = std::min(2, functions);
  double frequency = 0.35;
  for (std::size_t band = 3; band < band_count; ++band) {
    const double k = frequency * 2 * points / rate_hz;
    out[band] = std::clamp(static_cast<int>(std::min(k, 1e6)), out[2], functions);
    frequency *= 1.4142135623730951;
  }
  out[band_count] = functions;
  return out;
}

int Spectrum::functions_used(const std::array<int, band_count + 1>& edges) const {
  int last = 0;
  for (int c = 0; c < components; ++c) {
    for (int band = band_count - 1; band >= last; --band) {
      if (at(c, band) > 0) {
        last = band + 1;
        break;
      }
    }
  }
  return edges[static_cast<std::size_t>(last)];
}

std::uint8_t Spectrum::level_of(double mean_magnitude) {
  if (!(mean_magnitude > 0)) return 0;
  const double level = std::floor(std::log2(mean_magnitude)) + 10;
  return static_cast<std::uint8_t>(std::clamp(level, 1.0, static_cast<double>(levels - 1)));
}

CoefficientModels LearnedStart::models() const {
  CoefficientModels out;
  std::size_t i = 0;
  visit_models(out, [&](AdaptiveBit& model) {
    const std::uint8_t step = i < steps.size() ? steps[i] : std::uint8_t{0};
    ++i;
    if (step == 0) return;
    // Logistic steps of 1/4 about even odds, by repeated products so that every machine has the same.
    const int distance = std::abs(static_cast<int>(step) - 32);
    double odds = 1;
    for (int k = 0; k < distance; ++k) odds *= 0.7788007830714049;
    const double p = odds / (1 + odds);
    model = AdaptiveBit(static_cast<std::uint16_t>(65536 * (step < 32 ? p : 1 - p)), 14);
  });
  return out;
}

void ModelCounts::add(const ModelCounts& other) {
  seen.resize(CoefficientModels::count);
  for (std::size_t i = 0; i < other.seen.size(); ++i) {
    seen[i][0] += other.seen[i][0];
    seen[i][1] += other.seen[i][1];
  }
}

LearnedStart ModelCounts::learn() const {
  constexpr std::uint32_t enough = 12;  // decisions; fewer do not pay for telling
  LearnedStart out;
  for (const auto& [zeros, ones] : seen) {
    const double odds = (ones + 0.4) / (zeros + 0.4);
    const double step = std::round(32 + 4 * std::log(odds));
    out.steps.push_back(zeros + ones < enough ? std::uint8_t{0}
                                              : static_cast<std::uint8_t>(std::clamp(step, 1.0, 63.0)));
  }
  return out;
}

void CodingStatistics::add(const CodingStatistics& other) {
  counts.add(other.counts);
  magnitude.resize(std::max(magnitude.size(), other.magnitude.size()));
  coefficients.resize(magnitude.size());
  for (std::size_t i = 0; i < other.magnitude.size(); ++i) {
    magnitude[i] += other.magnitude[i];
    coefficients[i] += other.coefficients[i];
  }
  for (std::size_t l = 0; l < residual.size(); ++l) {
    for (std::size_t m = 0; m < 3; ++m) {
      residual[l][m][0] += other.residual[l][m][0];
      residual[l][m][1] += other.residual[l][m][1];
    }
  }
  squared_error += other.squared_error;
}

ReconstructionPoints CodingStatistics::reconstruction() const {
  ReconstructionPoints out;
  for (std::size_t l = 0; l < residual.size(); ++l) {
    for (std::size_t m = 0; m < 3; ++m) {
      const auto& [sum, count] = residual[l][m];
      if (count > 0) out.shift[l][m] = static_cast<std::int8_t>(std::clamp(std::round(64 * sum / count), -48.0, 48.0));
    }
  }
  return out;
}

Bytes pack_spectrum(const Spectrum& spectrum) {
  IntegerWriter out;
  for (int c = 0; c < spectrum.components; ++c) {
    for (int band = 0; band < band_count; ++band) {
      const int expected = expected_level(spectrum, c, band);
      out.put(spectrum.at(c, band) - expected, spectrum_context(expected));
    }
  }
  return std::move(out).finish();
}

Spectrum unpack_spectrum(std::span<const std::byte> bytes, int components, const std::string& source) {
  IntegerReader in(bytes, source);
  Spectrum out{.components = components,
               .level = std::vector<std::uint8_t>(static_cast<std::size_t>(components) * band_count, 0)};
  for (int c = 0; c < components; ++c) {
    for (int band = 0; band < band_count; ++band) {
      const int expected = expected_level(out, c, band);
      const std::int64_t level = expected + in.get(spectrum_context(expected));
      if (level < 0 || level >= Spectrum::levels) in.damaged();
      out.level[static_cast<std::size_t>(c) * band_count + static_cast<std::size_t>(band)] =
          static_cast<std::uint8_t>(level);
    }
  }
  in.expect_end();
  return out;
}

Bytes pack_start(const LearnedStart& start) {
  IntegerWriter out;
  out.put(static_cast<std::int64_t>(start.steps.size()));
  int last = 32;
  bool known = true;
  for (const std::uint8_t step : start.steps) {
    out.put(step == 0 ? 0 : 1, known ? 1 : 2);
    known = step != 0;
    if (!known) continue;
    out.put(static_cast<int>(step) - last, 3);
    last = step;
  }
  return std::move(out).finish();
}

LearnedStart unpack_start(std::span<const std::byte> bytes, const std::string& source) {
  IntegerReader in(bytes, source);
  LearnedStart out;
  const std::int64_t count = in.get_between(0, 1 << 14);
  int last = 32;
  bool known = true;
  for (std::int64_t i = 0; i < count; ++i) {
    known = in.get_between(0, 1, known ? 1 : 2) == 1;
    if (known) {
      const std::int64_t step = last + in.get(3);
      if (step < 1 || step > 63) in.damaged();
      last = static_cast<int>(step);
    }
    out.steps.push_back(known ? static_cast<std::uint8_t>(last) : std::uint8_t{0});
  }
  in.expect_end();
  return out;
}

Spectrum Spectrum::of(const CodingStatistics& statistics, int components) {
  Spectrum out{.components = components, .level = {}};
  for (std::size_t i = 0; i < static_cast<std::size_t>(components) * band_count; ++i) {
    const double count = i < statistics.coefficients.size() ? statistics.coefficients[i] : 0;
    out.level.push_back(count > 0 ? level_of(statistics.magnitude[i] / count) : std::uint8_t{0});
  }
  return out;
}

void CodingStatistics::add_plain(std::span<const double> wanted, int functions, int points, double rate_hz,
                                 int components) {
  magnitude.resize(static_cast<std::size_t>(components) * band_count);
  coefficients.resize(magnitude.size());
  const auto edges = band_edges(points, points, rate_hz);
  for (int c = 0; c < components; ++c) {
    const auto row = wanted.subspan(static_cast<std::size_t>(c) * static_cast<std::size_t>(functions),
                                    static_cast<std::size_t>(functions));
    for (std::size_t band = 0; band < band_count; ++band) {
      const std::size_t cell = static_cast<std::size_t>(c) * band_count + band;
      for (int k = edges[band]; k < std::min(edges[band + 1], functions); ++k) {
        const double size = std::abs(row[static_cast<std::size_t>(k)]);
        if (size > surely_zero) magnitude[cell] += std::floor(size + 0.5);
      }
      coefficients[cell] += edges[band + 1] - edges[band];
    }
  }
}

}  // namespace kinespace
