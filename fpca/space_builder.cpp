#include "kinespace/fpca/space_builder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/pose_features.h"

namespace kinespace {
namespace {

constexpr int clips_per_sum = 16;  // fixed, so that sums do not depend on threads
// As many sequences of a clip are in memory together: a quarter of an hour.
constexpr std::size_t sequences_per_block = 1024;

// Loads every clip once, block by block and the clips of a block in parallel, and hands each to `work` (in parallel)
// and then to `gather` (one at a time, in order). The clip is the work's own, to change.
template <typename Result>
void for_each_clip(const PreparedSource& clips, const Progress& progress, std::string_view stage,
                   const std::function<Result(int, PreparedClip&)>& work,
                   const std::function<void(int, Result&)>& gather) {
  for (int start = 0; start < clips.count; start += clips_per_sum) {
    progress.check_stop();
    progress.at(stage, static_cast<double>(start) / clips.count);
    const int count = std::min(clips_per_sum, clips.count - start);
    std::vector<std::optional<Result>> results(static_cast<std::size_t>(count));
    tbb::parallel_for(0, count, [&](int i) {
      PreparedClip clip = clips.load(start + i);
      results[static_cast<std::size_t>(i)] = work(start + i, clip);
    });
    for (int i = 0; i < count; ++i) gather(start + i, *results[static_cast<std::size_t>(i)]);
  }
  progress.at(stage, 1);
}

struct Survey {
  OrientationMoments orientations{0};
  Skeleton skeleton;
  std::string name;
  double rate_hz = 0;
  std::vector<int> lengths;  // frames of each sequence less one
};

int automatic_points(int longest_sequence) {
  return std::max(48, longest_sequence + 12);
}

// Hands over the samples of each sequence of a clip under its warps; the clip's curves go to the space's side.
template <typename Visit>
void visit_samples(const MotionSpace& space, PreparedClip& clip, const std::vector<Warp>& warps, const Visit& visit) {
  space.apply_references(clip.curves.values);
  std::size_t sequence = 0;
  for (const Run& run : clip.runs) {
    const RunSampler sampler(clip.curves.values, run, clip.curves.rate_hz);
    for (int i = 0; i < run.sequence_count(); ++i, ++sequence) {
      const Warp warp = warps.empty() ? Warp() : warps[sequence];
      visit(sampler.sample(run.first_frame(i), run.last_frame(i), warp, space.points()));
    }
  }
}

void merge_into(std::vector<CurveMoments>& all, const std::vector<CurveMoments>& part) {
  for (std::size_t g = 0; g < all.size(); ++g) all[g].merge(part[g]);
}

std::vector<CurveMoments> gather_moments(const PreparedSource& clips, const MotionSpace& space,
                                         const std::vector<std::vector<Warp>>& warps, const Compute& compute,
                                         const Progress& progress, std::string_view stage) {
  std::vector<CurveMoments> all = space.empty_moments();
  for_each_clip<std::vector<CurveMoments>>(
      clips, progress, stage,
      [&](int i, PreparedClip& clip) {
        std::vector<CurveMoments> part = space.empty_moments();
        std::vector<SampleMatrix> samples;
        visit_samples(space, clip, warps.empty() ? std::vector<Warp>() : warps[static_cast<std::size_t>(i)],
                      [&](SampleMatrix&& of_sequence) {
                        samples.push_back(std::move(of_sequence));
                        if (samples.size() < sequences_per_block) return;
                        space.accumulate(samples, part, compute);
                        samples.clear();
                      });
        if (!samples.empty()) space.accumulate(samples, part, compute);
        return part;
      },
      [&](int, std::vector<CurveMoments>& part) { merge_into(all, part); });
  return all;
}

// What the templates are chosen by.
struct SequenceTable {
  std::vector<int> clip;    // of each sequence
  std::vector<int> number;  // in its clip
  Eigen::MatrixXf vectors;  // of the first functions
};

SequenceTable tabulate_sequences(const PreparedSource& clips, const MotionSpace& space, int functions,
                                 const Progress& progress) {
  SequenceTable table;
  std::vector<Eigen::VectorXf> vectors;
  using Vectors = std::vector<Eigen::VectorXf>;
  for_each_clip<Vectors>(
      clips, progress, "group",
      [&](int, PreparedClip& clip) {
        Vectors out;
        visit_samples(space, clip, {}, [&](const SampleMatrix& samples) {
          const ScoreMatrix scores = space.scores(samples);
          const Eigen::Index n = std::min<Eigen::Index>(functions, scores.rows());
          out.emplace_back(Eigen::Map<const Eigen::VectorXf>(scores.data(), n * scores.cols()));
        });
        return out;
      },
      [&](int i, Vectors& of_clip) {
        for (std::size_t s = 0; s < of_clip.size(); ++s) {
          table.clip.push_back(i);
          table.number.push_back(static_cast<int>(s));
          vectors.push_back(std::move(of_clip[s]));
        }
      });
  table.vectors.resize(static_cast<Eigen::Index>(vectors.size()), vectors.empty() ? 0 : vectors.front().size());
  for (std::size_t i = 0; i < vectors.size(); ++i)
    table.vectors.row(static_cast<Eigen::Index>(i)) = vectors[i].transpose();
  return table;
}

// Hands over the keyframe features of each sequence of a clip, in order.
template <typename Visit>
void visit_features(const PreparedClip& clip, const Visit& visit) {
  const PoseFeatureSource source(clip.curves, clip.skeleton);
  const double keys_per_frame = 30.0 / clip.curves.rate_hz;
  std::vector<float> features;
  for (const Run& run : clip.runs) {
    for (int i = 0; i < run.sequence_count(); ++i) {
      const int from = std::min(static_cast<int>(std::lround(run.first_frame(i) * keys_per_frame)), source.rows() - 1);
      const int to =
          std::clamp(static_cast<int>(std::lround(run.last_frame(i) * keys_per_frame)), from, source.rows() - 1);
      features.clear();
      source.append(from, to - from + 1, features);
      visit(source.dims(), features);
    }
  }
}

// The features of the templates, by template.
FeatureSet template_features(const PreparedSource& clips, const SequenceTable& table, const TemplateGroups& groups,
                             const Progress& progress) {
  std::map<int, std::vector<std::size_t>> by_clip;  // templates of each clip
  for (std::size_t t = 0; t < groups.templates.size(); ++t) {
    by_clip[table.clip[static_cast<std::size_t>(groups.templates[t])]].push_back(t);
  }
  std::vector<std::vector<float>> features(groups.templates.size());
  FeatureSet out;
  for (const auto& [clip, templates] : by_clip) {
    progress.check_stop();
    int number = 0;
    visit_features(clips.load(clip), [&](int dims, const std::vector<float>& of_sequence) {
      out.dims = dims;
      for (const std::size_t t : templates) {
        if (table.number[static_cast<std::size_t>(groups.templates[t])] == number) features[t] = of_sequence;
      }
      ++number;
    });
  }
  for (const auto& f : features) out.add(f);
  return out;
}

// For each sequence the warp that its group's template proposes, identity where there is none. By clip.
std::vector<std::vector<Warp>> propose_warps(const PreparedSource& clips, const MotionSpace& space,
                                             const AlignmentOptions& options, const Compute& compute,
                                             const Progress& progress) {
  std::vector<std::vector<Warp>> out(static_cast<std::size_t>(clips.count));
  if (options.templates == 0) return out;
  const SequenceTable table = tabulate_sequences(clips, space, 3, progress);
  const TemplateGroups groups = group_sequences(table.vectors, options.templates);
  const FeatureSet templates = template_features(clips, table, groups, progress);
  for_each_clip<std::vector<Warp>>(
      clips, progress, "group",
      [&](int i, PreparedClip& clip) {
        std::vector<Warp> warps;
        auto group = static_cast<std::size_t>(std::ranges::lower_bound(table.clip, i) - table.clip.begin());
        FeatureSet sequences{.dims = templates.dims};
        std::vector<ClipPair> pairs;
        const auto match = [&] {
          const auto found =
              dtw(templates, sequences, pairs, {.steps = StepPattern::slope_limited, .want_path = true}, compute);
          for (std::size_t s = 0; s < found.size(); ++s) {
            warps.push_back(found[s].found() ? warp_of_path(found[s].path, templates.rows(pairs[s].query),
                                                            sequences.rows(pairs[s].target))
                                             : Warp());
          }
          sequences = {.dims = templates.dims};
          pairs.clear();
        };
        visit_features(clip, [&](int, const std::vector<float>& features) {
          pairs.push_back({groups.group[group++], static_cast<int>(pairs.size())});
          sequences.add(features);
          if (pairs.size() == sequences_per_block) match();
        });
        if (!pairs.empty()) match();
        return warps;
      },
      [&](int i, std::vector<Warp>& warps) { out[static_cast<std::size_t>(i)] = std::move(warps); });
  return out;
}

std::vector<Warp> align_prepared(const WarpSearch& search, const MotionSpace& space, PreparedClip& clip,
                                 const std::vector<Warp>& proposals) {
  space.apply_references(clip.curves.values);
  std::vector<Warp> out;
  for (const Run& run : clip.runs) {
    const RunSampler sampler(clip.curves.values, run, clip.curves.rate_hz);
    for (int i = 0; i < run.sequence_count(); ++i) {
      std::span<const Warp> proposal;
      if (!proposals.empty()) proposal = std::span(proposals).subspan(out.size(), 1);
      out.push_back(search.best(sampler, run.first_frame(i), run.last_frame(i), proposal));
    }
  }
  return out;
}

Survey survey(const PreparedSource& clips, const Progress& progress) {
  Survey all;
  int longest = 0;
  for_each_clip<Survey>(
      clips, progress, "survey",
      [](int, PreparedClip& clip) {
        Survey one{.orientations = OrientationMoments(curve_layout(clip.skeleton).joint_count()),
                   .skeleton = clip.skeleton,
                   .name = clip.curves.name,
                   .rate_hz = clip.curves.rate_hz};
        one.orientations.add(clip.curves.values);
        for (const Run& run : clip.runs) {
          for (int i = 0; i < run.sequence_count(); ++i) one.lengths.push_back(run.last_frame(i) - run.first_frame(i));
        }
        return one;
      },
      [&](int i, Survey& one) {
        for (const int n : one.lengths) longest = std::max(longest, n);
        if (i == 0) {
          all = std::move(one);
          return;
        }
        if (!one.skeleton.same_tree(all.skeleton)) {
          throw Error(ErrorKind::bad_input, {.file = one.name,
                                             .found = "another joint tree than that of " + all.name,
                                             .expected = "clips of one skeleton",
                                             .remedy = "build them apart, or give --by-skeleton for one space each"});
        }
        all.orientations.merge(one.orientations);
      });
  all.lengths = {longest};
  return all;
}

}  // namespace

PreparedClip prepare(const Clip& clip, const SequenceOptions& options) {
  return {clip.skeleton, clip_curves(clip), cut_sequences(clip, options)};
}

PreparedClip prepare(Clip&& clip, const SequenceOptions& options) {
  PreparedClip out{.skeleton = clip.skeleton, .curves = {}, .runs = cut_sequences(clip, options)};
  out.curves = clip_curves(std::move(clip));
  return out;
}

PreparedSource source_of(const std::vector<PreparedClip>& clips) {
  return {static_cast<int>(clips.size()), [&clips](int i) { return clips[static_cast<std::size_t>(i)]; }};
}

void SpaceBuildOptions::validate() const {
  space.validate();
  sequences.validate();
  alignment.validate();
}

BuiltSpace build_space(const PreparedSource& clips, const SpaceBuildOptions& options, const Compute& compute,
                       const Progress& progress) {
  options.validate();
  if (clips.count == 0) throw Error(ErrorKind::usage, {.found = "no clips", .expected = "one clip or more"});
  const Survey found = survey(clips, progress);
  const int points =
      options.space.points != 0 ? options.space.points : std::min(1024, automatic_points(found.lengths.front()));
  const Eigen::Matrix4Xd references = found.orientations.references();

  MotionSpace space(found.skeleton, options.space, points);
  space.set_references(references);
  std::vector<std::vector<Warp>> warps;
  if (options.align && options.alignment.rounds > 0) {
    // Aligned for the functions that all curves share, whatever the grouping of the result.
    MotionSpace pooled(found.skeleton, {.functions = 2 * options.alignment.functions}, points);
    pooled.set_references(references);
    pooled.fit(gather_moments(clips, pooled, {}, compute, progress, "analyse"));
    const auto proposals = propose_warps(clips, pooled, options.alignment, compute, progress);
    for (int round = 0; round < options.alignment.rounds; ++round) {
      const WarpSearch search(pooled, options.alignment);
      std::vector<std::vector<Warp>> next(static_cast<std::size_t>(clips.count));
      for_each_clip<std::vector<Warp>>(
          clips, progress, "align",
          [&](int i, PreparedClip& clip) {
            const auto index = static_cast<std::size_t>(i);
            return align_prepared(search, pooled, clip, warps.empty() ? proposals[index] : warps[index]);
          },
          [&](int i, std::vector<Warp>& w) { next[static_cast<std::size_t>(i)] = std::move(w); });
      warps = std::move(next);
      if (round + 1 < options.alignment.rounds)
        pooled.fit(gather_moments(clips, pooled, warps, compute, progress, "analyse"));
    }
  }
  space.fit(gather_moments(clips, space, warps, compute, progress, "analyse"));
  if (warps.empty()) warps.resize(static_cast<std::size_t>(clips.count));
  return {std::move(space), std::move(warps)};
}

BuiltSpace extend_space(const MotionSpace& space, const PreparedSource& clips, const SpaceBuildOptions& options,
                        const Compute& compute, const Progress& progress) {
  options.validate();
  std::vector<std::vector<Warp>> warps(static_cast<std::size_t>(clips.count));
  // Functions of all curves together are what warps are searched against; spaces of other groupings take clips as they
  // are.
  if (options.align && options.alignment.rounds > 0 && space.options().grouping == Grouping::all_together) {
    const WarpSearch search(space, options.alignment);
    for_each_clip<std::vector<Warp>>(
        clips, progress, "align", [&](int, PreparedClip& clip) { return align_prepared(search, space, clip, {}); },
        [&](int i, std::vector<Warp>& w) { warps[static_cast<std::size_t>(i)] = std::move(w); });
  }
  std::vector<CurveMoments> moments = space.moments();
  merge_into(moments, gather_moments(clips, space, warps, compute, progress, "analyse"));
  MotionSpace extended(space.skeleton(), space.options(), space.points());
  extended.set_references(space.references());
  extended.fit(std::move(moments));
  return {std::move(extended), std::move(warps)};
}

OrientationMoments::OrientationMoments(int joints) : sums_(static_cast<std::size_t>(joints), Eigen::Matrix4d::Zero()) {}

void OrientationMoments::add(const SampleMatrix& values) {
  for (std::size_t k = 0; k < sums_.size(); ++k) {
    const auto q = values.middleCols(3 + 4 * static_cast<Eigen::Index>(k), 4);
    // The root is turned to heading 0 at the first frame only, and may end anywhere.
    if (k == 0) {
      sums_[k] += q.row(0).transpose() * q.row(0) * static_cast<double>(q.rows());
    } else {
      sums_[k] += q.transpose() * q;
    }
  }
}

void OrientationMoments::merge(const OrientationMoments& other) {
  for (std::size_t k = 0; k < sums_.size(); ++k) sums_[k] += other.sums_[k];
}

Eigen::Matrix4Xd OrientationMoments::references() const {
  Eigen::Matrix4Xd out(4, static_cast<Eigen::Index>(sums_.size()));
  for (std::size_t k = 0; k < sums_.size(); ++k) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(sums_[k]);
    Eigen::Vector4d axis = solver.eigenvectors().col(3);
    Eigen::Index largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    if (axis(largest) < 0) axis = -axis;
    out.col(static_cast<Eigen::Index>(k)) = axis;
  }
  return out;
}

std::vector<Warp> align_clip(const WarpSearch& search, const ClipCurves& curves, const std::vector<Run>& runs) {
  std::vector<Warp> out;
  for (const Run& run : runs) {
    const RunSampler sampler(curves.values, run, curves.rate_hz);
    for (int i = 0; i < run.sequence_count(); ++i) {
      out.push_back(search.best(sampler, run.first_frame(i), run.last_frame(i), {}));
    }
  }
  return out;
}

}  // namespace kinespace
