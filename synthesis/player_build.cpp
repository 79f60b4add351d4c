// From an encoded clip to what a Player plays.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/cut_join.h"
#include "kinespace/synthesis/detail/player_parts.h"

namespace kinespace {
namespace {

using Weights = std::vector<float>;  // [frame][entry]

void evaluate(const float* cubic, float b, float factor, float* out) {
  constexpr int lanes = PlaybackBasis::lanes;
  for (int k = 0; k < lanes; ++k) {
    const float value = cubic[k] + b * (cubic[lanes + k] + b * (cubic[2 * lanes + k] + b * cubic[3 * lanes + k]));
    out[k] += factor * value;
  }
}

// A sequence of a run at one level of detail, which grows function by function: [frame][column] as in
// PlayerParts::cuts, the root's place last.
class GrowingSequence {
 public:
  GrowingSequence(const PlayerParts& parts, std::size_t sequence)
      : parts_(parts), sequence_(parts.sequences[sequence]) {
    const PlaybackBasis& basis = *parts.basis;
    const int rows = sequence_.intervals + 1;
    weights_.resize(static_cast<std::size_t>(basis.curves()));
    for (int f = 0; f < rows; ++f) {
      const double own = sequence_.intervals == 0 ? 0 : static_cast<double>(f) / sequence_.intervals;
      const PlayerParts::Place place = parts.place_in(sequence, own);
      for (int c = 0; c < basis.curves(); ++c) add_frame(place, c);
    }
    frames_ = SampleMatrix::Zero(rows, static_cast<Eigen::Index>(parts.rotation_floats()) + 4);
    for (int axis = 0; axis < 3; ++axis) {
      for (int f = 0; f < rows; ++f) {
        frames_(f, place_column() + axis) = static_cast<double>(sequence_.travel[static_cast<std::size_t>(axis)]) * f /
                                            std::max(1, sequence_.intervals);
      }
    }
    grow(0);
  }

  // Adds entry k: the mean for 0, the k-th function.
  void grow(int k) {
    for (int c = 0; c < parts_.basis->curves(); ++c) {
      const float score = k == 0 ? 1.0F : score_of(c, k);
      const Weights& weights = weights_[static_cast<std::size_t>(shared(c))];
      const auto padded = static_cast<std::size_t>(parts_.basis->padded());
      for (Eigen::Index f = 0; f < frames_.rows(); ++f) {
        frames_(f, column(c)) +=
            static_cast<double>(weights[static_cast<std::size_t>(f) * padded + static_cast<std::size_t>(k)] * score);
      }
    }
  }
  [[nodiscard]] const SampleMatrix& frames() const { return frames_; }

 private:
  [[nodiscard]] Eigen::Index place_column() const { return static_cast<Eigen::Index>(parts_.rotation_floats()); }
  [[nodiscard]] Eigen::Index column(int c) const {
    if (c < 3) return place_column() + c;
    return static_cast<Eigen::Index>((c - 3) % 4) * parts_.lanes + (c - 3) / 4;
  }
  [[nodiscard]] float score_of(int c, int k) const {
    const auto row = static_cast<std::size_t>(k - 1);
    return parts_.scores[sequence_.scores + row * parts_.score_stride() + static_cast<std::size_t>(column(c))];
  }
  // The first curve whose weights are those of c.
  [[nodiscard]] int shared(int c) const {
    const int begin = c < 3 ? 0 : 3;
    for (int other = begin; other < c; ++other) {
      if (parts_.basis->group_of(other) == parts_.basis->group_of(c)) return other;
    }
    return c;
  }
  void add_frame(const PlayerParts::Place& place, int c) {
    if (shared(c) != c) return;
    const PlaybackBasis& basis = *parts_.basis;
    Weights& out = weights_[static_cast<std::size_t>(c)];
    out.resize(out.size() + static_cast<std::size_t>(basis.padded()), 0.0F);
    float* row = out.data() + out.size() - basis.padded();
    for (int block = 0; block < basis.blocks(); ++block, row += PlaybackBasis::lanes) {
      if (c >= 3) {
        evaluate(basis.values(basis.group_of(c), block, place.cell), place.b, 1, row);
      } else {
        add_integrals(place, c, block, row);
      }
    }
  }
  void add_integrals(const PlayerParts::Place& place, int axis, int block, float* row) const {
    constexpr int lanes = PlaybackBasis::lanes;
    const auto own = static_cast<float>(place.own);
    for (int j = 0; j < PlayerParts::warp_terms(sequence_); ++j) {
      const float factor = sequence_.warp[static_cast<std::size_t>(j)] * sequence_.duration_s;
      evaluate(parts_.basis->integrals(axis, block, place.cell) + 4 * j * lanes, place.b, factor, row);
      const float* ends = parts_.basis->ends(axis, block) + j * lanes;
      for (int k = 0; k < lanes; ++k) row[k] -= factor * own * ends[k];
    }
  }

