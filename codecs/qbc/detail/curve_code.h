// The code of one joint's curve in a qbc stream: quadratic Bezier segments with quantised control points.
//
//   - of the travel root: frames that are corrected (codecs/qbc/detail/frame_corrections.h)
//   - the curve at the common breaks, every `interval` frames and at the last (the paper's I frames): a preview reads
//     no further
//   - for each interval: how many segments, their lengths in grid steps; then for each its end (but for the last, whose
//     end is there already) and its middle
//
// Every number is a whole number of steps away from a prediction that both sides make from what is there: ends go on
// with the slope of the segment before and towards the next common break, middles lean on both ends and on that slope.
// A control point that counts for more frames has a finer step. Private to this folder.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kinespace/codecs/qbc/detail/curve_task.h"
#include "kinespace/codecs/qbc/detail/frame_corrections.h"
#include "kinespace/entropy/range_coder.h"

namespace kinespace {

struct CurveShape {
  int frames = 0;
  int dimensions = 0;
  int interval = 160;
  int grid = 1;
  int step_index = 0;

  [[nodiscard]] double step() const { return quarter_step(step_index); }
  // Common breaks: 0, interval, 2 interval, .. and the last frame.
  [[nodiscard]] int interval_count() const { return frames > 1 ? (frames - 2) / interval + 1 : 0; }
  [[nodiscard]] int common_break(int i) const { return i < interval_count() ? i * interval : frames - 1; }
};

// Control points, [break][dimension] and [segment][dimension].
struct CodedCurve {
  std::vector<int> breaks;
  std::vector<double> ends;
  std::vector<double> middles;
  std::vector<FrameCorrection> corrections;  // ascending frames
  int step_index = 0;                        // of the shape
};

// Where a common break is expected behind those before it, the last of them `before` and the one before that.
[[nodiscard]] double expected_common(int count, double before, double earlier);

// Steps for a point that counts for so many frames.
[[nodiscard]] double end_step(double step, int length_before, int length_after);
[[nodiscard]] double middle_step(double step, int length);

// Where the next points of a curve are expected.
class CurvePredictor {
 public:
  explicit CurvePredictor(const CurveShape& shape) : shape_(shape) {}
  // A segment of `length` frames starts at the curve's end so far; the next common break is `rest` frames on.
  void begin(const double* start, int length, int rest);
  // Its end, when the curve is at `goal` at the common break.
  [[nodiscard]] double end(std::size_t d, double goal) const {
    return start_[d] + (onwards_ * slope_[d] + towards_ * (goal - start_[d]));
  }
  // Its middle, once its end is known.
  [[nodiscard]] double middle(std::size_t d, double end) const {
    const double half = (start_[d] + end) / 2;
    return half + smooth_ * (start_[d] + slope_[d] * half_length_ - half);
  }
  // The segment is known.
  void advance(int length, const double* middle, const double* end);

 private:
  CurveShape shape_;
  const double* start_ = nullptr;
  Point slope_{};          // per frame, at the end so far
  int length_before_ = 0;  // 0: there is no slope yet
  double onwards_ = 0, towards_ = 0, smooth_ = 0, half_length_ = 0;
};

// What adapts while a curve is coded. Starts from what recordings taught.
class CurveModels {
 public:
  static constexpr int kinds = 3;  // common breaks, ends, middles
  static constexpr int sizes = 8;
  static constexpr int exponents = 28;
  CurveModels();

  std::array<std::array<AdaptiveBit, sizes>, kinds> zero;
  std::array<std::array<std::array<AdaptiveBit, exponents>, sizes>, kinds> exponent;
  std::array<std::array<AdaptiveBit, exponents>, kinds> second;  // binary digit of a number
  std::array<std::array<AdaptiveBit, 12>, 3> segments;
  std::array<std::array<AdaptiveBit, 12>, 12> length;
  std::array<AdaptiveBit, 12> length_top;
};
enum class PointKind : int { common, end, middle };

// Which of CurveModels' sizes a number is expected to have: from the last number of its kind and dimension, and from
// the mean of those of the same point that are known.
class SizeContext {
 public:
  explicit SizeContext(int dimensions) : dimensions_(dimensions) {}
  [[nodiscard]] int next(PointKind kind, std::size_t d) const;
  // `length`: of the point's segment, 1 for a common break.
  void begin_point(int length) { sum_ = 0, known_ = 0, length_ = length; }
  void see(PointKind kind, std::size_t d, std::int64_t value);

 private:
  std::array<std::array<std::int64_t, most_dimensions>, CurveModels::kinds> last_{};
  std::array<int, CurveModels::kinds> last_length_{1, 1, 1};
  std::int64_t sum_ = 0;
  int known_ = 0;
  int length_ = 1;
  int dimensions_;
  std::array<std::int64_t, most_dimensions> fresh_{};
};

// About how many bits a number takes.
[[nodiscard]] double number_bits(PointKind kind, int size, std::int64_t value);

// The numbers of a curve in the order of the code; chosen by the encoder.
struct CurveNumbers {
  std::vector<int> breaks;
  std::vector<FrameCorrection> corrections;
  std::vector<std::int64_t> common;  // [common break][dimension]
  std::vector<std::int64_t>
      points;  // by segment: its end unless that is a common break; its middle unless it is 1 long
};

[[nodiscard]] Bytes encode_curve(const CurveShape& shape, const CurveNumbers& numbers);
// Throw Error{bad_input} naming `source`.
[[nodiscard]] CodedCurve decode_curve(const CurveShape& shape, std::span<const std::byte> bytes,
                                      const std::string& source);
// Only the common breaks: [common break][dimension].
[[nodiscard]] std::vector<double> decode_common(const CurveShape& shape, std::span<const std::byte> bytes,
                                                const std::string& source);

}  // namespace kinespace
