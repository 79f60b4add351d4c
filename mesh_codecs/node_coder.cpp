#include "kinespace/mesh_codecs/node_coder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "kinespace/base/error.h"
#include "kinespace/entropy/mixed_bits.h"

namespace kinespace {
namespace {

constexpr int axes = 3;
constexpr std::int64_t largest = std::int64_t{1} << 30;
constexpr int exponents = 32;
constexpr int classes = 10;  // of sums of magnitudes

// 0, 1, 2, 3-4, 5-6, 7-9, 10-14, 15-22, 23-40, above.
std::size_t class_of(int sum) {
  constexpr std::array<std::uint8_t, 41> table = [] {
    std::array<std::uint8_t, 41> out{};
    constexpr std::array<int, classes - 1> ends{1, 2, 3, 5, 7, 10, 15, 23, 41};
    for (int s = 0; s < 41; ++s) {
      for (const int end : ends)
        out[static_cast<std::size_t>(s)] = static_cast<std::uint8_t>(out[static_cast<std::size_t>(s)] + (s >= end));
    }
    return out;
  }();
  return table[static_cast<std::size_t>(std::min(sum, 40))];
}

struct Contexts {
  MixedBit<5>::Contexts at{};
  std::size_t set = 0;
  std::size_t size = 0;  // class of all that is near
};

// What is known of each node.
class Memory {
 public:
  explicit Memory(const NodeGraph& graph)
      : graph_(graph),
        now_(static_cast<std::size_t>(graph.nodes()) * axes),
        before_(now_.size()),
        earlier_(now_.size()),
        lively_(static_cast<std::size_t>(graph.nodes())) {}

  void next_component() {
    for (std::size_t n = 0; n < lively_.size(); ++n) {
      const int sum = now_[3 * n] + now_[3 * n + 1] + now_[3 * n + 2];
      lively_[n] = static_cast<std::uint16_t>(lively_[n] - lively_[n] / 4 + 8 * std::min(sum, 30));
    }
    earlier_.swap(before_);
    before_.swap(now_);
    std::fill(now_.begin(), now_.end(), std::uint8_t{0});
    ++component_;
  }
  void enter(int node) {
    near_lively_ = 0;
    near_.fill(0);
    int count = 0;
    for (const std::int32_t m : graph_.of(node)) {
      const auto i = static_cast<std::size_t>(m) * axes;
      for (std::size_t d = 0; d < axes; ++d) near_[d] += now_[i + d];
      near_lively_ += lively_[static_cast<std::size_t>(m)];
      ++count;
    }
    if (count > 0) near_lively_ /= count;
  }
  [[nodiscard]] Contexts contexts(int node, int axis) const {
    const auto n = static_cast<std::size_t>(node) * axes;
    const auto d = static_cast<std::size_t>(axis);
    const int all_near = near_[0] + near_[1] + near_[2];
    const int near = all_near + near_[d];
    int own = 0;
    for (std::size_t e = 0; e < d; ++e) own += now_[n + e];
    const int before = 2 * before_[n + d] + before_[n + (d + 1) % 3] + before_[n + (d + 2) % 3] + earlier_[n + d];
    const int lively = lively_[static_cast<std::size_t>(node)];
    Contexts out;
    const std::size_t near_class = class_of(near), before_class = class_of(before);
    out.at[0] = near_class * classes + class_of(own);
    out.at[1] = before_class * classes + class_of(lively / 6);
    out.at[2] = class_of(static_cast<int>(near_lively_ / 6)) * classes + class_of(lively / 6);
    out.at[3] = static_cast<std::size_t>(graph_.band[static_cast<std::size_t>(node)]) * 32 +
                static_cast<std::size_t>(std::min(component_, 31));
    out.size = class_of((near + 2 * own + before + lively / 8 + static_cast<int>(near_lively_ / 8)) / 2);
    out.at[4] = out.size * axes + d;
    out.set = out.size;
    return out;
  }
  void set(int node, int axis, std::int64_t magnitude) {
    now_[static_cast<std::size_t>(node) * axes + static_cast<std::size_t>(axis)] =
        static_cast<std::uint8_t>(std::min<std::int64_t>(magnitude, 30));
  }

