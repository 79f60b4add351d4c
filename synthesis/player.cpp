#include "kinespace/synthesis/player.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/cut_join.h"
#include "kinespace/kernels/simd.h"
#include "kinespace/synthesis/detail/player_parts.h"

namespace kinespace {
namespace {

constexpr int lanes = PlaybackBasis::lanes;
constexpr int most_entries = 1024 + 2 * lanes;  // functions of a space, and the mean
using Vector = float __attribute__((vector_size(lanes * sizeof(float))));
using Four = float __attribute__((vector_size(4 * sizeof(float))));
using Indices = int __attribute__((vector_size(lanes * sizeof(int))));

// A neighbouring cut's part in a pose: its corrections and by how much they count; none: nullptr.
struct CutPart {
  const float* values = nullptr;
  const float* slopes = nullptr;
  float value = 0;
  float slope = 0;
};

// All that a pose is computed from.
struct PoseJob {
  int functions = 0;
  std::ptrdiff_t values_stride = 0;
  std::ptrdiff_t integrals_stride = 0;
  float b = 0;
  const float* values[4] = {};  // of the four components; often the same
  const float* integrals[3] = {};
  const float* ends[3] = {};
  const float* warp = nullptr;
  int warp_terms = 1;
  float own = 0;
  float duration_s = 0;
  const float* travel = nullptr;
  const float* scores = nullptr;
  std::ptrdiff_t score_stride = 0;
  int joint_lanes = 0;
  int joints = 0;
  CutPart cuts[2];
  float* rotations = nullptr;
  float place[4] = {};  // metres from the sequence's start
};

// result = the cubics of a block at b. A macro, since vectors of this size are passed differently by different
// instruction sets.
#define KINESPACE_CUBICS(result, cubic, b)                    \
  Vector result;                                              \
  {                                                           \
    Vector c[4];                                              \
    std::memcpy(c, cubic, sizeof(c));                         \
    (result) = c[0] + (b) * (c[1] + (b) * (c[2] + (b)*c[3])); \
  }

// The weights of the entries in the root's place: duration sum_j a_j (I_jk(s) - u I_jk(1)).
KINESPACE_SIMD_BODY void place_weights(const PoseJob& job, int axis, float* out) {
  const float* block = job.integrals[axis];
  const float* ends = job.ends[axis];
  for (int k = 0; k <= job.functions; k += lanes, block += job.integrals_stride) {
    Vector sum{};
    for (int j = 0; j < job.warp_terms; ++j) {
      KINESPACE_CUBICS(integral, block + 4 * j * lanes, job.b)
      Vector end;
      std::memcpy(&end, ends + j * lanes, sizeof(Vector));
      sum += (job.warp[j] * job.duration_s) * (integral - job.own * end);
    }
    ends += PlaybackBasis::warp_terms * lanes;
    std::memcpy(out + k, &sum, sizeof(Vector));
  }
}

// Where the root is: u travel + sum_k weight_k x_k, so that it ends where it should.
KINESPACE_SIMD_BODY void place_root(PoseJob& job) {
  alignas(64) float weights[most_entries];
  place_weights(job, 0, weights);
  const bool shared = job.integrals[1] == job.integrals[0] && job.integrals[2] == job.integrals[0];
  const float* velocity = job.scores + static_cast<std::ptrdiff_t>(4) * job.joint_lanes;
  Four sum = {};
  if (shared) {
    sum = Four{job.travel[0], job.travel[1], job.travel[2], 0} * job.own + weights[0];
    for (int k = 1; k <= job.functions; ++k) {
      Four x;
      std::memcpy(&x, velocity + (k - 1) * job.score_stride, sizeof(Four));
      sum += weights[k] * x;
    }
  } else {
    for (int axis = 0; axis < 3; ++axis) {
      if (axis > 0) place_weights(job, axis, weights);
      sum[axis] = job.travel[axis] * job.own + weights[0];
      for (int k = 1; k <= job.functions; ++k) sum[axis] += weights[k] * velocity[(k - 1) * job.score_stride + axis];
    }
  }
  for (const CutPart& cut : job.cuts) {
    if (cut.values == nullptr) continue;
    Four slope;
    std::memcpy(&slope, cut.slopes + 4 * static_cast<std::ptrdiff_t>(job.joint_lanes), sizeof(Four));
    sum -= cut.slope * slope;
  }
  std::memcpy(job.place, &sum, sizeof(Four));
}

// The values of the functions of one component.
KINESPACE_SIMD_BODY void function_values(const PoseJob& job, int component, float* out) {
  const float* block = job.values[component];
  for (int k = 0; k <= job.functions; k += lanes, block += job.values_stride) {
    KINESPACE_CUBICS(value, block, job.b)
    std::memcpy(out + k, &value, sizeof(Vector));
  }
}

// Lanes of two vectors in turn, from lane `n` on: one of each, two of each.
// clang-format off
#define KINESPACE_IN_TURN(n) \
  n, n + 16, n + 1, n + 17, n + 2, n + 18, n + 3, n + 19, n + 4, n + 20, n + 5, n + 21, n + 6, n + 22, n + 7, n + 23
#define KINESPACE_PAIRS_IN_TURN(n) \
  n, n + 1, n + 16, n + 17, n + 2, n + 3, n + 18, n + 19, n + 4, n + 5, n + 20, n + 21, n + 6, n + 7, n + 22, n + 23
// clang-format on

// Renormalises the four components (1 / sqrt by Newton's iteration, the same on every processor) and stores them joint
// by joint.
KINESPACE_SIMD_BODY void store_rotations(const Vector* q, int count, float* out) {
  const Vector square = (q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]);
  Indices bits;
  std::memcpy(&bits, &square, sizeof(bits));
  bits = 0x5f3759df - (bits >> 1);
  Vector scale;
  std::memcpy(&scale, &bits, sizeof(scale));
  for (int i = 0; i < 4; ++i) scale = scale * (1.5F - 0.5F * square * scale * scale);

