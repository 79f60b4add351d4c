// Frames of the travel root whose turns are sent more finely than the curve gives them: those where the file's own
// angles are near their poles, so that a small turn moves them far (codecs/qbc/detail/pole_corrections.h).
//
// They stand before the curve's common breaks, so that a preview has them too: for each a bit that there is one more,
// the distance from the last one, how many octaves its step is finer than the curve's, and a number of steps for each
// turn. Private to this folder.
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <type_traits>
#include <vector>

#include "kinespace/codecs/qbc/detail/curve_task.h"
#include "kinespace/entropy/range_coder.h"

namespace kinespace {

struct FrameCorrection {
  static constexpr int octaves = 8;
  static constexpr int digits = 16;  // of a number of steps
  int frame = 0;
  int octave = 0;
  std::array<std::int32_t, 3> steps{};

  // What is added to a turn, where the curve's step has that index.
  [[nodiscard]] double turn(std::size_t t, int step_index) const {
    return static_cast<double>(steps[t]) * quarter_step(step_index + 4 * octave);
  }
};

// Turns that can be corrected: those of the travel root, which stand behind its position.
[[nodiscard]] constexpr int corrected_turns(int dimensions) {
  return dimensions > 3 ? dimensions - 3 : 0;
}

// Coding and decoding are one piece of code: `bit` is written by a RangeEncoder, and set by a RangeDecoder.
template <typename Coder>
inline constexpr bool encodes = std::is_same_v<Coder, RangeEncoder>;

template <typename Coder>
void code_bit(Coder& coder, AdaptiveBit& model, bool& bit) {
  if constexpr (encodes<Coder>) {
    coder.encode(bit, model);
  } else {
    bit = coder.decode(model);
  }
}

template <typename Coder>
void code_even(Coder& coder, bool& bit) {
  if constexpr (encodes<Coder>) {
    coder.encode_even(bit);
  } else {
    bit = coder.decode_even();
  }
}

// The list is written or filled. `valid` is false when a decoder met what no encoder writes.
template <typename Coder>
class CorrectionCoder {
 public:
  CorrectionCoder(Coder& coder, int frames, int turns) : coder_(coder), frames_(frames), turns_(turns) {}

  [[nodiscard]] bool code(std::vector<FrameCorrection>& list) {
    int last = -1;
    for (std::size_t i = 0;; ++i) {
      bool more = i < list.size();
      code_bit(coder_, more_[i > 0 ? 1 : 0], more);
      if (!more) return true;
      if constexpr (!encodes<Coder>) list.emplace_back();
      if (!code_one(list[i], last)) return false;
      last = list[i].frame;
    }
  }

 private:
  [[nodiscard]] bool code_one(FrameCorrection& one, int last) {
    std::int64_t gap = one.frame - last;
    if (!code_magnitude(gap_, gap)) return false;
    if (gap >= frames_ - last) return false;
    one.frame = last + static_cast<int>(gap);
    std::size_t node = 1;
    for (int place = FrameCorrection::octaves / 2; place > 0; place /= 2) {
      bool bit = (one.octave & place) != 0;
      code_bit(coder_, octave_[node], bit);
      node = 2 * node + (bit ? 1 : 0);
    }
    one.octave = static_cast<int>(node) - FrameCorrection::octaves;
    for (std::size_t t = 0; t < static_cast<std::size_t>(turns_); ++t) {
      if (!code_steps(one.steps[t])) return false;
    }
    if constexpr (!encodes<Coder>) return !coder_.overrun();
    return true;
  }

  [[nodiscard]] bool code_steps(std::int32_t& steps) {
    bool nonzero = steps != 0;
    code_bit(coder_, nonzero_, nonzero);
    if (!nonzero) return true;
    bool negative = steps < 0;
    code_even(coder_, negative);
    std::int64_t magnitude = std::abs(steps);
    if (!code_magnitude(magnitude_, magnitude) || magnitude >= (1 << FrameCorrection::digits)) return false;
    steps = static_cast<std::int32_t>(negative ? -magnitude : magnitude);
    return true;
  }

  // At least 1.
  template <std::size_t N>
  [[nodiscard]] bool code_magnitude(std::array<AdaptiveBit, N>& models, std::int64_t& value) {
    const int exponent = encodes<Coder> ? bit_length(static_cast<std::uint64_t>(value)) - 1 : 0;
    int e = 0;
    for (;; ++e) {
      bool more = e < exponent;
      code_bit(coder_, models[static_cast<std::size_t>(e)], more);
      if (!more) break;
      if (static_cast<std::size_t>(e) + 1 == N) return false;
    }
    std::int64_t out = 1;
    for (int i = e - 1; i >= 0; --i) {
      bool bit = ((value >> i) & 1) != 0;
      code_even(coder_, bit);
      out = 2 * out + (bit ? 1 : 0);
    }
    value = out;
    return true;
  }

  Coder& coder_;
  int frames_;
  int turns_;
  std::array<AdaptiveBit, 2> more_{AdaptiveBit(1500, 6), AdaptiveBit(58000, 4)};
  std::array<AdaptiveBit, 31> gap_;
  std::array<AdaptiveBit, FrameCorrection::octaves> octave_;
  AdaptiveBit nonzero_;
  std::array<AdaptiveBit, FrameCorrection::digits + 1> magnitude_;
};

}  // namespace kinespace
