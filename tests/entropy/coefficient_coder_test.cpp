#include "kinespace/entropy/coefficient_coder.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

// Blocks of coefficients that shrink along both axes, as those of motion do.
struct Sample {
  int components = 12;
  std::vector<int> functions{40, 40, 17, 1, 64};
  std::vector<std::vector<double>> wanted, values;
  std::vector<CoefficientBlock> blocks;
  CoefficientTables tables;

  explicit Sample(double scale, unsigned seed = 1) {
    std::mt19937 generator(seed);
    tables.spectrum = {.components = components,
                       .level = std::vector<std::uint8_t>(static_cast<std::size_t>(components) * band_count, 6)};
    for (const int n : functions) {
      std::vector<double> w;
      for (int c = 0; c < components; ++c) {
        for (int k = 0; k < n; ++k) {
          const double uniform = (static_cast<double>(generator()) + 0.5) / 4294967296.0 - 0.5;
          w.push_back(-scale * std::copysign(std::log(1 - 2 * std::abs(uniform)), uniform) / (1 + c + 0.5 * k));
        }
      }
      wanted.push_back(w);
      values.emplace_back(w.size(), 0.0);
    }
    attach();
  }
  void attach() {
    blocks.clear();
    for (std::size_t b = 0; b < functions.size(); ++b) {
      blocks.push_back({.functions = functions[b],
                        .edges = band_edges(functions[b], functions[b], 30),
                        .follows = b > 0,
                        .wanted = wanted[b],
                        .values = values[b]});
    }
  }
};

std::vector<std::span<const std::byte>> spans(const std::vector<Bytes>& layers) {
  return {layers.begin(), layers.end()};
}

TEST(CoefficientCoder, a_decoder_has_what_the_encoder_says_it_has) {
  for (const double scale : {0.0, 0.3, 5.0, 4000.0, 1e9}) {
    Sample sample(scale);
    CodingStatistics statistics;
    const std::vector<Bytes> layers = encode_group(sample.blocks, sample.tables, 0.15, statistics);
    Sample decoded(scale);
    decode_group(decoded.blocks, sample.tables, spans(layers), "group");
    EXPECT_EQ(decoded.values, sample.values) << scale;
  }
}

TEST(CoefficientCoder, rounds_to_the_nearest_when_bits_are_worth_nothing) {
  Sample sample(20);
  CodingStatistics statistics;
  static_cast<void>(encode_group(sample.blocks, sample.tables, 0, statistics));
  for (std::size_t b = 0; b < sample.wanted.size(); ++b) {
    for (std::size_t i = 0; i < sample.wanted[b].size(); ++i) {
      EXPECT_LE(std::abs(sample.wanted[b][i] - sample.values[b][i]), 0.5 + 1e-12);
    }
  }
}

TEST(CoefficientCoder, a_higher_price_of_bits_gives_fewer_bytes_and_more_error) {
  std::size_t last_bytes = std::size_t{1} << 30;
  double last_error = -1;
  for (const double price : {0.0, 0.1, 0.5}) {
    Sample sample(6);
    CodingStatistics statistics;
    std::size_t bytes = 0;
    for (const Bytes& layer : encode_group(sample.blocks, sample.tables, price, statistics)) bytes += layer.size();
    EXPECT_LT(bytes, last_bytes);
    EXPECT_GT(statistics.squared_error, last_error);
    last_bytes = bytes;
    last_error = statistics.squared_error;
  }
}

TEST(CoefficientCoder, leaving_out_layers_leaves_the_functions_of_the_others) {
  Sample sample(50);
  CodingStatistics statistics;
  const std::vector<Bytes> layers = encode_group(sample.blocks, sample.tables, 0, statistics);
  for (std::size_t kept = 0; kept <= layers.size(); ++kept) {
    Sample decoded(50);
    auto parts = spans(layers);
    parts.resize(kept);
    decode_group(decoded.blocks, sample.tables, parts, "group");
    for (std::size_t b = 0; b < sample.values.size(); ++b) {
      const auto end = sample.blocks[b].edges[static_cast<std::size_t>(layer_bands[kept])];
      for (std::size_t i = 0; i < sample.values[b].size(); ++i) {
        const bool there = static_cast<int>(i % static_cast<std::size_t>(sample.functions[b])) < end;
        EXPECT_EQ(decoded.values[b][i], there ? sample.values[b][i] : 0);
      }
    }
  }
}

TEST(CoefficientCoder, learned_tables_save_bytes) {
  Sample plain(4);
  CodingStatistics statistics;
  std::size_t before = 0, after = 0;
  for (const Bytes& layer : encode_group(plain.blocks, plain.tables, 0, statistics)) before += layer.size();
  Sample learned(4);
  learned.tables.start = statistics.counts.learn();
  learned.tables.points = statistics.reconstruction();
  CodingStatistics again;
  for (const Bytes& layer : encode_group(learned.blocks, learned.tables, 0, again)) after += layer.size();
  EXPECT_LT(after, before);
  EXPECT_LE(again.squared_error, statistics.squared_error);
}

TEST(CoefficientCoder, tables_come_back) {
  Sample sample(4);
  CodingStatistics statistics;
  static_cast<void>(encode_group(sample.blocks, sample.tables, 0, statistics));
  const LearnedStart start = statistics.counts.learn();
  EXPECT_EQ(unpack_start(pack_start(start), "start").steps, start.steps);
  std::mt19937 generator(4);
  for (std::uint8_t& level : sample.tables.spectrum.level)
    level = static_cast<std::uint8_t>(generator() % Spectrum::levels);
  EXPECT_EQ(unpack_spectrum(pack_spectrum(sample.tables.spectrum), sample.components, "s").level,
            sample.tables.spectrum.level);
}

TEST(CoefficientCoder, damaged_groups_are_errors_or_other_values_and_never_worse) {
  Sample sample(20);
  CodingStatistics statistics;
  std::vector<Bytes> layers = encode_group(sample.blocks, sample.tables, 0, statistics);
  int errors = 0;
  for (std::size_t i = 0; i < layers[0].size(); ++i) {
    std::vector<Bytes> damaged = layers;
    damaged[0][i] ^= std::byte{0x41};
    Sample decoded(20);
    try {
      decode_group(decoded.blocks, sample.tables, spans(damaged), "group");
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      ++errors;
    }
  }
  EXPECT_GT(errors, 0);
  layers[1].resize(layers[1].size() / 2);
  EXPECT_THROW(decode_group(sample.blocks, sample.tables, spans(layers), "group"), Error);
}

}  // namespace
}  // namespace kinespace