  const PlayerParts& parts_;
  const PlayerParts::Sequence& sequence_;
  std::vector<Weights> weights_;  // by curve; empty where shared with an earlier one
  SampleMatrix frames_;
};

}  // namespace

PlayerParts::PlayerParts(std::shared_ptr<const PlaybackBasis> basis_in, const EncodedClip& clip,
                         const PlayerOptions& options_in)
    : basis(std::move(basis_in)),
      options(options_in),
      rate_hz(clip.rate_hz),
      frames(clip.frames),
      joints((basis->curves() - 3) / 4),
      lanes((joints + PlaybackBasis::lanes - 1) / PlaybackBasis::lanes * PlaybackBasis::lanes),
      start_cm(clip.placement.start_cm),
      turn_cosine(static_cast<float>(std::cos(clip.placement.heading_rad / 2))),
      turn_sine(static_cast<float>(std::sin(clip.placement.heading_rad / 2))) {
  for (const EncodedRun& run : clip.runs) {
    const std::size_t first = sequences.size();
    Eigen::Vector3d start = run.start.cast<double>();
    for (const EncodedSequence& encoded : run.sequences) {
      if (encoded.scores.cols() != basis->curves()) {
        throw Error(ErrorKind::usage, {.file = clip.name,
                                       .found = fmt::format("a clip of {} curves", encoded.scores.cols()),
                                       .expected = fmt::format("{}, as the motion space has", basis->curves())});
      }
      add_sequence(encoded, clip.rate_hz, start);
      start += encoded.travel.cast<double>();
    }
    add_cuts(first, sequences.size());
  }
  if (sequences.empty()) {
    throw Error(ErrorKind::usage, {.file = clip.name, .found = "a clip without sequences", .expected = "one or more"});
  }
  scores.shrink_to_fit();
  cuts.shrink_to_fit();
  index_times();
}

void PlayerParts::add_sequence(const EncodedSequence& encoded, double rate, const Eigen::Vector3d& start) {
  Sequence out{.first = encoded.first, .intervals = encoded.last - encoded.first};
  out.start = start;
  out.warped = !encoded.warp.is_identity();
  out.duration_s = static_cast<float>(out.intervals / rate);
  out.steepness = static_cast<float>(fade_steepness(out.intervals, options.join.blend));
  out.warp[0] = 1;
  for (std::size_t j = 0; j < Warp::terms; ++j) {
    out.warp[j + 1] = static_cast<float>(encoded.warp.coefficients()[j]) / Warp::steps;
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) out.travel[static_cast<std::size_t>(axis)] = encoded.travel(axis);
  if (out.warped) {
    out.inverse = scores.size();
    for (int i = 0; i <= inverse_cells; ++i) {
      const double s = encoded.warp.space_time(static_cast<double>(i) / inverse_cells);
      scores.push_back(static_cast<float>(s));
      scores.push_back(static_cast<float>(1 / encoded.warp.slope(s)));
    }
  }
  scores.resize((scores.size() + PlaybackBasis::lanes - 1) / PlaybackBasis::lanes * PlaybackBasis::lanes, 0.0F);
  out.scores = scores.size();
  const Eigen::Index functions = basis->functions();
  scores.resize(scores.size() + static_cast<std::size_t>(functions) * score_stride(), 0.0F);
  const Eigen::Index known = std::min(functions, encoded.scores.rows());
  for (Eigen::Index k = 0; k < known; ++k) {
    float* row = scores.data() + out.scores + static_cast<std::size_t>(k) * score_stride();
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      row[rotation_floats() + static_cast<std::size_t>(axis)] = encoded.scores(k, axis);
    for (Eigen::Index c = 3; c < encoded.scores.cols(); ++c) {
      row[(c - 3) % 4 * lanes + (c - 3) / 4] = encoded.scores(k, c);
    }
  }
  sequences.push_back(out);
}

// The corrections at the cuts between sequences first .. last - 1 of one run, at every level.
void PlayerParts::add_cuts(std::size_t first, std::size_t last) {
  if (last - first < 2) return;
  const auto levels = static_cast<std::size_t>(basis->functions()) + 1;
  const std::size_t start = cuts.size();
  const std::size_t size = levels * cut_stride();
  cuts.resize(start + (last - first - 1) * size, 0.0F);
  for (std::size_t i = first; i < last; ++i) {
    sequences[i].joined_before = i > first;
    sequences[i].joined_after = i + 1 < last;
    sequences[i].cut = start + (i - first) * size;
  }
  // Two sequences at a time, so that memory does not grow with the clip.
  for (std::size_t i = first; i + 1 < last; ++i) {
    GrowingSequence left(*this, i);
    GrowingSequence right(*this, i + 1);
    for (std::size_t level = 0; level < levels; ++level) {
      if (level > 0) {
        left.grow(static_cast<int>(level));
        right.grow(static_cast<int>(level));
      }
      const CutCorrection correction = cut_correction(left.frames(), right.frames(), options.join.free_change);
      float* out = cuts.data() + sequences[i].cut + level * cut_stride();
      const auto columns = static_cast<Eigen::Index>(rotation_floats());
      Eigen::Map<Eigen::RowVectorXf>(out, columns) = correction.value.head(columns).cast<float>();
      // Both neighbours end where the root is: there is no value to correct, only its slope.
      Eigen::Map<Eigen::RowVectorXf>(out + columns, columns + 4) = correction.slope.cast<float>();
    }
  }
}

void PlayerParts::index_times() {
  bucket = frames;
  for (const Sequence& s : sequences) bucket = std::min(bucket, std::max(1, s.intervals));
  std::size_t sequence = 0;
  for (int frame = 0; frame < frames; frame += bucket) {
    while (sequence + 1 < sequences.size() && sequences[sequence + 1].first <= frame) ++sequence;
    at.push_back(static_cast<int>(sequence));
  }
}

Player::Player(std::shared_ptr<const PlaybackBasis> basis, const EncodedClip& clip, const PlayerOptions& options)
    : parts_(std::make_shared<const PlayerParts>(std::move(basis), clip, options)) {}

Player::Player(const MotionSpace& space, const EncodedClip& clip, const PlayerOptions& options)
    : Player(std::make_shared<const PlaybackBasis>(space), clip, options) {}

}  // namespace kinespace