  const Vector w = q[0] * scale;
  const Vector x = q[1] * scale;
  const Vector y = q[2] * scale;
  const Vector z = q[3] * scale;
  const Vector wx_low = __builtin_shufflevector(w, x, KINESPACE_IN_TURN(0));
  const Vector wx_high = __builtin_shufflevector(w, x, KINESPACE_IN_TURN(8));
  const Vector yz_low = __builtin_shufflevector(y, z, KINESPACE_IN_TURN(0));
  const Vector yz_high = __builtin_shufflevector(y, z, KINESPACE_IN_TURN(8));
  const Vector rows[4] = {__builtin_shufflevector(wx_low, yz_low, KINESPACE_PAIRS_IN_TURN(0)),
                          __builtin_shufflevector(wx_low, yz_low, KINESPACE_PAIRS_IN_TURN(8)),
                          __builtin_shufflevector(wx_high, yz_high, KINESPACE_PAIRS_IN_TURN(0)),
                          __builtin_shufflevector(wx_high, yz_high, KINESPACE_PAIRS_IN_TURN(8))};
  std::memcpy(out, rows, static_cast<std::size_t>(count) * 4 * sizeof(float));
}

KINESPACE_SIMD_BODY void play_body(PoseJob& job) {
  place_root(job);
  alignas(64) float weights[4][most_entries];
  const float* weight[4];
  const int count = job.functions + 1;
  for (int q = 0; q < 4; ++q) {
    if (q > 0 && job.values[q] == job.values[q - 1]) {
      weight[q] = weight[q - 1];
      continue;
    }
    function_values(job, q, weights[q]);
    weight[q] = weights[q];
  }
  for (int start = 0; start < job.joint_lanes; start += lanes) {
    Vector sum[4];
    for (int q = 0; q < 4; ++q) sum[q] = Vector{} + weight[q][0];
    const float* scores = job.scores + start;
    for (int k = 1; k < count; ++k, scores += job.score_stride) {
      for (int q = 0; q < 4; ++q) {
        Vector x;
        std::memcpy(&x, scores + static_cast<std::ptrdiff_t>(q) * job.joint_lanes, sizeof(Vector));
        sum[q] += weight[q][k] * x;
      }
    }
    for (const CutPart& cut : job.cuts) {
      if (cut.values == nullptr) continue;
      for (int q = 0; q < 4; ++q) {
        Vector value;
        Vector slope;
        std::memcpy(&value, cut.values + q * job.joint_lanes + start, sizeof(Vector));
        std::memcpy(&slope, cut.slopes + q * job.joint_lanes + start, sizeof(Vector));
        sum[q] += cut.value * value - cut.slope * slope;
      }
    }
    const int joints = job.joints - start < lanes ? job.joints - start : lanes;
    store_rotations(sum, joints, job.rotations + 4 * start);
  }
}
KINESPACE_SIMD(play, void, (PoseJob & job), (job))

// The parts that the cuts at both ends of a sequence have at a place.
void add_cut_parts(const PlayerParts& parts, const PlayerParts::Place& place, int level, CutPart* out) {
  const PlayerParts::Sequence& sequence = parts.sequences[place.sequence];
  const double blend = parts.options.join.blend;
  const auto at = [&](std::size_t cut) {
    return parts.cuts.data() + cut + static_cast<std::size_t>(level) * parts.cut_stride();
  };
  if (sequence.joined_before && place.own < blend) {
    const Fade weight = fade(place.own, blend);
    const float* cut = at(parts.sequences[place.sequence - 1].cut);
    out[0] = {cut, cut + parts.rotation_floats() + parts.slope_floats(), static_cast<float>(-weight.value),
              static_cast<float>(weight.slope) * sequence.steepness};
  }
  if (sequence.joined_after && 1 - place.own < blend) {
    const Fade weight = fade(1 - place.own, blend);
    const float* cut = at(sequence.cut);
    out[1] = {cut, cut + parts.rotation_floats(), static_cast<float>(weight.value),
              static_cast<float>(weight.slope) * sequence.steepness};
  }
}

}  // namespace

