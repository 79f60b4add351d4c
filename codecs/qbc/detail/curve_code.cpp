#include "kinespace/codecs/qbc/detail/curve_code.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "kinespace/base/error.h"
#include "kinespace/codecs/qbc/detail/curve_priors.h"

namespace kinespace {
namespace {

constexpr double farthest = 1e7;  // values beyond this, in degrees and such, are damage
constexpr std::int64_t largest_number = std::int64_t{1} << 26;

// 2 log2 of a whole number, rounded down.
int half_octaves(int x) {
  const int whole = bit_length(static_cast<std::uint64_t>(x)) - 1;
  return 2 * whole + (std::int64_t{x} * x >= (std::int64_t{1} << (2 * whole + 1)) ? 1 : 0);
}

int class_of(int x) {
  return std::min(bit_length(static_cast<std::uint64_t>(x)), 11);
}

template <typename Coder>
class CurveCoder {
 public:
  CurveCoder(Coder& coder, const CurveShape& shape, const std::string& source)
      : coder_(coder), shape_(shape), source_(source), context_(shape.dimensions) {}

  void number(PointKind kind, std::size_t d, std::int64_t& value) {
    const auto k = static_cast<std::size_t>(kind);
    const auto size = static_cast<std::size_t>(context_.next(kind, d));
    bool nonzero = value != 0;
    code_bit(coder_, models_.zero[k][size], nonzero);
    if (!nonzero) {
      value = 0;
    } else {
      bool negative = value < 0;
      code_even(coder_, negative);
      std::int64_t magnitude = std::abs(value);
      code_magnitude(models_.exponent[k][size], models_.second[k], magnitude);
      value = negative ? -magnitude : magnitude;
    }
    context_.see(kind, d, value);
  }
  void begin_point(int length) { context_.begin_point(length); }

  void corrections(std::vector<FrameCorrection>& list) {
    const int turns = corrected_turns(shape_.dimensions);
    if (turns > 0 && !CorrectionCoder<Coder>(coder_, shape_.frames, turns).code(list)) damaged();
  }

  // Lengths of the segments of an interval of `rest` frames, whole grid steps but for the last.
  void lengths(int rest, std::vector<int>& out) {
    int before = 0;
    for (std::size_t i = 0;; ++i) {
      const int places = (rest - 1) / shape_.grid;  // where a break may stand before the end
      if constexpr (!encodes<Coder>) out.push_back(rest);
      bool last = places == 0 || out[i] == rest;
      if (places > 0) code_bit(coder_, models_.segments[std::min<std::size_t>(i, 2)][class_at(places)], last);
      if (last) return;
      int steps = out[i] / shape_.grid;
      code_length(class_at(before), steps);
      if constexpr (!encodes<Coder>) {
        if (steps > places || coder_.overrun()) damaged();
        out[i] = steps * shape_.grid;
      }
      before = steps;
      rest -= out[i];
    }
  }

  [[noreturn]] void damaged() const {
    throw Error(ErrorKind::bad_input, {.file = source_,
                                       .found = "a curve that ends too early or too late, or has numbers out of range",
                                       .expected = "what the encoder writes (damaged)"});
  }

 private:
  static std::size_t class_at(int x) { return static_cast<std::size_t>(class_of(x)); }

  void code_magnitude(std::array<AdaptiveBit, CurveModels::exponents>& models,
                      std::array<AdaptiveBit, CurveModels::exponents>& second, std::int64_t& magnitude) {
    int exponent = encodes<Coder> ? bit_length(static_cast<std::uint64_t>(magnitude)) - 1 : 0;
    for (int e = 0;; ++e) {
      bool more = e < exponent;
      code_bit(coder_, models[static_cast<std::size_t>(e)], more);
      if (!more) {
        exponent = e;
        break;
      }
      if constexpr (!encodes<Coder>) {
        if (e + 2 == CurveModels::exponents) damaged();
      }
    }
    std::int64_t out = 1;
    for (int i = exponent - 1; i >= 0; --i) {
      bool bit = ((magnitude >> i) & 1) != 0;
      if (i == exponent - 1) {
        code_bit(coder_, second[static_cast<std::size_t>(exponent)], bit);
      } else {
        code_even(coder_, bit);
      }
      out = 2 * out + (bit ? 1 : 0);
    }
    magnitude = out;
  }