 private:
  const NodeGraph& graph_;
  std::vector<std::uint8_t> now_, before_, earlier_;
  std::vector<std::uint16_t> lively_;
  std::array<int, 3> near_{};
  std::int64_t near_lively_ = 0;  // a vertex may have millions of neighbours
  int component_ = 0;
};

struct Models {
  static constexpr std::array<std::size_t, 5> sizes{classes * classes, classes* classes, classes* classes,
                                                    NodeGraph::bands * 32, classes* axes};
  MixedBit<5> nonzero{sizes, classes};
  MixedBit<5> more{sizes, classes};
  std::array<std::array<AdaptiveBit, exponents>, classes> exponent;
  std::array<AdaptiveBit, exponents> mantissa;
  AdaptiveBit filled;  // a component that is not all zeros
};

class Writer {
 public:
  [[nodiscard]] double cost(std::int64_t magnitude, const Contexts& at) const {
    const std::uint32_t p = models_.nonzero.probability(at.at, at.set);
    if (magnitude == 0) return bits_of(65536 - p);
    double bits = bits_of(p) + 1;
    const std::uint32_t more = models_.more.probability(at.at, at.set);
    if (magnitude == 1) return bits + bits_of(65536 - more);
    bits += bits_of(more);
    const int exponent = bit_length(static_cast<std::uint64_t>(magnitude - 1)) - 1;
    for (int e = 0; e <= exponent; ++e) {
      const std::uint32_t on = models_.exponent[at.size][static_cast<std::size_t>(e)].probability();
      bits += bits_of(e < exponent ? on : 65536 - on);
    }
    return bits + exponent;
  }
  void filled(bool any) { coder_.encode(any, models_.filled); }
  void write(std::int64_t value, const Contexts& at) {
    const std::int64_t magnitude = std::abs(value);
    models_.nonzero.encode(magnitude > 0, at.at, at.set, coder_);
    if (magnitude == 0) return;
    coder_.encode_even(value < 0);
    models_.more.encode(magnitude > 1, at.at, at.set, coder_);
    if (magnitude == 1) return;
    const auto rest = static_cast<std::uint64_t>(magnitude - 1);
    const int exponent = bit_length(rest) - 1;
    for (int e = 0; e <= exponent; ++e) {
      coder_.encode(e < exponent, models_.exponent[at.size][static_cast<std::size_t>(e)]);
    }
    for (int i = exponent - 1; i >= 0; --i) {
      const bool bit = ((rest >> i) & 1) != 0;
      if (i == exponent - 1) {
        coder_.encode(bit, models_.mantissa[static_cast<std::size_t>(exponent)]);
      } else {
        coder_.encode_even(bit);
      }
    }
  }
  [[nodiscard]] Bytes finish() { return std::move(coder_).finish(); }

 private:
  Models models_;
  RangeEncoder coder_;
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : coder_(bytes) {}
  bool filled() { return coder_.decode(models_.filled); }
  std::int64_t read(const Contexts& at) {
    if (!models_.nonzero.decode(at.at, at.set, coder_)) return 0;
    const bool negative = coder_.decode_even();
    std::int64_t magnitude = 1;
    if (models_.more.decode(at.at, at.set, coder_)) magnitude = 1 + rest(at);
    return negative ? -magnitude : magnitude;
  }
  [[nodiscard]] bool overrun() const { return coder_.overrun(); }
  [[nodiscard]] bool whole() const { return !coder_.overrun() && coder_.used_up(); }

 private:
  std::int64_t rest(const Contexts& at) {
    int exponent = 0;
    while (coder_.decode(models_.exponent[at.size][static_cast<std::size_t>(exponent)])) {
      if (++exponent == exponents - 1) return 2 * largest;
    }
    std::int64_t out = 1;
    for (int i = exponent - 1; i >= 0; --i) {
      const bool bit = i == exponent - 1 ? coder_.decode(models_.mantissa[static_cast<std::size_t>(exponent)])
                                         : coder_.decode_even();
      out = 2 * out + (bit ? 1 : 0);
    }
    return out;
  }
  Models models_;
  RangeDecoder coder_;
};

// |q| = 1, 2 and more lie beside their number by so many 1/64 steps; a byte each before the code.
using Shifts = std::array<std::int8_t, 3>;
double value_of(std::int64_t q, const Shifts& shifts) {
  if (q == 0) return 0;
  const std::int64_t size = std::abs(q);
  const double at =
      static_cast<double>(size) + shifts[static_cast<std::size_t>(std::min<std::int64_t>(size, 3)) - 1] / 64.0;
  return q < 0 ? -at : at;
}

Shifts shifts_of(std::span<const double> wanted, std::span<const std::int64_t> chosen) {
  std::array<double, 3> sum{}, count{};
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const std::int64_t size = std::abs(chosen[i]);
    if (size == 0) continue;
    const auto c = static_cast<std::size_t>(std::min<std::int64_t>(size, 3)) - 1;
    sum[c] += std::abs(wanted[i]) - static_cast<double>(size);
    count[c] += 1;
  }
  Shifts out{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double mean = count[c] > 0 ? sum[c] / count[c] : 0;
    out[c] = static_cast<std::int8_t>(std::lround(std::clamp(64 * mean, -60.0, 60.0)));
  }
  return out;
}

std::int64_t choose(double wanted, const Contexts& at, double rate_weight, const Writer& writer) {
  const double size = std::abs(wanted);
  if (!(size < static_cast<double>(largest))) {
    throw Error(ErrorKind::usage, {.found = "a coefficient of more than 2^30 quantiser steps",
                                   .expected = "a larger error",
                                   .remedy = "ask for less precision"});
  }
  const auto nearest = static_cast<std::int64_t>(size + 0.5);
  std::int64_t best = nearest;
  double least = -1;
  const std::int64_t lowest = nearest <= 2 ? 0 : nearest - 1;
  if (nearest == 0) return 0;
  for (std::int64_t m = nearest; m >= lowest; --m) {
    const double off = size - static_cast<double>(m);
    const double price = off * off + rate_weight * writer.cost(m, at);
    if (least < 0 || price < least) {
      least = price;
      best = m;
    }
  }
  return wanted < 0 ? -best : best;
}

}  // namespace