PlayerParts::Place PlayerParts::place_in(std::size_t index, double own) const {
  const Sequence& sequence = sequences[index];
  double s = own;
  if (sequence.warped) {
    // Cubic between tabulated values and slopes.
    const double x = own * inverse_cells;
    const int i = std::min(static_cast<int>(x), inverse_cells - 1);
    const double t = x - i;
    const float* p = scores.data() + sequence.inverse + 2 * i;
    const double change = static_cast<double>(p[2]) - static_cast<double>(p[0]);
    const double d0 = static_cast<double>(p[1]) / inverse_cells - change;
    const double d1 = change - static_cast<double>(p[3]) / inverse_cells;
    s = static_cast<double>(p[0]) + t * (change + (1 - t) * (d0 * (1 - t) + d1 * t));
  }
  const int points = basis->points(sequence.set);
  const double x = s * (points - 1);
  const int cell = std::clamp(static_cast<int>(x), 0, points - 2);
  return {.sequence = index, .own = own, .cell = cell, .b = static_cast<float>(x - cell)};
}

double PlayerParts::frame_at(double time_s) const {
  const double end = frames - 1;
  double x = time_s * rate_hz;
  if (!(x > 0 && x < end)) {
    // The end itself is the end's pose, looped or not.
    if (options.loop && end > 0 && x != end && std::isfinite(x)) {
      x = std::fmod(x, end);
      if (x < 0) x += end;
    }
    x = std::clamp(std::isnan(x) ? 0.0 : x, 0.0, end);
  }
  return x;
}

PlayerParts::Place PlayerParts::place_at(double time_s) const {
  const double x = frame_at(time_s);
  auto index = static_cast<std::size_t>(at[static_cast<std::size_t>(static_cast<int>(x) / bucket)]);
  while (index + 1 < sequences.size() && sequences[index + 1].first <= x) ++index;
  const Sequence& sequence = sequences[index];
  const double into = x - sequence.first;
  const double beyond = into - sequence.intervals;
  if (beyond <= 0) return place_in(index, sequence.intervals == 0 ? 0 : into / sequence.intervals);
  // Between the two frames beside a break.
  if (beyond > 0.5 && index + 1 < sequences.size()) return place_in(index + 1, 0);
  return place_in(index, sequence.intervals == 0 ? 0 : 1);
}