  void code_length(std::size_t before, int& steps) {
    const int exponent = encodes<Coder> ? bit_length(static_cast<std::uint64_t>(steps)) - 1 : 0;
    int e = 0;
    for (; e < 11; ++e) {
      bool more = e < exponent;
      code_bit(coder_, models_.length[before][static_cast<std::size_t>(e)], more);
      if (!more) break;
    }
    int out = 1;
    for (int i = e - 1; i >= 0; --i) {
      bool bit = ((steps >> i) & 1) != 0;
      if (i == e - 1) {
        code_bit(coder_, models_.length_top[static_cast<std::size_t>(e)], bit);
      } else {
        code_even(coder_, bit);
      }
      out = 2 * out + (bit ? 1 : 0);
    }
    steps = out;
  }

  Coder& coder_;
  const CurveShape& shape_;
  const std::string& source_;
  CurveModels models_;
  SizeContext context_;
};

class CurveDecoder {
 public:
  CurveDecoder(const CurveShape& shape, std::span<const std::byte> bytes, const std::string& source)
      : shape_(shape), n_(static_cast<std::size_t>(shape.dimensions)), coder_(bytes), code_(coder_, shape, source) {}

  std::vector<double> common(std::vector<FrameCorrection>& corrections) {
    code_.corrections(corrections);
    std::vector<double> out;
    const double step = end_step(shape_.step(), 16, 16);
    for (int i = 0; i <= shape_.interval_count(); ++i) {
      code_.begin_point(1);
      for (std::size_t d = 0; d < n_; ++d) {
        std::int64_t number = 0;
        code_.number(PointKind::common, d, number);
        const double before = i > 0 ? out[out.size() - n_] : 0, earlier = i > 1 ? out[out.size() - 2 * n_] : 0;
        out.push_back(checked(expected_common(i, before, earlier) + static_cast<double>(number) * step));
      }
      check_coder();
    }
    return out;
  }

  CodedCurve whole() {
    CodedCurve out{.breaks = {0}, .step_index = shape_.step_index};
    const std::vector<double> goals = common(out.corrections);
    out.ends.assign(goals.begin(), goals.begin() + static_cast<std::ptrdiff_t>(n_));
    CurvePredictor predictor(shape_);
    std::vector<int> lengths;
    for (int i = 0; i < shape_.interval_count(); ++i) {
      lengths.clear();
      int rest = shape_.common_break(i + 1) - shape_.common_break(i);
      code_.lengths(rest, lengths);
      const double* goal = goals.data() + static_cast<std::size_t>(i + 1) * n_;
      for (std::size_t s = 0; s < lengths.size(); ++s) {
        segment(lengths[s], s + 1 < lengths.size() ? lengths[s + 1] : 0, rest, goal, predictor, out);
        rest -= lengths[s];
      }
    }
    check_coder();
    if (!coder_.used_up()) code_.damaged();
    return out;
  }

 private:
  // `next`: the length of the segment after it, 0 when it ends at the common break.
  void segment(int length, int next, int rest, const double* goal, CurvePredictor& predictor, CodedCurve& out) {
    Point start{}, middle{}, end{};
    std::copy(out.ends.end() - static_cast<std::ptrdiff_t>(n_), out.ends.end(), start.begin());
    predictor.begin(start.data(), length, rest);
    code_.begin_point(length);
    const double coarse = next > 0 ? end_step(shape_.step(), length, next) : 0;
    for (std::size_t d = 0; d < n_; ++d) {
      if (next == 0) {
        end[d] = goal[d];
        continue;
      }
      std::int64_t number = 0;
      code_.number(PointKind::end, d, number);
      end[d] = checked(predictor.end(d, goal[d]) + static_cast<double>(number) * coarse);
    }
    code_.begin_point(length);
    const double fine = middle_step(shape_.step(), length);
    for (std::size_t d = 0; d < n_; ++d) {
      std::int64_t number = 0;
      if (length > 1) code_.number(PointKind::middle, d, number);
      middle[d] = checked(predictor.middle(d, end[d]) + static_cast<double>(number) * fine);
    }
    predictor.advance(length, middle.data(), end.data());
    out.breaks.push_back(out.breaks.back() + length);
    out.ends.insert(out.ends.end(), end.begin(), end.begin() + static_cast<std::ptrdiff_t>(n_));
    out.middles.insert(out.middles.end(), middle.begin(), middle.begin() + static_cast<std::ptrdiff_t>(n_));
    if (coder_.overrun()) code_.damaged();
  }
  [[nodiscard]] double checked(double value) const {
    if (!(std::abs(value) <= farthest)) code_.damaged();
    return value;
  }
  void check_coder() const {
    if (coder_.overrun()) code_.damaged();
  }

