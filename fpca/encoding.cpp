#include "fpca/encoding.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "fpca/cut_join.h"

namespace kinespace {
namespace {

constexpr int travel_curves = 3;

// The frames of one decoded sequence: positions of the root in metres from the clip's start, and quaternions.
struct DecodedSequence {
  const EncodedSequence* encoded = nullptr;
  SampleMatrix frames;  // [frame][curve]
};

// Integrates the velocity over own time: at grid point i, duration * integral of v(s) h'(s) ds.
SampleMatrix integrate_travel(const SampleMatrix& samples, const Warp& warp, double duration_s) {
  const Eigen::Index points = samples.rows();
  SampleMatrix rate = samples.leftCols(travel_curves);
  const double step = 1.0 / static_cast<double>(points - 1);
  for (Eigen::Index i = 0; i < points; ++i)
    rate.row(i) *= warp.slope(static_cast<double>(i) * step) * duration_s * step;
  return UniformSpline(std::move(rate)).cumulative_integral();
}

SampleMatrix decode_frames(const MotionSpace& space, const EncodedSequence& sequence, const Eigen::Vector3d& start,
                           double rate_hz, int n) {
  SampleMatrix samples = space.samples(sequence.scores, n);
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

void join(std::vector<DecodedSequence>& sequences, const JoinOptions& options) {
  std::vector<CutCorrection> cuts;
  for (std::size_t i = 0; i + 1 < sequences.size(); ++i) {
    cuts.push_back(cut_correction(sequences[i].frames, sequences[i + 1].frames, options.free_change));
  }
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    SampleMatrix& frames = sequences[i].frames;
    const auto n = static_cast<double>(frames.rows() - 1);
    const double steepness = fade_steepness(n, options.blend);
    for (Eigen::Index f = 0; f < frames.rows(); ++f) {
      if (i > 0) {
        const Fade w = fade(static_cast<double>(f) / n, options.blend);
        frames.row(f) += -w.value * cuts[i - 1].value - (w.slope * steepness) * cuts[i - 1].slope;
      }
      if (i + 1 < sequences.size()) {
        const Fade w = fade((n - static_cast<double>(f)) / n, options.blend);
        frames.row(f) += w.value * cuts[i].value - (w.slope * steepness) * cuts[i].slope;
      }
    }
  }
}

// Farthest that a point of joint `descendant` can be from joint `ancestor`, by bone lengths, in cm.
double reach(const Skeleton& skeleton, int ancestor, int descendant) {
  double sum = 0;
  for (int j = descendant; j != ancestor; j = skeleton.joints[static_cast<std::size_t>(j)].parent) {
    sum += skeleton.joints[static_cast<std::size_t>(j)].offset.norm();
  }
  return sum;
}

bool is_above(const Skeleton& skeleton, int ancestor, int joint) {
  while (joint > ancestor) joint = skeleton.joints[static_cast<std::size_t>(joint)].parent;
  return joint == ancestor;
}

}  // namespace

int EncodedClip::sequence_count() const {
  int count = 0;
  for (const EncodedRun& run : runs) count += static_cast<int>(run.sequences.size());
  return count;
}

RunSampler::RunSampler(const SampleMatrix& values, const Run& run, double rate_hz)
    : spline_(values.middleRows(run.cuts.front(), run.cuts.back() - run.cuts.front() + 1)),
      start_(run.cuts.front()),
      rate_hz_(rate_hz) {}

SampleMatrix RunSampler::sample(int first, int last, const Warp& warp, int points) const {
  SampleMatrix out(points, spline_.curves());
  for (int i = 0; i < points; ++i) {
    const double s = static_cast<double>(i) / (points - 1);
    const double x = first - start_ + warp.own_time(s) * (last - first);
    spline_.value(x, out.row(i));
    spline_.derivative(x, out.row(i).head<travel_curves>());
    out.row(i).head<travel_curves>() *= rate_hz_;
  }
  return out;
}

EncodedClip encode(const MotionSpace& space, const ClipCurves& curves, const std::vector<Run>& runs,
                   const std::vector<Warp>& warps, const Compute& compute) {
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
      EncodedSequence sequence{.first = run.first_frame(i), .last = run.last_frame(i)};
      if (!warps.empty()) sequence.warp = warps.at(warp++);
      sequence.travel =
          (curves.values.row(sequence.last) - curves.values.row(sequence.first)).head<3>().transpose().cast<float>();
      sequence.scores =
          space.scores(sampler.sample(sequence.first, sequence.last, sequence.warp, space.points()), compute);
      encoded.sequences.push_back(std::move(sequence));
    }
  }
  return out;
}