Eigen::Vector3f PlayerParts::world_place(const Sequence& sequence, const float* from_start) const {
  constexpr double cm_per_metre = 100;
  const double c = static_cast<double>(turn_cosine);
  const double s = static_cast<double>(turn_sine);
  const double x = sequence.start.x() + static_cast<double>(from_start[0]);
  const double y = sequence.start.y() + static_cast<double>(from_start[1]);
  const double z = sequence.start.z() + static_cast<double>(from_start[2]);
  const double cosine = c * c - s * s;
  const double sine = 2 * c * s;
  return {static_cast<float>(start_cm.x() + cm_per_metre * (cosine * x + sine * z)),
          static_cast<float>(start_cm.y() + cm_per_metre * y),
          static_cast<float>(start_cm.z() + cm_per_metre * (cosine * z - sine * x))};
}

void PlayerParts::turn_root(float* q) const {
  const float w = q[0];
  const float x = q[1];
  const float y = q[2];
  const float z = q[3];
  q[0] = turn_cosine * w - turn_sine * y;
  q[1] = turn_cosine * x + turn_sine * z;
  q[2] = turn_cosine * y + turn_sine * w;
  q[3] = turn_cosine * z - turn_sine * x;
}

double Player::duration_s() const {
  return (parts_->frames - 1) / parts_->rate_hz;
}
int Player::joints() const {
  return parts_->joints;
}
double Player::frame_at(double time_s) const {
  return parts_->frame_at(time_s);
}
int Player::functions() const {
  return parts_->basis->levels();
}

Eigen::Vector3f Player::pose(double time_s, int functions, std::span<float> rotations) const {
  const PlayerParts& parts = *parts_;
  const PlaybackBasis& basis = *parts.basis;
  if (!basis.by_component()) return reference::pose(*this, time_s, functions, rotations);
  assert(rotations.size() >= 4 * static_cast<std::size_t>(parts.joints));
  const PlayerParts::Place place = parts.place_at(time_s);
  const PlayerParts::Sequence& sequence = parts.sequences[place.sequence];
  const int level = parts.level(functions);
  PoseJob job;
  job.functions = parts.rows_at(sequence, level);
  job.scores = parts.scores.data() + sequence.scores;
  job.score_stride = static_cast<std::ptrdiff_t>(parts.score_stride());
  job.values_stride = basis.values_stride(sequence.set);
  job.integrals_stride = basis.integrals_stride(sequence.set);
  job.b = place.b;
  for (int q = 0; q < 4; ++q) job.values[q] = basis.values(sequence.set, basis.group_of(3 + q), 0, place.cell);
  for (int axis = 0; axis < 3; ++axis) {
    job.integrals[axis] = basis.integrals(sequence.set, axis, 0, place.cell);
    job.ends[axis] = basis.ends(sequence.set, axis, 0);
  }
  job.warp = sequence.warp.data();
  job.warp_terms = PlayerParts::warp_terms(sequence);
  job.own = static_cast<float>(place.own);
  job.duration_s = sequence.duration_s;
  job.travel = sequence.travel.data();
  job.joint_lanes = parts.lanes;
  job.joints = parts.joints;
  add_cut_parts(parts, place, level, job.cuts);
  job.rotations = rotations.data();
  play(job);
  parts.turn_root(rotations.data());
  return parts.world_place(sequence, job.place);
}

