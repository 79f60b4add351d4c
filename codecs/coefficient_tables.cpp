// The tables of the coefficient coder as bytes.
#include "codecs/coefficient_coder.h"
#include "codecs/integer_model.h"

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

}  // namespace

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

}  // namespace kinespace
