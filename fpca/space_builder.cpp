#include "kinespace/fpca/space_builder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/base/parallel.h"
#include "kinespace/fpca/pose_features.h"

namespace kinespace {
namespace {

constexpr int clips_per_sum = 16;                                // fixed, so that sums do not depend on threads
constexpr std::size_t sequences_per_block = 1024;                // whose features are in memory together
constexpr std::size_t bytes_of_samples = std::size_t{32} << 20;  // of a clip that wait to be multiplied

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
    parallel_for(0, count, [&](int i) {
      PreparedClip clip = clips.load(start + i);
      results[static_cast<std::size_t>(i)] = work(start + i, clip);
    });
    for (int i = 0; i < count; ++i) gather(start + i, *results[static_cast<std::size_t>(i)]);
  }
  progress.at(stage, 1);
}

// By set of the space: sequences of so many cycles.
template <typename T>
using BySet = std::vector<T>;
using SetMoments = BySet<std::vector<CurveMoments>>;

struct Survey {
  OrientationMoments orientations{0};
  Skeleton skeleton;
  std::string name;
  BySet<double> seconds;  // of its sequences together ...
  BySet<int> sequences;   // ... and how many they are
  int stretches = 0;      // of cycles, that might be cut at rests
  BySet<int> longest;     // frames of the longest sequence less one; 0 where there is none
  // Clips with motion that was cut at rests, by a hash of their names: the order in which they are tried.
  std::vector<std::pair<std::string, int>> at_rests;

  // Makes room for so many sets.
  void reach(std::size_t sets) {
    if (sets <= longest.size()) return;
    longest.resize(sets, 0);
    sequences.resize(sets, 0);
    seconds.resize(sets, 0);
  }
  // How many times as long a set's sequences are as a sequence that was cut at rests usually is.
  [[nodiscard]] double pace(std::size_t set) const {
    constexpr double usual_s = 0.85;
    if (set == 0 || sequences[set] == 0) return 1;
    return std::clamp(seconds[set] / sequences[set] / usual_s, 1.0, 100.0);
  }
};

constexpr int shortest_aligned = 4;  // frames; in fewer there is nothing to align

int automatic_points(int longest_sequence, int cycles) {
  // The set's moments grow with the square of the points.
  const int most = cycles > 0 ? 512 : 1024;
  return std::clamp(longest_sequence + 12, 48, most);
}

// Hands over the set and the samples of each sequence of a clip under its warps; the clip's curves go to the space's
// side.
template <typename Visit>
void visit_samples(const RegisteredSpace& space, PreparedClip& clip, const std::vector<Warp>& warps,
                   const Visit& visit) {
  space.apply_references(clip.curves.values);
  std::size_t sequence = 0;
  for (const Run& run : clip.runs) {
    const RunSampler sampler(clip.curves.values, run, clip.curves.rate_hz);
    for (int i = 0; i < run.sequence_count(); ++i, ++sequence) {
      const auto set = static_cast<std::size_t>(run.cycles_of(i));
      if (set >= space.sets().size()) continue;
      const Warp warp = warps.empty() ? Warp() : warps[sequence];
      visit(set, sampler.sample(run.first_frame(i), run.last_frame(i), warp, space.sets()[set].points()));
    }
  }
}

SetMoments empty_moments(const RegisteredSpace& space) {
  SetMoments out;
  for (const MotionSpace& set : space.sets()) out.push_back(set.empty_moments());
  return out;
}

void merge_into(SetMoments& all, const SetMoments& part) {
  for (std::size_t set = 0; set < all.size(); ++set) {
    for (std::size_t g = 0; g < part[set].size(); ++g) all[set][g].merge(part[set][g]);
  }
}