namespace reference {

Eigen::Vector3f pose(const Player& player, double time_s, int functions, std::span<float> rotations) {
  const PlayerParts& parts = PlayerParts::of(player);
  const PlaybackBasis& basis = *parts.basis;
  assert(rotations.size() >= 4 * static_cast<std::size_t>(parts.joints));
  const PlayerParts::Place place = parts.place_at(time_s);
  const PlayerParts::Sequence& sequence = parts.sequences[place.sequence];
  const int level = parts.level(functions);
  const int rows = parts.rows_at(sequence, level);
  CutPart cuts[2];
  add_cut_parts(parts, place, level, cuts);
  const auto cubic = [&](const float* c) {
    return c[0] + place.b * (c[lanes] + place.b * (c[2 * lanes] + place.b * c[3 * lanes]));
  };
  const auto value = [&](int curve, int k) {
    return cubic(basis.values(sequence.set, basis.group_of(curve), k / lanes, place.cell) + k % lanes);
  };

  const auto own = static_cast<float>(place.own);
  const float* scores = parts.scores.data() + sequence.scores;
  float from_start[3];
  for (int axis = 0; axis < 3; ++axis) {
    float sum = own * sequence.travel[static_cast<std::size_t>(axis)];
    for (int k = 0; k <= rows; ++k) {
      float weight = 0;
      for (int j = 0; j < PlayerParts::warp_terms(sequence); ++j) {
        const float integral =
            cubic(basis.integrals(sequence.set, axis, k / lanes, place.cell) + 4 * j * lanes + k % lanes);
        weight += sequence.warp[static_cast<std::size_t>(j)] * sequence.duration_s *
                  (integral - own * basis.ends(sequence.set, axis, k / lanes)[j * lanes + k % lanes]);
      }
      sum += weight * (k == 0 ? 1.0F
                              : scores[static_cast<std::size_t>(k - 1) * parts.score_stride() +
                                       parts.rotation_floats() + static_cast<std::size_t>(axis)]);
    }
    for (const CutPart& cut : cuts) {
      if (cut.values != nullptr)
        sum -= cut.slope * cut.slopes[parts.rotation_floats() + static_cast<std::size_t>(axis)];
    }
    from_start[axis] = sum;
  }

  for (int joint = 0; joint < parts.joints; ++joint) {
    float q[4];
    for (int component = 0; component < 4; ++component) {
      const int curve = 3 + 4 * joint + component;
      const auto column = static_cast<std::size_t>(component * parts.lanes + joint);
      float sum = value(curve, 0);
      for (int k = 1; k <= rows; ++k) {
        sum += value(curve, k) * scores[static_cast<std::size_t>(k - 1) * parts.score_stride() + column];
      }
      for (const CutPart& cut : cuts) {
        if (cut.values == nullptr) continue;
        sum += cut.value * cut.values[column] - cut.slope * cut.slopes[column];
      }
      q[component] = sum;
    }
    const float length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (std::size_t i = 0; i < 4; ++i) {
      rotations[4 * static_cast<std::size_t>(joint) + i] = length > 0 ? q[i] / length : q[i];
    }
  }
  parts.turn_root(rotations.data());
  return parts.world_place(sequence, from_start);
}

}  // namespace reference

// From an encoded clip to what a Player plays.

namespace {

using Weights = std::vector<float>;  // [frame][entry]

void evaluate(const float* cubic, float b, float factor, float* out) {
  constexpr int lanes = PlaybackBasis::lanes;
  for (int k = 0; k < lanes; ++k) {
    const float value = cubic[k] + b * (cubic[lanes + k] + b * (cubic[2 * lanes + k] + b * cubic[3 * lanes + k]));
    out[k] += factor * value;
  }
}

// A sequence of a run at one level of detail, which grows level by level: [frame][column] as in
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
    add_entry(0);
  }

  void grow_to(int level) {
    const int rows = parts_.rows_at(sequence_, level);
    while (entries_ < rows) add_entry(++entries_);
  }
  [[nodiscard]] const SampleMatrix& frames() const { return frames_; }

 private:
  // Entry 0 is the mean.
  void add_entry(int k) {
    for (int c = 0; c < parts_.basis->curves(); ++c) {
      const float score = k == 0 ? 1.0F : score_of(c, k);
      const Weights& weights = weights_[static_cast<std::size_t>(shared(c))];
      const auto padded = static_cast<std::size_t>(parts_.basis->padded(sequence_.set));
      for (Eigen::Index f = 0; f < frames_.rows(); ++f) {
        frames_(f, column(c)) +=
            static_cast<double>(weights[static_cast<std::size_t>(f) * padded + static_cast<std::size_t>(k)] * score);
      }
    }
  }
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
    const int padded = basis.padded(sequence_.set);
    out.resize(out.size() + static_cast<std::size_t>(padded), 0.0F);
    float* row = out.data() + out.size() - padded;
    for (int block = 0; block < basis.blocks(sequence_.set); ++block, row += PlaybackBasis::lanes) {
      if (c >= 3) {
        evaluate(basis.values(sequence_.set, basis.group_of(c), block, place.cell), place.b, 1, row);
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
      evaluate(parts_.basis->integrals(sequence_.set, axis, block, place.cell) + 4 * j * lanes, place.b, factor, row);
      const float* ends = parts_.basis->ends(sequence_.set, axis, block) + j * lanes;
      for (int k = 0; k < lanes; ++k) row[k] -= factor * own * ends[k];
    }
  }

  const PlayerParts& parts_;
  const PlayerParts::Sequence& sequence_;
  int entries_ = 0;               // that were added behind the mean
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
      if (!basis->has(encoded.cycles)) {
        throw Error(ErrorKind::usage, {.file = clip.name,
                                       .found = fmt::format("a sequence of {} cycles", encoded.cycles),
                                       .expected = "sequences that the motion space has functions for"});
      }
      add_sequence(encoded, clip.rate_hz, start);
      start += encoded.travel.cast<double>();
    }
    add_cuts(first, run);
  }
  if (sequences.empty()) {
    throw Error(ErrorKind::usage, {.file = clip.name, .found = "a clip without sequences", .expected = "one or more"});
  }
  scores.shrink_to_fit();
  cuts.shrink_to_fit();
  index_times();
}

