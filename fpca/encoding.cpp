#include "kinespace/fpca/encoding.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/fpca/cut_join.h"
#include "kinespace/fpca/left_out.h"
#include "kinespace/fpca/registration.h"

namespace kinespace {
namespace {

constexpr int travel_curves = 3;

// Integrates the velocity over own time: at grid point i, duration * integral of v(s) h'(s) ds.
SampleMatrix integrate_travel(const SampleMatrix& samples, const Warp& warp, double duration_s) {
  const Eigen::Index points = samples.rows();
  SampleMatrix rate = samples.leftCols(travel_curves);
  const double step = 1.0 / static_cast<double>(points - 1);
  for (Eigen::Index i = 0; i < points; ++i)
    rate.row(i) *= warp.slope(static_cast<double>(i) * step) * duration_s * step;
  return UniformSpline(std::move(rate)).cumulative_integral();
}

SampleMatrix decode_frames(const RegisteredSpace& all_sets, const EncodedSequence& sequence,
                           const Eigen::Vector3d& start, double rate_hz, int n) {
  const MotionSpace& space = all_sets.of(sequence.cycles);
  SampleMatrix samples = space.samples(sequence.scores, sequence.level(n));
  const int intervals = sequence.last - sequence.first;
  const Eigen::Vector3d travel = sequence.travel.cast<double>();
  samples.leftCols(travel_curves) = integrate_travel(samples, sequence.warp, intervals / rate_hz);

  const auto last_point = static_cast<double>(space.points() - 1);
  const UniformSpline spline(std::move(samples));
  SampleMatrix out(intervals + 1, space.curves());
  for (int f = 0; f <= intervals; ++f) {
    const double u = intervals == 0 ? 0.0 : static_cast<double>(f) / intervals;
    spline.value(sequence.warp.space_time(u) * last_point, out.row(f));
  }
  // What the functions left out of the displacement is spread evenly, so that every sequence ends where it should.
  const Eigen::RowVector3d missing = travel.transpose() - out.row(intervals).head<3>();
  for (int f = 0; f <= intervals; ++f) {
    const double u = intervals == 0 ? 0.0 : static_cast<double>(f) / intervals;
    out.row(f).head<3>() += start.transpose() + u * missing;
  }
  return out;
}

// A recording may go to and fro from one frame to the next, faster than the grid follows: then what the frames of a
// sequence miss is given to its scores, until it is there or no nearer.
void reach_frames(const RegisteredSpace& space, const SampleMatrix& values, double rate_hz, EncodedSequence& sequence) {
  constexpr double enough = 0.002;  // of a quaternion
  constexpr int most_rounds = 4;
  const MotionSpace& set = space.of(sequence.cycles);
  const int last = sequence.last - sequence.first;
  if (set.options().smooth || last < 2) return;  // what a smoothed space misses is noise
  ScoreMatrix best = sequence.scores;
  double least = std::numeric_limits<double>::infinity();
  for (int round = 0; round < most_rounds; ++round) {
    SampleMatrix missing = values.middleRows(sequence.first, last + 1) -
                           decode_frames(space, sequence, Eigen::Vector3d::Zero(), rate_hz, -1);
    missing.leftCols<travel_curves>().setZero();
    missing.row(0).setZero();  // ends are shared with the neighbours
    missing.row(last).setZero();
    const double most = missing.cwiseAbs().maxCoeff();
    if (most >= least) break;
    best = sequence.scores;
    least = most;
    if (most < enough) break;
    const SampleMatrix change =
        RunSampler(missing, Run{{0, last}}, rate_hz).sample(0, last, sequence.warp, set.points());
    sequence.scores += set.scores(change) - set.scores(SampleMatrix::Zero(change.rows(), change.cols()));
  }
  sequence.scores = std::move(best);
}

// Takes out of a sequence what does not fit at the cuts before and after it; null: there is none.
void join(SampleMatrix& frames, const CutCorrection* before, const CutCorrection* after, const JoinOptions& options) {
  const auto n = static_cast<double>(frames.rows() - 1);
  const double steepness = fade_steepness(n, options.blend);
  for (Eigen::Index f = 0; f < frames.rows(); ++f) {
    if (before != nullptr) {
      const Fade w = fade(static_cast<double>(f) / n, options.blend);
      frames.row(f) += -w.value * before->value - (w.slope * steepness) * before->slope_after;
    }
    if (after != nullptr) {
      const Fade w = fade((n - static_cast<double>(f)) / n, options.blend);
      frames.row(f) += w.value * after->value - (w.slope * steepness) * after->slope_before;
    }
  }
}

}  // namespace

int EncodedClip::sequence_count() const {
  int count = 0;
  for (const EncodedRun& run : runs) count += static_cast<int>(run.sequences.size());
  return count;
}

RunSampler::RunSampler(const SampleMatrix& values, const Run& run, double rate_hz)
    : values_(values), start_(run.cuts.front()), end_(run.cuts.back()), rate_hz_(rate_hz) {
  constexpr int ordinary_frames = 10'000;
  if (end_ - start_ < ordinary_frames) whole_.emplace(values.middleRows(start_, end_ - start_ + 1));
}

UniformSpline RunSampler::spline_around(int first, int last) const {
  return UniformSpline(values_.middleRows(first, last - first + 1));
}

void RunSampler::sample_point(const UniformSpline& spline, double x, Eigen::Ref<Eigen::RowVectorXd> out) const {
  spline.value(x, out);
  spline.derivative(x, out.head<travel_curves>());
  out.head<travel_curves>() *= rate_hz_;
}

SampleMatrix RunSampler::sample(int first, int last, const Warp& warp, int points) const {
  constexpr int margin = 40;
  constexpr int long_stretch = 4096;  // beyond it every point has a spline of its own
  SampleMatrix out(points, values_.cols());
  std::optional<UniformSpline> own;
  int own_start = start_;
  if (!whole_ && last - first <= long_stretch) {
    own_start = std::max(start_, first - margin);
    own = spline_around(own_start, std::min(end_, last + margin));
  }
  for (int i = 0; i < points; ++i) {
    const double s = static_cast<double>(i) / (points - 1);
    const double way = warp.own_time(s) * (last - first);
    if (whole_) {
      sample_point(*whole_, first - start_ + way, out.row(i));
    } else if (own) {
      sample_point(*own, first - own_start + way, out.row(i));
    } else {
      const int at = first + static_cast<int>(way);
      const int from = std::max(start_, at - margin);
      sample_point(spline_around(from, std::min(end_, at + margin)), first - from + way, out.row(i));
    }
  }
  return out;
}

namespace {

// A clip but for its scores; hands over the samples of each sequence, in order.
template <typename Take>
EncodedClip encode_with(const RegisteredSpace& space, const ClipCurves& curves, const std::vector<Run>& runs,
                        const std::vector<Warp>& warps, const Take& take) {
  EncodedClip out{.name = curves.name,
                  .rate_hz = curves.rate_hz,
                  .frames = curves.frames(),
                  .placement = curves.placement,
                  .side_tracks = curves.side_tracks};
  std::size_t warp = 0;
  for (const Run& run : runs) {
    const RunSampler sampler(curves.values, run, curves.rate_hz);
    EncodedRun& encoded = out.runs.emplace_back();
    encoded.start = curves.values.row(run.cuts.front()).head<3>().transpose().cast<float>();
    for (int i = 0; i < run.sequence_count(); ++i) {
      EncodedSequence sequence{.first = run.first_frame(i), .last = run.last_frame(i), .cycles = run.cycles_of(i)};
      if (!warps.empty()) sequence.warp = warps.at(warp++);
      sequence.travel =
          (curves.values.row(sequence.last) - curves.values.row(sequence.first)).head<3>().transpose().cast<float>();
      const int points = space.of(sequence.cycles).points();
      take(sequence.cycles, sampler.sample(sequence.first, sequence.last, sequence.warp, points));
      encoded.sequences.push_back(std::move(sequence));
    }
  }
  return out;
}

// Samples of sequences that wait for their scores, which come in the order of the sequences.
class ScoreQueue {
 public:
  ScoreQueue(const RegisteredSpace& space, const Compute& compute)
      : space_(space), compute_(compute), waiting_(space.sets().size()) {}

