// Batched DTW on the processor: distances in float for four query rows by sixteen frames at a time, vectors over the
// frames; sums in double; pairs in parallel.
#include <array>
#include <cmath>

#include <oneapi/tbb/enumerable_thread_specific.h>

#include "kinespace/base/parallel.h"
#include "kinespace/kernels/detail/dtw.h"
#include "kinespace/kernels/simd.h"

namespace kinespace::dtw_detail {
namespace {

constexpr int kRows = 4;
constexpr int kFrames = 16;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Squared distances of four query rows to the frames [first, first + 16 * blocks) of a clip stored [feature][frame].
KINESPACE_SIMD_BODY void squared_distances_body(const float* const* rows, const float* clip, int stride, int dims,
                                                int blocks, float* out) {
  for (int block = 0; block < blocks; ++block) {
    float sums[kRows][kFrames] = {};
    for (int k = 0; k < dims; ++k) {
      const float* frames = clip + static_cast<std::ptrdiff_t>(k) * stride + std::ptrdiff_t{kFrames} * block;
      for (int r = 0; r < kRows; ++r) {
        for (int c = 0; c < kFrames; ++c) {
          const float difference = frames[c] - rows[r][k];
          sums[r][c] += difference * difference;
        }
      }
    }
    for (int r = 0; r < kRows; ++r) {
      for (int c = 0; c < kFrames; ++c) out[r * stride + block * kFrames + c] = sums[r][c];
    }
  }
}
KINESPACE_SIMD(squared_distances, void,
               (const float* const* rows, const float* clip, int stride, int dims, int blocks, float* out),
               (rows, clip, stride, dims, blocks, out))

// Two bits a cell, for the legal cells of each row.
class StepTable {
 public:
  void reset(int rows) {
    rows_.clear();
    rows_.reserve(static_cast<std::size_t>(rows));
    bits_.clear();
  }
  void start_row(int first, int cells) {
    rows_.push_back({bits_.size() * 4, first});
    bits_.resize(bits_.size() + (static_cast<std::size_t>(cells) + 3) / 4);
  }
  void set(int j, unsigned step) {
    const auto cell = at(rows_.back(), j);
    bits_[cell / 4] = static_cast<std::uint8_t>(bits_[cell / 4] | (step << (cell % 4 * 2)));
  }
  [[nodiscard]] unsigned get(int i, int j) const {
    const auto cell = at(rows_[i], j);
    return (bits_[cell / 4] >> (cell % 4 * 2)) & 3U;
  }

 private:
  struct RowStart {
    std::size_t cell = 0;
    int first = 0;
  };
  static std::size_t at(const RowStart& row, int j) { return row.cell + static_cast<std::size_t>(j - row.first); }
  std::vector<RowStart> rows_;
  std::vector<std::uint8_t> bits_;
};

// The matcher of one thread, with its work space.
class PairMatcher {
 public:
  DtwMatch match(std::span<const float> a, std::span<const float> b, int dims, const DtwOptions& options) {
    n_ = static_cast<int>(a.size()) / dims;
    m_ = static_cast<int>(b.size()) / dims;
    region_ = region_of(n_, m_, options);
    DtwMatch match;
    if (!region_.has_path()) return match;
    start(b, dims);
    steps_.reset(options.want_path ? n_ : 0);
    for (int i = 0; i < n_; i += kRows) {
      std::array<const float*, kRows> rows{};
      for (int r = 0; r < kRows; ++r) rows[r] = &a[static_cast<std::size_t>(std::min(i + r, n_ - 1)) * dims];
      match_rows(i, rows, dims, options);
    }
    match.cost = cost_[m_];
    if (options.want_path && match.found()) {
      match.path = trace_back(n_, m_, region_.slope_limited, [&](int i, int j) { return steps_.get(i, j); });
    }
    return match;
  }

 private:
  void start(std::span<const float> b, int dims) {
    stride_ = (m_ + kFrames - 1) / kFrames * kFrames;
    clip_.assign(static_cast<std::size_t>(stride_) * dims, 0);
    for (int j = 0; j < m_; ++j) {
      for (int k = 0; k < dims; ++k) clip_[static_cast<std::size_t>(k) * stride_ + j] = b[j * dims + k];
    }
    distances_.resize(static_cast<std::size_t>(stride_) * kRows);
    cost_.assign(m_ + 1, kInfinity);
    straight_.assign(m_ + 1, kInfinity);
    cost_[0] = 0;
  }

  void match_rows(int first, const std::array<const float*, kRows>& rows, int dims, const DtwOptions& options) {
    const int last = std::min(first + kRows, n_) - 1;
    const Region turned = transposed(region_);
    const int begin = static_cast<int>(turned.first_row(first)) / kFrames;
    const int end = (static_cast<int>(turned.end_row(last)) + kFrames - 1) / kFrames;
    const int at = begin * kFrames;
    squared_distances(rows.data(), clip_.data() + at, stride_, dims, end - begin, distances_.data() + at);
    for (int i = first; i <= last; ++i) {
      const int from = static_cast<int>(turned.first_row(i));
      const int to = static_cast<int>(turned.end_row(i));
      match_row(i, from, to, distances_.data() + static_cast<std::ptrdiff_t>(i - first) * stride_, options);
    }
  }

  // Moves cost_ and straight_ from row i - 1 to row i; they are infinite outside the row's legal cells.
  void match_row(int i, int from, int to, const float* squared, const DtwOptions& options) {
    if (options.want_path) steps_.start_row(from, to - from);
    double diagonal = cost_[from];
    double left = kInfinity;
    cost_[from] = kInfinity;
    straight_[from] = kInfinity;
    for (int j = from; j < to; ++j) {
      const double up = straight_[j + 1];
      const double straight = std::min(left, up);
      const double d = options.squared ? squared[j] : std::sqrt(squared[j]);
      const double cell = region_.in_band(i, j) ? d + std::min(diagonal, straight) : kInfinity;
      if (options.want_path && diagonal > straight) steps_.set(j, left <= up ? along_target : along_query);
      left = region_.slope_limited ? d + diagonal : cell;
      diagonal = cost_[j + 1];
      cost_[j + 1] = cell;
      straight_[j + 1] = left;
    }
  }

  int n_ = 0;
  int m_ = 0;
  int stride_ = 0;
  Region region_;
  std::vector<float> clip_;       // the target, [feature][frame]
  std::vector<float> distances_;  // squared, [row][frame]
  std::vector<double> cost_;      // D of the row above, [j + 1]
  std::vector<double> straight_;  // what a straight step may start from
  StepTable steps_;
};

}  // namespace

void dtw_cpu(const FeatureSet& queries, const FeatureSet& targets, std::span<const ClipPair> pairs,
             const DtwOptions& options, std::span<DtwMatch> matches) {
  tbb::enumerable_thread_specific<PairMatcher> matchers;
  parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t p) {
    matches[p] =
        matchers.local().match(queries.clip(pairs[p].query), targets.clip(pairs[p].target), queries.dims, options);
  });
}

}  // namespace kinespace::dtw_detail