void PlayerParts::add_sequence(const EncodedSequence& encoded, double rate, const Eigen::Vector3d& start) {
  Sequence out{.first = encoded.first,
               .intervals = encoded.last - encoded.first,
               .set = encoded.cycles,
               .extra_detail = encoded.extra_detail};
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
  out.rows = std::min(basis->rows(out.set), static_cast<int>(encoded.scores.rows()));
  while (out.rows > 0 && encoded.scores.row(out.rows - 1).isZero(0)) --out.rows;
  scores.resize(scores.size() + static_cast<std::size_t>(out.rows) * score_stride(), 0.0F);
  for (int k = 0; k < out.rows; ++k) {
    float* row = scores.data() + out.scores + static_cast<std::size_t>(k) * score_stride();
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      row[rotation_floats() + static_cast<std::size_t>(axis)] = encoded.scores(k, axis);
    for (Eigen::Index c = 3; c < encoded.scores.cols(); ++c) {
      row[(c - 3) % 4 * lanes + (c - 3) / 4] = encoded.scores(k, c);
    }
  }
  sequences.push_back(out);
}

// The corrections at the cuts of a run, whose sequences are those from `first`, at every level.
void PlayerParts::add_cuts(std::size_t first, const EncodedRun& run) {
  const std::size_t last = first + run.sequences.size();
  if (last - first < 2) return;
  const auto levels = static_cast<std::size_t>(basis->levels()) + 1;
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
      left.grow_to(static_cast<int>(level));
      right.grow_to(static_cast<int>(level));
      CutCorrection correction = cut_correction(left.frames(), right.frames(), options.join.free_change);
      float* values = cuts.data() + sequences[i].cut + level * cut_stride();
      float* before = values + rotation_floats();
      float* after = before + slope_floats();
      const auto columns = static_cast<Eigen::Index>(rotation_floats());
      Eigen::Map<Eigen::RowVectorXf>(values, columns) = correction.value.head(columns).cast<float>();
      if (basis->left_out() != nullptr) {
        const auto& s = run.sequences;
        basis->left_out()->correct(s[i - first], s[i - first + 1], static_cast<int>(level), correction);
        put_slopes(correction.slope_before, before);
        put_slopes(correction.slope_after, after);
      } else {
        // Both neighbours end where the root is: there is no value to correct, only its slope.
        Eigen::Map<Eigen::RowVectorXf>(before, columns + 4) = correction.slope_before.cast<float>();
        Eigen::Map<Eigen::RowVectorXf>(after, columns + 4) = correction.slope_after.cast<float>();
      }
    }
  }
}

// Slopes by curve into the columns of a correction; the root's place, last, has none.
void PlayerParts::put_slopes(const Eigen::RowVectorXd& by_curve, float* out) const {
  std::fill_n(out, rotation_floats() + 4, 0.0F);
  for (Eigen::Index c = 3; c < by_curve.size(); ++c) {
    out[(c - 3) % 4 * lanes + (c - 3) / 4] = static_cast<float>(by_curve(c));
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

Player::Player(const RegisteredSpace& space, const EncodedClip& clip, const PlayerOptions& options)
    : Player(std::make_shared<const PlaybackBasis>(space), clip, options) {}

}  // namespace kinespace