SetMoments moments_of(const RegisteredSpace& space, PreparedClip& clip, const std::vector<Warp>& warps,
                      const Compute& compute) {
  SetMoments part(space.sets().size());
  BySet<std::vector<SampleMatrix>> samples(part.size());
  const auto add = [&](std::size_t set) {
    if (part[set].empty()) part[set] = space.sets()[set].empty_moments();
    space.sets()[set].accumulate(samples[set], part[set], compute);
    samples[set].clear();
  };
  visit_samples(space, clip, warps, [&](std::size_t set, SampleMatrix&& of_sequence) {
    const auto size = static_cast<std::size_t>(of_sequence.size()) * sizeof(double);
    samples[set].push_back(std::move(of_sequence));
    if (samples[set].size() * size >= bytes_of_samples) add(set);
  });
  for (std::size_t set = 0; set < part.size(); ++set) {
    if (!samples[set].empty()) add(set);
  }
  return part;
}

SetMoments gather_moments(const PreparedSource& clips, const RegisteredSpace& space,
                          const std::vector<std::vector<Warp>>& warps, const Compute& compute, const Progress& progress,
                          std::string_view stage) {
  SetMoments all = empty_moments(space);
  for_each_clip<SetMoments>(
      clips, progress, stage,
      [&](int i, PreparedClip& clip) {
        return moments_of(space, clip, warps.empty() ? std::vector<Warp>() : warps[static_cast<std::size_t>(i)],
                          compute);
      },
      [&](int, SetMoments& part) { merge_into(all, part); });
  return all;
}

// What the templates are chosen by.
struct SequenceTable {
  std::vector<int> clip;    // of each sequence
  std::vector<int> number;  // in its clip
  Eigen::MatrixXf vectors;  // of the first functions
};