  void add(int cycles, SampleMatrix&& samples) {
    // The processor gains nothing from many at a time.
    const std::size_t most_bytes = compute_.choice() == "cpu" ? 0 : std::size_t{32} << 20;
    Waiting& set = waiting_[static_cast<std::size_t>(cycles)];
    bytes_ += static_cast<std::size_t>(samples.size()) * sizeof(double);
    set.places.push_back(scores_.size());
    set.samples.push_back(std::move(samples));
    scores_.emplace_back();
    if (bytes_ > most_bytes) work_off();
  }

  [[nodiscard]] std::vector<ScoreMatrix> finish() {
    work_off();
    return std::move(scores_);
  }

 private:
  struct Waiting {
    std::vector<SampleMatrix> samples;
    std::vector<std::size_t> places;
  };

  void work_off() {
    for (std::size_t set = 0; set < waiting_.size(); ++set) {
      Waiting& of_set = waiting_[set];
      if (of_set.samples.empty()) continue;
      std::vector<ScoreMatrix> found = space_.of(static_cast<int>(set)).scores(of_set.samples, compute_);
      for (std::size_t i = 0; i < found.size(); ++i) scores_[of_set.places[i]] = std::move(found[i]);
      of_set = {};
    }
    bytes_ = 0;
  }

  const RegisteredSpace& space_;
  const Compute& compute_;
  std::vector<Waiting> waiting_;  // by set
  std::size_t bytes_ = 0;
  std::vector<ScoreMatrix> scores_;
};

// Takes the clip's scores off the list, from `next` on.
void take_scores(EncodedClip& clip, std::vector<ScoreMatrix>& scores, std::size_t& next) {
  for (EncodedRun& run : clip.runs) {
    for (EncodedSequence& sequence : run.sequences) sequence.scores = std::move(scores[next++]);
  }
}

void complete_scores(const RegisteredSpace& space, const ClipCurves& curves, EncodedClip& clip) {
  for (EncodedRun& run : clip.runs) {
    for (EncodedSequence& sequence : run.sequences) {
      reach_frames(space, curves.values, curves.rate_hz, sequence);
      space.of(sequence.cycles).drop_needless(sequence.scores);
    }
  }
}

}  // namespace

EncodedClip encode(const RegisteredSpace& space, const ClipCurves& curves, const std::vector<Run>& runs,
                   const std::vector<Warp>& warps, const Compute& compute) {
  ScoreQueue queue(space, compute);
  EncodedClip out = encode_with(space, curves, runs, warps,
                                [&](int cycles, SampleMatrix&& samples) { queue.add(cycles, std::move(samples)); });
  std::vector<ScoreMatrix> scores = queue.finish();
  std::size_t next = 0;
  take_scores(out, scores, next);
  complete_scores(space, curves, out);
  return out;
}

std::vector<EncodedClip> encode(const RegisteredSpace& space, std::span<const ClipToEncode> clips,
                                const Compute& compute) {
  using OfClip = std::vector<std::pair<int, SampleMatrix>>;
  std::vector<EncodedClip> out(clips.size());
  std::vector<OfClip> samples(clips.size());
  parallel_for(std::size_t{0}, clips.size(), [&](std::size_t i) {
    out[i] = encode_with(space, *clips[i].curves, clips[i].runs, clips[i].warps,
                         [&](int cycles, SampleMatrix&& of) { samples[i].emplace_back(cycles, std::move(of)); });
  });
  ScoreQueue queue(space, compute);
  for (OfClip& of_clip : samples) {
    for (auto& [cycles, of_sequence] : of_clip) queue.add(cycles, std::move(of_sequence));
    of_clip.clear();
  }
  std::vector<ScoreMatrix> scores = queue.finish();
  std::size_t next = 0;
  for (EncodedClip& clip : out) take_scores(clip, scores, next);
  parallel_for(std::size_t{0}, out.size(), [&](std::size_t i) { complete_scores(space, *clips[i].curves, out[i]); });
  return out;
}

ClipDecoder::ClipDecoder(const RegisteredSpace& space)
    : space_(space), left_out_(space.options().pinned ? std::make_unique<const LeftOut>(space) : nullptr) {}
ClipDecoder::~ClipDecoder() = default;
ClipDecoder::ClipDecoder(ClipDecoder&&) noexcept = default;

void ClipDecoder::decode_in_parts(
    const EncodedClip& clip, int n, const JoinOptions& options,
    const std::function<void(int first, const Eigen::Ref<const SampleMatrix>& rows)>& visit) const {
  for (const EncodedRun& run : clip.runs) {
    // Two sequences at a time: positions of the root in metres from the clip's start, and quaternions.
    Eigen::Vector3d start = run.start.cast<double>();
    SampleMatrix next;
    std::optional<CutCorrection> before;
    for (std::size_t i = 0; i < run.sequences.size(); ++i) {
      SampleMatrix frames = i == 0 ? decode_frames(space_, run.sequences[i], start, clip.rate_hz, n) : std::move(next);
      start += run.sequences[i].travel.cast<double>();
      std::optional<CutCorrection> after;
      const bool last = i + 1 == run.sequences.size();
      if (!last) {
        next = decode_frames(space_, run.sequences[i + 1], start, clip.rate_hz, n);
        after = cut_correction(frames, next, options.free_change);
        if (left_out_) left_out_->correct(run.sequences[i], run.sequences[i + 1], n, *after);
      }
      join(frames, before ? &*before : nullptr, after ? &*after : nullptr, options);
      // The frame that two share is the later one's.
      visit(run.sequences[i].first, frames.topRows(last ? frames.rows() : frames.rows() - 1));
      before = std::move(after);
    }
  }
}

ClipCurves ClipDecoder::decode(const EncodedClip& clip, int n, const JoinOptions& options) const {
  ClipCurves out{.name = clip.name,
                 .rate_hz = clip.rate_hz,
                 .placement = clip.placement,
                 .values = SampleMatrix(clip.frames, space_.curves()),
                 .side_tracks = clip.side_tracks};
  decode_in_parts(clip, n, options, [&out](int first, const Eigen::Ref<const SampleMatrix>& rows) {
    out.values.middleRows(first, rows.rows()) = rows;
  });
  return out;
}

void decode_in_parts(const RegisteredSpace& space, const EncodedClip& clip, int n, const JoinOptions& options,
                     const std::function<void(int first, const Eigen::Ref<const SampleMatrix>& rows)>& visit) {
  ClipDecoder(space).decode_in_parts(clip, n, options, visit);
}

ClipCurves decode(const RegisteredSpace& space, const EncodedClip& clip, int n, const JoinOptions& options) {
  return ClipDecoder(space).decode(clip, n, options);
}

EncodedClip encode_clip(const RegisteredSpace& space, const Clip& clip, const SequenceOptions& sequences,
                        const Compute& compute) {
  if (!clip.skeleton.same_tree(space.skeleton())) {
    throw Error(ErrorKind::bad_input, {.file = clip.name,
                                       .found = "a skeleton that is not that of the motion space",
                                       .expected = "the same joint names, parents and channels"});
  }
  ClipCurves curves = clip_curves(clip);
  const std::vector<Run> runs = SequenceCutter(clip, sequences).cut(curves, clip.skeleton);
  space.apply_references(curves.values);
  const RestChoice at_rests = choose_rests(space, curves.values, runs, curves.rate_hz, compute);
  return encode(space, curves, apply_choice(runs, at_rests), {}, compute);
}

}  // namespace kinespace