  const CurveShape& shape_;
  std::size_t n_;
  RangeDecoder coder_;
  CurveCoder<RangeDecoder> code_;
};

}  // namespace

double expected_common(int count, double before, double earlier) {
  return count > 1 ? before + curve_priors::back * (earlier - before) : before;
}

double end_step(double step, int length_before, int length_after) {
  // A point in the middle of 32 frames has the step itself.
  return step * quarter_step(half_octaves(length_before + length_after) - 10);
}

double middle_step(double step, int length) {
  return step * quarter_step(half_octaves(length) - 9);
}

void CurvePredictor::begin(const double* start, int length, int rest) {
  start_ = start;
  half_length_ = length / 2.0;
  const double share = static_cast<double>(length) / rest;
  if (length_before_ == 0) {
    onwards_ = smooth_ = 0;
    towards_ = curve_priors::first_towards * share;
    return;
  }
  // The slope of a segment that was much shorter says little, and less about short segments, which are where it turns.
  const double ratio = static_cast<double>(length_before_) / length - 0.1;
  const double near = std::min(length / 6.0, 1.0);
  onwards_ = curve_priors::onwards * std::clamp(ratio / 0.8, 0.0, 1.0) * near * length;
  towards_ = (curve_priors::towards + curve_priors::towards_last * share) * share;
  smooth_ = length > 1 ? curve_priors::smooth * std::clamp(ratio / 0.5, 0.0, 1.0) : 0;
}

void CurvePredictor::advance(int length, const double* middle, const double* end) {
  for (std::size_t d = 0; d < static_cast<std::size_t>(shape_.dimensions); ++d) {
    slope_[d] = length > 1 ? 2 * (end[d] - middle[d]) / length : end[d] - start_[d];
  }
  length_before_ = length;
}

CurveModels::CurveModels() {
  constexpr std::uint8_t trust = 6;
  for (std::size_t k = 0; k < kinds; ++k) {
    for (std::size_t s = 0; s < sizes; ++s) {
      zero[k][s] = {curve_priors::nonzero[k][s], trust};
      for (std::size_t e = 0; e < curve_priors::more[k][s].size(); ++e) {
        exponent[k][s][e] = {curve_priors::more[k][s][e], trust};
      }
    }
  }
  for (auto& kind : second) {
    for (std::size_t e = 0; e < kind.size(); ++e) {
      kind[e] = {curve_priors::second[std::min(e, curve_priors::second.size() - 1)], trust};
    }
  }
  for (std::size_t i = 0; i < segments.size(); ++i) {
    for (std::size_t c = 0; c < segments[i].size(); ++c) segments[i][c] = {curve_priors::last[i][c], trust};
  }
  for (std::size_t b = 0; b < length.size(); ++b) {
    for (std::size_t e = 0; e < length[b].size(); ++e) length[b][e] = {curve_priors::longer[e], trust};
  }
}

int SizeContext::next(PointKind kind, std::size_t d) const {
  const auto k = static_cast<std::size_t>(kind);
  const std::int64_t before = (last_[k][d] * length_ + last_length_[k] / 2) / last_length_[k];
  const std::int64_t beside = known_ > 0 ? 4 * sum_ / known_ : before;
  const std::int64_t size = (before + beside + 1) / 2;  // about four times the magnitude expected
  constexpr std::array<std::int64_t, CurveModels::sizes - 1> bounds{1, 3, 6, 12, 26, 56, 120};
  return static_cast<int>(std::ranges::upper_bound(bounds, size) - bounds.begin());
}

void SizeContext::see(PointKind kind, std::size_t d, std::int64_t value) {
  const auto k = static_cast<std::size_t>(kind);
  const std::int64_t magnitude = std::min(std::abs(value), largest_number);
  const std::int64_t before = (last_[k][d] * length_ + last_length_[k] / 2) / last_length_[k];
  fresh_[d] = (before + 4 * magnitude + 1) / 2;
  sum_ += magnitude;
  ++known_;
  if (known_ < dimensions_) return;
  last_[k] = fresh_;
  last_length_[k] = length_;
}

double number_bits(PointKind kind, int size, std::int64_t value) {
  const auto k = static_cast<std::size_t>(kind);
  const auto s = static_cast<std::size_t>(size);
  const double nonzero = curve_priors::nonzero[k][s] / 65536.0;
  if (value == 0) return -std::log2(1 - nonzero);
  const int exponent = bit_length(static_cast<std::uint64_t>(std::abs(value))) - 1;
  double bits = 1 - std::log2(nonzero) + exponent;
  for (int e = 0; e <= exponent; ++e) {
    const auto at = std::min(static_cast<std::size_t>(e), curve_priors::more[k][s].size() - 1);
    const double more = curve_priors::more[k][s][at] / 65536.0;
    bits -= std::log2(e < exponent ? more : 1 - more);
  }
  return bits;
}

Bytes encode_curve(const CurveShape& shape, const CurveNumbers& numbers) {
  RangeEncoder coder;
  const std::string none;
  CurveCoder<RangeEncoder> code(coder, shape, none);
  const auto n = static_cast<std::size_t>(shape.dimensions);
  std::vector<FrameCorrection> corrections = numbers.corrections;
  code.corrections(corrections);
  for (std::size_t i = 0; i < numbers.common.size(); ++i) {
    if (i % n == 0) code.begin_point(1);
    std::int64_t number = numbers.common[i];
    code.number(PointKind::common, i % n, number);
  }
  std::size_t at = 0, segment = 0;
  const auto put_point = [&](PointKind kind, int length) {
    code.begin_point(length);
    for (std::size_t d = 0; d < n; ++d) {
      std::int64_t number = numbers.points[at++];
      code.number(kind, d, number);
    }
  };
  for (int i = 0; i < shape.interval_count(); ++i) {
    std::vector<int> lengths;
    const int last = shape.common_break(i + 1);
    for (std::size_t s = segment; numbers.breaks[s] < last; ++s) {
      lengths.push_back(numbers.breaks[s + 1] - numbers.breaks[s]);
    }
    code.lengths(last - shape.common_break(i), lengths);
    for (std::size_t s = 0; s < lengths.size(); ++s) {
      if (s + 1 < lengths.size()) put_point(PointKind::end, lengths[s]);
      if (lengths[s] > 1) put_point(PointKind::middle, lengths[s]);
    }
    segment += lengths.size();
  }
  return std::move(coder).finish();
}

CodedCurve decode_curve(const CurveShape& shape, std::span<const std::byte> bytes, const std::string& source) {
  return CurveDecoder(shape, bytes, source).whole();
}

std::vector<double> decode_common(const CurveShape& shape, std::span<const std::byte> bytes,
                                  const std::string& source) {
  std::vector<FrameCorrection> corrections;
  std::vector<double> out = CurveDecoder(shape, bytes, source).common(corrections);
  const auto n = static_cast<std::size_t>(shape.dimensions);
  for (const FrameCorrection& one : corrections) {
    if (one.frame % shape.interval != 0 && one.frame != shape.frames - 1) continue;
    const auto i = static_cast<std::size_t>((one.frame + shape.interval - 1) / shape.interval);
    for (std::size_t d = 3; d < n; ++d) out[i * n + d] += one.turn(d - 3, shape.step_index);
  }
  return out;
}

}  // namespace kinespace