SequenceTable tabulate_sequences(const PreparedSource& clips, const MotionSpace& space, int functions,
                                 const Compute& compute, const Progress& progress) {
  SequenceTable table;
  const RegisteredSpace one_set(space);
  std::vector<Eigen::VectorXf> vectors;
  using Vectors = std::vector<Eigen::VectorXf>;
  for_each_clip<Vectors>(
      clips, progress, "group",
      [&](int, PreparedClip& clip) {
        Vectors out;
        std::vector<SampleMatrix> waiting;
        const auto project = [&] {
          for (const ScoreMatrix& scores : space.scores(waiting, compute)) {
            const Eigen::Index n = std::min<Eigen::Index>(functions, scores.rows());
            out.emplace_back(Eigen::Map<const Eigen::VectorXf>(scores.data(), n * scores.cols()));
          }
          waiting.clear();
        };
        visit_samples(one_set, clip, {}, [&](std::size_t, SampleMatrix&& samples) {
          const auto size = static_cast<std::size_t>(samples.size()) * sizeof(double);
          waiting.push_back(std::move(samples));
          if (waiting.size() * size >= bytes_of_samples) project();
        });
        if (!waiting.empty()) project();
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

// Hands over the keyframe features of each sequence of a clip that was cut at rests, in order.
template <typename Visit>
void visit_features(const PreparedClip& clip, const Visit& visit) {
  const PoseFeatureSource source(clip.curves, clip.skeleton);
  const double keys_per_frame = 30.0 / clip.curves.rate_hz;
  std::vector<float> features;
  for (const Run& run : clip.runs) {
    for (int i = 0; i < run.sequence_count(); ++i) {
      if (run.cycles_of(i) > 0) continue;
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

// For each sequence that was cut at rests the warp that its group's template proposes, identity where there is none. By
// clip.
std::vector<std::vector<Warp>> propose_warps(const PreparedSource& clips, const MotionSpace& space,
                                             const AlignmentOptions& options, const Compute& compute,
                                             const Progress& progress) {
  std::vector<std::vector<Warp>> out(static_cast<std::size_t>(clips.count));
  if (options.templates == 0) return out;
  const SequenceTable table = tabulate_sequences(clips, space, 3, compute, progress);
  if (table.clip.empty()) return out;
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

// Warps for the sequences of a clip that were cut at rests, the identity for whole cycles: their phases agree already.
std::vector<Warp> align_prepared(const WarpSearch& search, const RegisteredSpace& space, PreparedClip& clip,
                                 const std::vector<Warp>& proposals) {
  space.apply_references(clip.curves.values);
  std::vector<Warp> out;
  std::size_t at_rests = 0;
  for (const Run& run : clip.runs) {
    const RunSampler sampler(clip.curves.values, run, clip.curves.rate_hz);
    for (int i = 0; i < run.sequence_count(); ++i) {
      if (run.cycles_of(i) > 0) {
        out.emplace_back();
        continue;
      }
      std::span<const Warp> proposal;
      if (!proposals.empty()) proposal = std::span(proposals).subspan(at_rests++, 1);
      out.push_back(search.best(sampler, run.first_frame(i), run.last_frame(i), proposal));
    }
  }
  return out;
}

// Those of the warps of a clip that belong to sequences that were cut at rests.
std::vector<Warp> at_rests(const PreparedClip& clip, const std::vector<Warp>& warps) {
  std::vector<Warp> out;
  std::size_t sequence = 0;
  for (const Run& run : clip.runs) {
    for (int i = 0; i < run.sequence_count(); ++i, ++sequence) {
      if (run.cycles_of(i) == 0) out.push_back(warps[sequence]);
    }
  }
  return out;
}

Survey survey(const PreparedSource& clips, const Progress& progress) {
  Survey all;
  for_each_clip<Survey>(
      clips, progress, "survey",
      [](int i, PreparedClip& clip) {
        Survey one{.orientations = OrientationMoments(curve_layout(clip.skeleton).joint_count()),
                   .skeleton = clip.skeleton,
                   .name = clip.curves.name};
        one.orientations.add(clip.curves.values);
        one.reach(1);
        for (const Run& run : clip.runs) {
          one.stretches += static_cast<int>(run.at_rests.size());
          for (int k = 0; k < run.sequence_count(); ++k) {
            const auto set = static_cast<std::size_t>(run.cycles_of(k));
            one.reach(set + 1);
            ++one.sequences[set];
            one.seconds[set] += (run.last_frame(k) - run.first_frame(k)) / clip.curves.rate_hz;
            one.longest[set] = std::max(one.longest[set], run.last_frame(k) - run.first_frame(k));
          }
        }
        if (one.longest[0] >= shortest_aligned) {
          one.at_rests.emplace_back(content_hash(std::as_bytes(std::span(clip.curves.name))), i);
        }
        return one;
      },
      [&](int i, Survey& one) {
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
        all.at_rests.insert(all.at_rests.end(), one.at_rests.begin(), one.at_rests.end());
        all.stretches += one.stretches;
        all.reach(one.longest.size());
        for (std::size_t set = 0; set < one.longest.size(); ++set) {
          all.longest[set] = std::max(all.longest[set], one.longest[set]);
          all.sequences[set] += one.sequences[set];
          all.seconds[set] += one.seconds[set];
        }
      });
  return all;
}

}  // namespace

PreparedClip prepare(const Clip& clip, const SequenceOptions& options) {
  ClipCurves curves = clip_curves(clip);
  std::vector<Run> runs = SequenceCutter(clip, options).cut(curves, clip.skeleton);
  return {clip.skeleton, std::move(curves), std::move(runs)};
}

PreparedClip prepare(Clip&& clip, const SequenceOptions& options) {
  const SequenceCutter cutter(clip, options);
  PreparedClip out{.skeleton = clip.skeleton, .curves = {}, .runs = {}};
  out.curves = clip_curves(std::move(clip));
  out.runs = cutter.cut(out.curves, out.skeleton);
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

namespace {

// Smoothing does not leave functions at 0 at the ends.
bool pinned(const MotionSpaceOptions& options) {
  return options.pinned && !options.smooth;
}

// The first set that there are sequences for.
std::size_t first_set(const Survey& found) {
  const auto first = std::ranges::find_if(found.longest, [](int longest) { return longest > 0; });
  return first == found.longest.end() ? 0 : static_cast<std::size_t>(first - found.longest.begin());
}

// Sets without functions: one for each kind of sequence that there is, and that of sequences cut at rests.
RegisteredSpace empty_space(const Survey& found, const MotionSpaceOptions& options,
                            const Eigen::Matrix4Xd& references) {
  std::vector<MotionSpace> sets;
  for (std::size_t set = 0; set < found.longest.size(); ++set) {
    MotionSpaceOptions of_set = options;
    of_set.cycles = static_cast<int>(set);
    of_set.pace = found.pace(set);
    of_set.pinned = pinned(options);
    // A set that nothing was cut for is made of what there is (fit_sets).
    const std::size_t made_of = set == 0 ? first_set(found) : set;
    const int points =
        options.points != 0 ? options.points : automatic_points(found.longest[made_of], static_cast<int>(made_of));
    sets.emplace_back(found.skeleton, of_set, points).set_references(references);
  }
  return RegisteredSpace(std::move(sets));
}

// Finds the functions of every set. Where no motion was cut at rests, the set for it is made of the cycles, so that
// other clips can be described at all.
RegisteredSpace fit_sets(const RegisteredSpace& space, SetMoments moments, const Compute& compute) {
  std::vector<MotionSpace> sets = space.sets();
  for (std::size_t set = 1; set < sets.size(); ++set) sets[set].fit(std::move(moments[set]), compute);
  if (moments[0][0].count() == 0) {
    const auto first = std::find_if(sets.begin() + 1, sets.end(), [](const MotionSpace& set) {
      return !set.moments().empty() && set.moments().front().count() > 0;
    });
    if (first != sets.end() && first->points() == sets[0].points()) moments[0] = first->moments();
  }
  sets[0].fit(std::move(moments[0]), compute);
  return RegisteredSpace(std::move(sets));
}

// The functions of motion that was cut at rests, under warps, as all curves share them, whatever the grouping of the
// result.
MotionSpace fit_pooled(const PreparedSource& clips, const RegisteredSpace& space,
                       const std::vector<std::vector<Warp>>& warps, const SpaceBuildOptions& options,
                       const Compute& compute, const Progress& progress) {
  MotionSpaceOptions pooled_options{.functions = 2 * options.alignment.functions, .pinned = pinned(options.space)};
  MotionSpace pooled(space.skeleton(), pooled_options, space.plain().points());
  pooled.set_references(space.references());
  pooled.fit(std::move(gather_moments(clips, pooled, warps, compute, progress, "analyse").front()), compute);
  return pooled;
}

// Warps for all clips, refined in rounds against the functions of the round before; none where there is nothing to
// align.
std::vector<std::vector<Warp>> align_all(const PreparedSource& clips, const RegisteredSpace& space,
                                         const SpaceBuildOptions& options, const Compute& compute,
                                         const Progress& progress) {
  MotionSpace pooled = fit_pooled(clips, space, {}, options, compute, progress);
  if (pooled.functions() == 0) return {};
  std::vector<std::vector<Warp>> warps = propose_warps(clips, pooled, options.alignment, compute, progress);
  for (int round = 0; round < options.alignment.rounds; ++round) {
    if (round > 0) pooled = fit_pooled(clips, space, warps, options, compute, progress);
    const WarpSearch search(pooled, options.alignment);
    std::vector<std::vector<Warp>> next(static_cast<std::size_t>(clips.count));
    for_each_clip<std::vector<Warp>>(
        clips, progress, "align",
        [&](int i, PreparedClip& clip) {
          // The first round has proposals for sequences cut at rests; later ones refine from there.
          const std::vector<Warp>& before = warps[static_cast<std::size_t>(i)];
          return align_prepared(search, space, clip, round == 0 ? before : at_rests(clip, before));
        },
        [&](int i, std::vector<Warp>& w) { next[static_cast<std::size_t>(i)] = std::move(w); });
    warps = std::move(next);
  }
  return warps;
}

PreparedSource part_of(const PreparedSource& clips, std::span<const std::pair<std::string, int>> chosen) {
  return {static_cast<int>(chosen.size()),
          [&clips, chosen](int i) { return clips.load(chosen[static_cast<std::size_t>(i)].second); }};
}

// What the first functions leave of the sequences of clips that were cut at rests, under the best warps or under none.
double residual_of(const PreparedSource& clips, const RegisteredSpace& space, const WarpSearch& search, bool warped,
                   const Progress& progress) {
  double sum = 0;
  for_each_clip<double>(
      clips, progress, "align",
      [&](int, PreparedClip& clip) {
        double left = 0;
        space.apply_references(clip.curves.values);
        for (const Run& run : clip.runs) {
          const RunSampler sampler(clip.curves.values, run, clip.curves.rate_hz);
          for (int i = 0; i < run.sequence_count(); ++i) {
            const int first = run.first_frame(i);
            const int last = run.last_frame(i);
            if (run.cycles_of(i) > 0 || last - first < shortest_aligned) continue;
            left += search.residual(sampler, first, last, warped ? search.best(sampler, first, last, {}) : Warp());
          }
        }
        return left;
      },
      [&](int, double& left) { sum += left; });
  return sum;
}

// Warps cost time and bytes, and what they win on the motion they were found with they may lose on other motion. So
// they are found for four fifths of a few clips, and kept only if functions under them leave less of the last fifth.
bool alignment_pays(const PreparedSource& clips, Survey& found, const RegisteredSpace& space,
                    const SpaceBuildOptions& options, const Compute& compute, const Progress& progress) {
  if (!options.alignment.on_trial) return true;
  constexpr std::size_t fewest = 10;
  constexpr std::size_t most = 80;
  constexpr double worth_it = 0.95;
  std::ranges::sort(found.at_rests);
  const std::span<const std::pair<std::string, int>> tried(found.at_rests.data(),
                                                           std::min(most, found.at_rests.size()));
  if (tried.size() < fewest) return false;
  const PreparedSource held_out = part_of(clips, tried.first(tried.size() / 5));
  const PreparedSource known = part_of(clips, tried.subspan(tried.size() / 5));
  const auto residual = [&](const std::vector<std::vector<Warp>>& warps, bool warped) {
    const WarpSearch search(fit_pooled(known, space, warps, options, compute, progress), options.alignment);
    return residual_of(held_out, space, search, warped, progress);
  };
  const double plain = residual({}, false);
  return residual(align_all(known, space, options, compute, progress), true) < worth_it * plain;
}

}  // namespace

namespace {

constexpr double least_share = 0.02;  // of all sequences, that a set of cycles must hold to be kept

// The clips, each with other runs.
template <typename Runs>
PreparedSource with_runs(const PreparedSource& clips, const Runs& runs_of) {
  return {clips.count, [&clips, runs_of](int i) {
            PreparedClip clip = clips.load(i);
            clip.runs = runs_of(i, clip.runs);
            return clip;
          }};
}

// `choices` must outlive it.
PreparedSource with_choices(const PreparedSource& clips, const std::vector<RestChoice>& choices) {
  return with_runs(clips, [&choices](int i, const std::vector<Run>& runs) {
    return apply_choice(runs, choices[static_cast<std::size_t>(i)]);
  });
}

std::vector<RestChoice> choose_all(const PreparedSource& clips, const RegisteredSpace& space, const Compute& compute,
                                   const Progress& progress) {
  std::vector<RestChoice> out(static_cast<std::size_t>(clips.count));
  for_each_clip<RestChoice>(
      clips, progress, "register",
      [&](int, PreparedClip& clip) {
        space.apply_references(clip.curves.values);
        return choose_rests(space, clip.curves.values, clip.runs, clip.curves.rate_hz, compute);
      },
      [&](int i, RestChoice& choice) { out[static_cast<std::size_t>(i)] = std::move(choice); });
  return out;
}

// Cycles or rests for every stretch of cycles, by the functions that the clips cut both ways have.
std::vector<RestChoice> choose_all(const PreparedSource& clips, const Survey& found, const SpaceBuildOptions& options,
                                   const Compute& compute, const Progress& progress) {
  if (found.stretches == 0) return std::vector<RestChoice>(static_cast<std::size_t>(clips.count));
  const PreparedSource both = with_runs(clips, [](int, const std::vector<Run>& runs) { return both_ways(runs); });
  const RegisteredSpace empty = empty_space(survey(both, progress), options.space, found.orientations.references());
  RegisteredSpace space = fit_sets(empty, gather_moments(both, empty, {}, compute, progress, "register"), compute);
  std::vector<RestChoice> choices = choose_all(clips, space, compute, progress);
  // A set costs what its functions and moments take, whatever it is used for.
  const Survey chosen = survey(with_choices(clips, choices), progress);
  const int all = std::accumulate(chosen.sequences.begin(), chosen.sequences.end(), 0);
  std::vector<MotionSpace> sets = space.sets();
  bool dropped = false;
  for (std::size_t set = 1; set < sets.size(); ++set) {
    const int held = set < chosen.sequences.size() ? chosen.sequences[set] : 0;
    if (!space.has(static_cast<int>(set)) || held >= least_share * all) continue;
    sets[set] = empty.sets()[set];
    dropped = true;
  }
  return dropped ? choose_all(clips, RegisteredSpace(std::move(sets)), compute, progress) : choices;
}

}  // namespace

BuiltSpace build_space(const PreparedSource& all_clips, const SpaceBuildOptions& options, const Compute& compute,
                       const Progress& progress) {
  options.validate();
  if (all_clips.count == 0) throw Error(ErrorKind::usage, {.found = "no clips", .expected = "one clip or more"});
  Survey found = survey(all_clips, progress);
  const std::vector<RestChoice> choices = choose_all(all_clips, found, options, compute, progress);
  const PreparedSource clips = with_choices(all_clips, choices);
  if (found.stretches > 0) found = survey(clips, progress);
  RegisteredSpace space = empty_space(found, options.space, found.orientations.references());
  std::vector<std::vector<Warp>> warps;
  const bool warped =
      options.align && options.alignment.rounds > 0 && alignment_pays(clips, found, space, options, compute, progress);
  if (warped) warps = align_all(clips, space, options, compute, progress);
  space = fit_sets(space, gather_moments(clips, space, warps, compute, progress, "analyse"), compute);
  space.set_warped(warped);
  if (warps.empty()) warps.resize(static_cast<std::size_t>(clips.count));
  return {std::move(space), choices, std::move(warps)};
}

BuiltSpace extend_space(const RegisteredSpace& space, const PreparedSource& all_clips, const SpaceBuildOptions& options,
                        const Compute& compute, const Progress& progress) {
  options.validate();
  // Kinds of sequences that the space has not met are cut at rests.
  const std::vector<RestChoice> choices = choose_all(all_clips, space, compute, progress);
  const PreparedSource clips = with_choices(all_clips, choices);
  std::vector<std::vector<Warp>> warps(static_cast<std::size_t>(clips.count));
  // Functions of all curves together are what warps are searched against; spaces of other groupings take clips as they
  // are.
  if (options.align && space.warped() && options.alignment.rounds > 0 &&
      space.options().grouping == Grouping::all_together && space.plain().functions() > 0) {
    const WarpSearch search(space.plain(), options.alignment);
    for_each_clip<std::vector<Warp>>(
        clips, progress, "align", [&](int, PreparedClip& clip) { return align_prepared(search, space, clip, {}); },
        [&](int i, std::vector<Warp>& w) { warps[static_cast<std::size_t>(i)] = std::move(w); });
  }
  SetMoments moments = gather_moments(clips, space, warps, compute, progress, "analyse");
  for (std::size_t set = 0; set < moments.size(); ++set) {
    const std::vector<CurveMoments>& before = space.sets()[set].moments();
    for (std::size_t g = 0; g < before.size(); ++g) moments[set][g].merge(before[g]);
  }
  BuiltSpace built{fit_sets(space, std::move(moments), compute), choices, std::move(warps)};
  built.space.set_warped(space.warped());
  return built;
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

}  // namespace kinespace