ClipCurves decode(const MotionSpace& space, const EncodedClip& clip, int n, const JoinOptions& options) {
  ClipCurves out{.name = clip.name,
                 .rate_hz = clip.rate_hz,
                 .placement = clip.placement,
                 .values = SampleMatrix(clip.frames, space.curves()),
                 .side_tracks = clip.side_tracks};
  for (const EncodedRun& run : clip.runs) {
    std::vector<DecodedSequence> sequences;
    Eigen::Vector3d start = run.start.cast<double>();
    for (const EncodedSequence& encoded : run.sequences) {
      sequences.push_back({&encoded, decode_frames(space, encoded, start, clip.rate_hz, n)});
      start += encoded.travel.cast<double>();
    }
    join(sequences, options);
    for (const DecodedSequence& s : sequences) out.values.middleRows(s.encoded->first, s.frames.rows()) = s.frames;
  }
  return out;
}

EncodedClip encode_clip(const MotionSpace& space, const Clip& clip, const SequenceOptions& sequences) {
  if (!clip.skeleton.same_tree(space.skeleton())) {
    throw Error(ErrorKind::bad_input, {.file = clip.name,
                                       .found = "a skeleton that is not that of the motion space",
                                       .expected = "the same joint names, parents and channels"});
  }
  ClipCurves curves = clip_curves(clip);
  space.apply_references(curves.values);
  return encode(space, curves, cut_sequences(clip, sequences));
}

double truncation_bound_cm(const MotionSpace& space, const Skeleton& skeleton, const EncodedClip& clip, int n) {
  constexpr double cm_per_metre = 100;
  const CurveLayout& layout = space.layout();
  Eigen::VectorXd joint_error = Eigen::VectorXd::Zero(layout.joint_count());  // rms |q~ - q|, over the clip
  double root_error = 0;
  double time = 0;
  for (const EncodedRun& run : clip.runs) {
    for (const EncodedSequence& sequence : run.sequences) {
      const double duration = std::max(1, sequence.last - sequence.first) / clip.rate_hz;
      const Eigen::VectorXd error = space.truncation_error(sequence.scores, n);
      // Own time runs at most twice as fast as the space's, so its mean square is at most twice as large.
      const double stretch = sequence.warp.is_identity() ? 1 : 2;
      for (int k = 0; k < layout.joint_count(); ++k) {
        joint_error(k) += duration * stretch * error.segment<4>(3 + 4 * k).squaredNorm();
      }
      // |p(t)| <= integral |v|; both ends are exact, so the error grows over at most half the duration from either.
      root_error += duration * stretch * error.head<3>().squaredNorm() * duration * duration;
      time += duration;
    }
  }
  if (time <= 0) return 0;
  joint_error = (joint_error / time).cwiseSqrt();
  root_error = cm_per_metre * std::sqrt(root_error / time);
  double worst = root_error;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    double sum = root_error;
    for (int k = 0; k < layout.joint_count(); ++k) {
      const int above = layout.joints[static_cast<std::size_t>(k)];
      if (above < j && is_above(skeleton, above, j)) {
        sum += 2 * std::numbers::sqrt2 * joint_error(k) * reach(skeleton, above, j);
      }
    }
    worst = std::max(worst, sum);
  }
  return worst;
}

}  // namespace kinespace
