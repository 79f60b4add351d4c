// The tables of the coefficient coder: what they are made of, and as bytes.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "kinespace/entropy/coefficient_coder.h"
#include "kinespace/entropy/integer_coder.h"

namespace kinespace {
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