CodedNodes encode_nodes(const NodeValues& wanted, const NodeGraph& graph, double rate_weight) {
  const std::size_t row = static_cast<std::size_t>(graph.nodes()) * axes;
  std::vector<std::int64_t> chosen(wanted.value.size());
  Writer writer;
  Memory memory(graph);
  for (int r = 0; r < wanted.components; ++r) {
    const std::size_t base = static_cast<std::size_t>(r) * row;
    const auto values = std::span(wanted.value).subspan(base, row);
    const bool any = std::any_of(values.begin(), values.end(), [](double v) { return !(std::abs(v) < 0.55); });
    writer.filled(any);
    if (any) {
      for (int n = 0; n < graph.nodes(); ++n) {
        memory.enter(n);
        for (int d = 0; d < axes; ++d) {
          const auto i = static_cast<std::size_t>(n * axes + d);
          const Contexts at = memory.contexts(n, d);
          const std::int64_t q = choose(values[i], at, rate_weight, writer);
          writer.write(q, at);
          memory.set(n, d, std::abs(q));
          chosen[base + i] = q;
        }
      }
    }
    memory.next_component();
  }
  const Shifts shifts = shifts_of(wanted.value, chosen);
  CodedNodes out;
  for (const std::int8_t s : shifts) out.bytes.push_back(static_cast<std::byte>(s));
  const Bytes code = writer.finish();
  out.bytes.insert(out.bytes.end(), code.begin(), code.end());
  out.decoded.components = wanted.components;
  out.decoded.value.resize(chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    out.decoded.value[i] = value_of(chosen[i], shifts);
    out.squared_error += (wanted.value[i] - out.decoded.value[i]) * (wanted.value[i] - out.decoded.value[i]);
  }
  return out;
}

NodeValues decode_nodes(std::span<const std::byte> bytes, int components, const NodeGraph& graph,
                        const std::string& source) {
  const auto damaged = [&]() {
    throw Error(ErrorKind::bad_input, {.file = source,
                                       .found = "coefficients that end too early or too late",
                                       .expected = "as many as the tables say (damaged)"});
  };
  Shifts shifts{};
  if (bytes.size() < shifts.size()) damaged();
  for (std::size_t c = 0; c < shifts.size(); ++c) shifts[c] = static_cast<std::int8_t>(bytes[c]);
  const std::size_t row = static_cast<std::size_t>(graph.nodes()) * axes;
  NodeValues out;
  out.components = components;
  out.value.resize(row * static_cast<std::size_t>(components));
  Reader reader(bytes.subspan(shifts.size()));
  Memory memory(graph);
  for (int r = 0; r < components; ++r) {
    const std::size_t base = static_cast<std::size_t>(r) * row;
    if (reader.filled()) {
      for (int n = 0; n < graph.nodes(); ++n) {
        memory.enter(n);
        for (int d = 0; d < axes; ++d) {
          const std::int64_t q = reader.read(memory.contexts(n, d));
          if (std::abs(q) > largest) damaged();
          memory.set(n, d, std::abs(q));
          out.value[base + static_cast<std::size_t>(n * axes + d)] = value_of(q, shifts);
        }
        if (reader.overrun()) damaged();
      }
    }
    memory.next_component();
  }
  if (!reader.whole()) damaged();
  return out;
}

}  // namespace kinespace
