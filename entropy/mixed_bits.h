// Decisions whose probability several models guess together.
//
// Each model is an AdaptiveBit (entropy/range_coder.h) chosen by a context of its own; their guesses are added up on a
// logistic scale with weights that learn which model to believe (mahoney 2005, PAQ). Whole numbers only: the same on
// every machine.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "kinespace/entropy/range_coder.h"

namespace kinespace {

// The logistic function and its inverse: probabilities in 1/4096, logits in 1/256.
class LogisticScale {
 public:
  static constexpr int most = 2047;

  [[nodiscard]] static int probability(int logit) {
    if (logit > most) return 4095;
    if (logit < -most) return 1;
    const int part = logit & 127;
    const int at = (logit >> 7) + 16;
    return (knots[static_cast<std::size_t>(at)] * (128 - part) + knots[static_cast<std::size_t>(at) + 1] * part + 64) >>
           7;
  }
  [[nodiscard]] static int logit(std::uint32_t probability16) {
    static const std::array<std::int16_t, 4096> table = inverse();
    return table[probability16 >> 4];
  }

 private:
  static constexpr std::array<int, 33> knots{1,    2,    3,    6,    10,   16,   27,   45,   73,   120,  194,
                                             310,  488,  747,  1101, 1546, 2047, 2549, 2994, 3348, 3607, 3785,
                                             3901, 3975, 4022, 4050, 4068, 4079, 4085, 4089, 4092, 4093, 4094};
  static std::array<std::int16_t, 4096> inverse() {
    std::array<std::int16_t, 4096> out{};
    int at = 0;
    for (int x = -most; x <= most; ++x) {
      for (const int p = probability(x); at <= p; ++at)
        out[static_cast<std::size_t>(at)] = static_cast<std::int16_t>(x);
    }
    for (; at < 4096; ++at) out[static_cast<std::size_t>(at)] = most;
    return out;
  }
};

// One decision's models: `inputs` contexts are given each time, as indices into the tables of each input.
template <std::size_t inputs>
class MixedBit {
 public:
  using Contexts = std::array<std::size_t, inputs>;

  // So many contexts for each input, and `sets` sets of weights.
  MixedBit(const std::array<std::size_t, inputs>& sizes, std::size_t sets) : weights_(sets) {
    for (std::size_t i = 0; i < inputs; ++i) models_[i].resize(sizes[i]);
    for (auto& set : weights_) set.fill(65536 / 3);
  }

  // Of a 1, in 1/65536.
  [[nodiscard]] std::uint32_t probability(const Contexts& at, std::size_t set) const {
    return clamp(LogisticScale::probability(sum(at, set)));
  }
  void encode(bool bit, const Contexts& at, std::size_t set, RangeEncoder& coder) {
    const int p = LogisticScale::probability(sum(at, set));
    AdaptiveBit once(static_cast<std::uint16_t>(clamp(p)), 31);
    coder.encode(bit, once);
    learn(bit, at, set, p);
  }
  [[nodiscard]] bool decode(const Contexts& at, std::size_t set, RangeDecoder& coder) {
    const int p = LogisticScale::probability(sum(at, set));
    AdaptiveBit once(static_cast<std::uint16_t>(clamp(p)), 31);
    const bool bit = coder.decode(once);
    learn(bit, at, set, p);
    return bit;
  }

 private:
  static std::uint32_t clamp(int p12) { return static_cast<std::uint32_t>(std::clamp(p12, 1, 4095)) * 16; }
  [[nodiscard]] int sum(const Contexts& at, std::size_t set) const {
    std::int64_t total = 0;
    for (std::size_t i = 0; i < inputs; ++i) {
      total += static_cast<std::int64_t>(weights_[set][i]) * LogisticScale::logit(models_[i][at[i]].probability());
    }
    return static_cast<int>(std::clamp<std::int64_t>(total / 65536, -LogisticScale::most, LogisticScale::most));
  }
  void learn(bool bit, const Contexts& at, std::size_t set, int p12) {
    const int miss = (bit ? 4096 : 0) - p12;
    for (std::size_t i = 0; i < inputs; ++i) {
      const int logit = LogisticScale::logit(models_[i][at[i]].probability());
      const std::int64_t step = static_cast<std::int64_t>(logit) * miss * 6 / 1024;
      weights_[set][i] = static_cast<std::int32_t>(
          std::clamp<std::int64_t>(weights_[set][i] + step, -(std::int64_t{1} << 20), std::int64_t{1} << 20));
      models_[i][at[i]].learn(bit);
    }
  }

  std::array<std::vector<AdaptiveBit>, inputs> models_;
  std::vector<std::array<std::int32_t, inputs>> weights_;
};

// Bits that a decision of this probability (of what happens, in 1/65536) costs.
[[nodiscard]] inline double bits_of(std::uint32_t probability16) {
  static const std::array<double, 4097> table = [] {
    std::array<double, 4097> out{};
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = -std::log2(std::max(static_cast<double>(i), 0.5) / 4096);
    return out;
  }();
  return table[std::min<std::uint32_t>(probability16 >> 4, 4096)];
}

}  // namespace kinespace
