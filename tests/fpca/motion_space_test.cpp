#include "kinespace/fpca/motion_space.h"

#include <random>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "kinespace/base/error.h"
#include "kinespace/library/detail/space_codec.h"
#include "kinespace/motion/error_measures.h"
#include "kinespace/motion/kinematics.h"
#include "tests/fpca/sample_curves.h"
#include "tests/fpca/sample_space.h"
#include "tests/support/data.h"
#include "tests/support/opencl_device.h"

namespace kinespace {
namespace {

using test::encode_sample;
using test::prepared_samples;
using test::sample_clips;
using test::sample_space;

Clip decode_sample(const BuiltSpace& built, std::size_t i, int n) {
  return clip_from_curves(decode(built.space, encode_sample(built, i), n), sample_clips()[i].skeleton);
}

TEST(MotionSpace, functions_of_every_set_are_orthonormal_in_the_inner_product_of_the_scores) {
  int sets = 0;
  for (const MotionSpace& set : sample_space().space.sets()) {
    if (set.functions() == 0) continue;
    const FunctionGroup& group = set.groups().front();
    const Eigen::VectorXd w = trapezoid_weights(set.points(), 1.0);
    const Eigen::MatrixXd gram = group.functions.transpose() * w.asDiagonal() * group.functions;
    EXPECT_LT((gram - Eigen::MatrixXd::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT(group.functions.row(0).cwiseAbs().maxCoeff(), 1e-6) << "functions vanish where ends are kept";
    EXPECT_LT(group.functions.bottomRows(1).cwiseAbs().maxCoeff(), 1e-6);
    ++sets;
  }
  EXPECT_GE(sets, 2) << "the sample motions have walks";
}

TEST(MotionSpace, all_functions_give_every_clip_back) {
  for (std::size_t i = 0; i < sample_clips().size(); ++i) {
    const MotionError error = compare(sample_clips()[i], decode_sample(sample_space(), i, -1));
    EXPECT_LT(error.mean_joint_error_cm, 0.1) << sample_clips()[i].name;
    EXPECT_LT(error.max_joint_error_cm, 5) << sample_clips()[i].name;
  }
}

TEST(MotionSpace, more_functions_leave_less_error) {
  double before = 1e9;
  for (const int n : {0, 1, 3, 5, 8, 12}) {
    double sum = 0;
    for (std::size_t i = 0; i < 6; ++i)
      sum += compare(sample_clips()[i], decode_sample(sample_space(), i, n)).mean_joint_error_cm;
    EXPECT_LT(sum, before) << n;
    before = sum;
  }
}

TEST(MotionSpace, a_clip_ends_where_it_ended_at_any_level_of_detail) {
  for (const int n : {1, 5}) {
    const Clip decoded = decode_sample(sample_space(), 0, n);
    const int last = decoded.frames - 1;
    EXPECT_LT((decoded.translation(0, last) - sample_clips()[0].translation(0, last)).norm(), 1e-2);
  }
}

TEST(MotionSpace, the_error_of_leaving_functions_out_is_known_from_the_scores) {
  const EncodedSequence sequence = encode_sample(sample_space(), 1).runs[0].sequences[0];
  const MotionSpace& set = sample_space().space.of(sequence.cycles);
  const SampleMatrix difference = set.samples(sequence.scores) - set.samples(sequence.scores, 4);
  const Eigen::VectorXd w = trapezoid_weights(set.points(), 1.0);
  const Eigen::VectorXd measured = (difference.cwiseAbs2().transpose() * w).cwiseSqrt();
  EXPECT_LT((measured - set.truncation_error(sequence.scores, 4)).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(MotionSpace, cuts_are_exact_at_every_level_of_detail) {
  for (std::size_t i = 0; i < sample_clips().size(); ++i) {
    const EncodedClip clip = encode_sample(sample_space(), i);
    ClipCurves curves = prepared_samples()[i].curves;
    sample_space().space.apply_references(curves.values);
    for (const int level : {0, 1, 3}) {
      const ClipCurves decoded = decode(sample_space().space, clip, level);
      for (const EncodedRun& run : clip.runs) {
        for (const EncodedSequence& s : run.sequences) {
          const auto difference = decoded.values.row(s.first) - curves.values.row(s.first);
          EXPECT_LT(difference.tail(difference.size() - 3).cwiseAbs().maxCoeff(), 1e-6) << curves.name << " " << level;
        }
      }
    }
  }
}

TEST(MotionSpace, levels_of_a_set_take_numbers_by_its_pace) {
  const Skeleton& skeleton = sample_clips()[0].skeleton;
  MotionSpace set(skeleton, {.functions = 9, .pinned = true, .cycles = 3, .pace = 2.5}, 40);
  std::vector<SampleMatrix> samples;
  for (int i = 0; i < 20; ++i) {
    SampleMatrix& m = samples.emplace_back(40, set.curves());
    for (Eigen::Index k = 0; k < m.size(); ++k) m.data()[k] = std::sin(0.1 * static_cast<double>(k * (i + 3)));
  }
  auto moments = set.empty_moments();
  set.accumulate(samples, moments);
  set.fit(std::move(moments));
  ASSERT_EQ(set.rows(), 11) << "two ends and nine functions";
  EXPECT_EQ(set.rows_at(0), 2) << "the ends alone";
  EXPECT_EQ(set.rows_at(1), 4) << "2.5 numbers a curve, rounded up, one of them the end that neighbours share";
  EXPECT_EQ(set.rows_at(2), 6);
  EXPECT_EQ(set.rows_at(-1), 11);
  EXPECT_EQ(set.levels(), 4);
  EXPECT_EQ(set.rows_at(4), 11);
}

TEST(MotionSpace, building_from_two_halves_and_merging_equals_building_from_all) {
  const MotionSpace& space = sample_space().space.plain();
  std::vector<SampleMatrix> samples;
  for (const PreparedClip& clip : prepared_samples()) {
    SampleMatrix values = clip.curves.values;
    space.apply_references(values);
    const RunSampler sampler(values, clip.runs[0], clip.curves.rate_hz);
    samples.push_back(sampler.sample(clip.runs[0].first_frame(0), clip.runs[0].last_frame(0), Warp(), space.points()));
  }
  auto all = space.empty_moments();
  space.accumulate(samples, all);
  auto first = space.empty_moments();
  auto second = space.empty_moments();
  const std::size_t half = samples.size() / 2;
  space.accumulate(std::span(samples).first(half), first);
  space.accumulate(std::span(samples).subspan(half), second);
  first[0].merge(second[0]);
  EXPECT_LT((first[0].mean() - all[0].mean()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((first[0].scatter() - all[0].scatter()).norm(), 1e-10 * all[0].scatter().norm());
}

TEST(MotionSpace, every_grouping_gives_clips_back) {
  for (const Grouping grouping : {Grouping::per_component, Grouping::per_joint_component}) {
    SpaceBuildOptions options;
    options.space.grouping = grouping;
    const BuiltSpace built = build_space(source_of(prepared_samples()), options);
    EXPECT_GT(built.space.function_count(), sample_space().space.function_count());
    EXPECT_LT(compare(sample_clips()[2], decode_sample(built, 2, -1)).mean_joint_error_cm, 0.2);
  }
}

// What `build --smooth` makes of a noisy library: 2 degrees at every joint and half a millimetre at the root.
TEST(MotionSpace, a_smoothed_space_gives_back_noisy_clips_nearer_to_the_truth) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::vector<PreparedClip> noisy;
  for (const PreparedClip& clip : prepared_samples()) {
    PreparedClip& copy = noisy.emplace_back(clip);
    SampleMatrix& values = copy.curves.values;
    for (Eigen::Index f = 0; f < values.rows(); ++f) {
      for (Eigen::Index c = 0; c < values.cols(); ++c) values(f, c) += (c < 3 ? 0.0005 : 0.0175) * normal(random);
    }
  }
  SpaceBuildOptions options;
  options.align = false;
  options.space.smooth = true;
  for (const Grouping grouping : {Grouping::all_together, Grouping::per_component}) {
    options.space.grouping = grouping;
    const BuiltSpace built = build_space(source_of(noisy), options);
    double expected = 0, integrated = 0, noise = 0;
    for (std::size_t i = 0; i < noisy.size(); ++i) {
      SampleMatrix curves = noisy[i].curves.values, truth = prepared_samples()[i].curves.values;
      built.space.apply_references(curves);
      built.space.apply_references(truth);
      for (const kinespace::Run& run : built.runs_of(static_cast<int>(i), noisy[i].runs)) {
        const RunSampler of_noisy(curves, run, noisy[i].curves.rate_hz), of_truth(truth, run, noisy[i].curves.rate_hz);
        for (int k = 0; k < run.sequence_count(); ++k) {
          const MotionSpace& set = built.space.of(run.cycles_of(k));
          ASSERT_TRUE(set.groups().front().noise.has_value());
          const auto sample = [&](const RunSampler& sampler) {
            return sampler.sample(run.first_frame(k), run.last_frame(k), Warp(), set.points());
          };
          const SampleMatrix y = sample(of_noisy), wanted = sample(of_truth);
          const Eigen::VectorXd w = trapezoid_weights(set.points(), 1.0);
          SampleMatrix by_integrals(y.rows(), y.cols());
          for (int c = 0; c < set.curves(); ++c) {
            const FunctionGroup& g = set.groups()[static_cast<std::size_t>(set.group_of(c))];
            const Eigen::VectorXd weighted = w.cwiseProduct(y.col(c) - g.mean);
            by_integrals.col(c) = g.mean + g.functions * (g.functions.transpose() * weighted);
          }
          const Eigen::Index rotations = y.cols() - 3;
          expected += (set.samples(set.scores(y)) - wanted).rightCols(rotations).squaredNorm();
          noise += (y - wanted).rightCols(rotations).squaredNorm();
          integrated += (by_integrals - wanted).rightCols(rotations).squaredNorm();
        }
      }
    }
    RecordProperty(grouping == Grouping::all_together ? "expected_all" : "expected_component",
                   std::to_string(expected));
    RecordProperty(grouping == Grouping::all_together ? "integrated_all" : "integrated_component",
                   std::to_string(integrated));
    // Functions shared by all curves have variances far above the noise of any, and so little to shrink.
    EXPECT_LT(expected, (grouping == Grouping::all_together ? 1.01 : 0.7) * integrated);
    EXPECT_LT(expected, 0.5 * noise);
    const RegisteredSpace again = unpack_registered_space(pack_space(built.space), "a smoothed space");
    EXPECT_EQ(again.plain().groups().front().conditional, built.space.plain().groups().front().conditional);
    EXPECT_EQ(pack_space(again), pack_space(built.space));
  }
}

TEST(MotionSpace, the_result_does_not_depend_on_threads) {
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  const BuiltSpace alone = build_space(source_of(prepared_samples()), {});
  EXPECT_EQ(pack_space(alone.space), pack_space(sample_space().space));
}

TEST(MotionSpace, clips_of_two_trees_are_refused_with_both_names) {
  std::vector<PreparedClip> clips{prepared_samples()[0], prepared_samples()[1]};
  clips[1].skeleton.joints.back().name = "another";
  try {
    static_cast<void>(build_space(source_of(clips), {}));
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_NE(std::string(error.what()).find(clips[0].curves.name), std::string::npos);
    EXPECT_NE(std::string(error.what()).find(clips[1].curves.name), std::string::npos);
  }
}

TEST(MotionSpace, other_bone_lengths_are_fine) {
  std::vector<PreparedClip> clips{prepared_samples()[0], prepared_samples()[1]};
  for (Joint& joint : clips[1].skeleton.joints) joint.offset *= 1.1;
  EXPECT_NO_THROW(static_cast<void>(build_space(source_of(clips), {})));
}

TEST(MotionSpace, short_and_constant_clips_can_be_encoded) {
  std::vector<PreparedClip> clips = prepared_samples();
  for (const int frames : {1, 2, 3}) clips.push_back(prepare(slice(sample_clips()[0], 0, frames)));
  clips.push_back(prepare(make_clip("rest", sample_clips()[0].skeleton, 60, 200)));
  const BuiltSpace built = build_space(source_of(clips), {});
  for (std::size_t i = prepared_samples().size(); i < clips.size(); ++i) {
    ClipCurves curves = clips[i].curves;
    built.space.apply_references(curves.values);
    const ClipCurves decoded = decode(
        built.space, encode(built.space, curves, built.runs_of(static_cast<int>(i), clips[i].runs), built.warps[i]));
    EXPECT_LT((decoded.values - curves.values).cwiseAbs().maxCoeff(), 0.01) << i;
  }
}

TEST(MotionSpace, alignment_lowers_what_the_first_functions_leave) {
  SpaceBuildOptions options;
  options.alignment.on_trial = false;
  const BuiltSpace aligned = build_space(source_of(prepared_samples()), options);
  options.align = false;
  const BuiltSpace plain = build_space(source_of(prepared_samples()), options);
  const auto left = [](const RegisteredSpace& space, int n) {
    const FunctionGroup& g = space.plain().groups().front();
    return g.left + g.eigenvalues.tail(g.eigenvalues.size() - n).sum();
  };
  EXPECT_TRUE(aligned.space.warped());
  EXPECT_LT(left(aligned.space, 10), left(plain.space, 10));
}

TEST(MotionSpace, warps_that_win_nothing_on_held_out_clips_are_not_kept) {
  // Bodies at rest, each in another pose: there is no timing to align.
  std::vector<PreparedClip> clips;
  for (int i = 0; i < 20; ++i) {
    const Clip& moving = sample_clips()[static_cast<std::size_t>(i) % sample_clips().size()];
    const PreparedClip pose = prepare(slice(moving, i, 1));
    PreparedClip clip = prepare(make_clip("rest", moving.skeleton, 60, 60));
    clip.curves.name = "rest " + std::to_string(i);
    for (Eigen::Index f = 0; f < 60; ++f) clip.curves.values.row(f) = pose.curves.values.row(0);
    clips.push_back(std::move(clip));
  }
  EXPECT_FALSE(build_space(source_of(clips), {}).space.warped());
}

TEST(MotionSpace, an_opencl_device_finds_the_same_functions_and_scores) {
  KINESPACE_REQUIRE_OPENCL();
  const Compute device = Compute::open("opencl");
  SpaceBuildOptions options;
  options.align = false;
  options.space.functions = 8;
  const BuiltSpace here = build_space(source_of(prepared_samples()), options);
  const BuiltSpace there = build_space(source_of(prepared_samples()), options, device);
  const auto& a = here.space.plain().groups().front();
  const auto& b = there.space.plain().groups().front();
  EXPECT_LT((a.functions - b.functions).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT((a.eigenvalues - b.eigenvalues).cwiseAbs().maxCoeff(), 1e-5 * a.eigenvalues(0));
  ClipCurves curves = prepared_samples()[0].curves;
  here.space.apply_references(curves.values);
  const auto runs = here.runs_of(0, prepared_samples()[0].runs);
  const EncodedClip cpu = encode(here.space, curves, runs);
  const EncodedClip gpu = encode(here.space, curves, runs, {}, device);
  EXPECT_LT((cpu.runs[0].sequences[0].scores - gpu.runs[0].sequences[0].scores).cwiseAbs().maxCoeff(), 1e-4);
}

// The largest difference of a score between clips that are encoded together, where `compute` says, and alone.
float difference_of_encoding_together(Grouping grouping, const Compute& compute) {
  SpaceBuildOptions options;
  options.align = false;
  options.space.grouping = grouping;
  options.space.pinned = grouping == Grouping::all_together;
  const BuiltSpace built = build_space(source_of(prepared_samples()), options);
  std::vector<ClipCurves> curves;
  for (const PreparedClip& clip : prepared_samples()) curves.push_back(clip.curves);
  std::vector<ClipToEncode> together;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    built.space.apply_references(curves[i].values);
    together.push_back({&curves[i], built.runs_of(static_cast<int>(i), prepared_samples()[i].runs), {}});
  }
  const std::vector<EncodedClip> found = encode(built.space, together, compute);
  float worst = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const EncodedClip alone = encode(built.space, curves[i], together[i].runs);
    EXPECT_EQ(found[i].sequence_count(), alone.sequence_count());
    for (std::size_t r = 0; r < alone.runs.size(); ++r) {
      for (std::size_t s = 0; s < alone.runs[r].sequences.size(); ++s) {
        const ScoreMatrix& a = alone.runs[r].sequences[s].scores;
        const ScoreMatrix& b = found[i].runs[r].sequences[s].scores;
        EXPECT_EQ(a.rows(), b.rows());
        worst = std::max(worst, (a - b).cwiseAbs().maxCoeff());
      }
    }
  }
  return worst;
}

TEST(MotionSpace, clips_encoded_together_are_those_encoded_alone) {
  for (const Grouping grouping : {Grouping::all_together, Grouping::per_component}) {
    EXPECT_EQ(difference_of_encoding_together(grouping, Compute::open("cpu")), 0);
  }
}

TEST(MotionSpace, clips_encoded_together_on_a_device_are_those_encoded_alone) {
  KINESPACE_REQUIRE_OPENCL();
  for (const Grouping grouping : {Grouping::all_together, Grouping::per_component}) {
    const Compute device = Compute::open("opencl");
    EXPECT_LT(difference_of_encoding_together(grouping, device), 1e-4F);
    EXPECT_GT(device.uses()[static_cast<std::size_t>(KernelFamily::projection)].launches, 0U);
    EXPECT_EQ(device.uses()[static_cast<std::size_t>(KernelFamily::projection)].processor_calls, 0U);
  }
}

TEST(MotionSpace, smoothing_runs_on_the_device_and_finds_the_same) {
  KINESPACE_REQUIRE_OPENCL();
  const CurveMatrix curves = test::sample_curves(200, 70, 0.1);
  const FpcaOptions options{
      .mean = MeanEstimate::smooth, .smooth_covariance = true, .estimate_noise = true, .count = 5};
  const Compute device = Compute::open("opencl");
  const FunctionalPca here = fit_functional_pca(curves, options);
  const FunctionalPca there = fit_functional_pca(curves, options, {}, device);
  const KernelUse use = device.uses()[static_cast<std::size_t>(KernelFamily::local_linear)];
  EXPECT_GE(use.launches, 5U) << "mean, diagonal and the three of the surface";
  EXPECT_EQ(use.processor_calls, 0U);
  const bool fp64 = device.device_info()->fp64;  // NOLINT(bugprone-unchecked-optional-access): it is open
  const double tolerance = fp64 ? 1e-9 : 1e-3;
  EXPECT_LT((here.covariance - there.covariance).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_LT((here.mean - there.mean).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_LT((here.functions - there.functions).cwiseAbs().maxCoeff(), 10 * tolerance);
  EXPECT_NEAR(*here.noise_variance, *there.noise_variance, tolerance);
}

TEST(SpaceCodec, a_space_comes_back_bit_for_bit) {
  const Bytes bytes = pack_space(sample_space().space);
  const RegisteredSpace back = unpack_registered_space(bytes, "test");
  EXPECT_EQ(pack_space(back), bytes);
}

TEST(SpaceCodec, rounding_to_what_is_stored_is_what_storing_does) {
  EncodedClip clip = encode_sample(sample_space(), 0);
  const PackedClip packed = pack_clip(clip, sample_space().space);
  const EncodedClip back = unpack_clip(packed, sample_space().space, sample_clips()[0].skeleton, clip, "test");
  round_to_stored(clip, sample_space().space);
  for (std::size_t r = 0; r < clip.runs.size(); ++r) {
    for (std::size_t i = 0; i < clip.runs[r].sequences.size(); ++i) {
      EXPECT_EQ(clip.runs[r].sequences[i].scores, back.runs[r].sequences[i].scores);
    }
  }
  EXPECT_EQ(pack_clip(clip, sample_space().space).vectors, packed.vectors) << "and so is storing it again";
}

TEST(MotionSpace, decoding_in_parts_hands_over_every_frame_once) {
  const EncodedClip clip = encode_sample(sample_space(), 1);
  const ClipCurves whole = decode(sample_space().space, clip);
  int next = 0;
  decode_in_parts(sample_space().space, clip, -1, {}, [&](int first, const Eigen::Ref<const SampleMatrix>& rows) {
    EXPECT_EQ(first, next);
    EXPECT_EQ(rows, whole.values.middleRows(first, rows.rows()));
    next = first + static_cast<int>(rows.rows());
  });
  EXPECT_EQ(next, clip.frames);
}

TEST(SpaceCodec, a_clip_comes_back_within_half_a_step_of_each_score) {
  const EncodedClip clip = encode_sample(sample_space(), 0);
  const PackedClip packed = pack_clip(clip, sample_space().space);
  const EncodedClip back = unpack_clip(packed, sample_space().space, sample_clips()[0].skeleton, clip, "test");
  ASSERT_EQ(back.sequence_count(), clip.sequence_count());
  for (std::size_t i = 0; i < clip.runs[0].sequences.size(); ++i) {
    const auto& a = clip.runs[0].sequences[i];
    const auto& b = back.runs[0].sequences[i];
    EXPECT_EQ(a.warp.coefficients(), b.warp.coefficients());
    EXPECT_LT((a.scores - b.scores).cwiseAbs().maxCoeff(), 0.51 * score_step);
  }
}

TEST(SpaceCodec, a_stream_that_was_cut_is_a_coarser_clip) {
  const EncodedClip clip = encode_sample(sample_space(), 0);
  PackedClip packed = pack_clip(clip, sample_space().space);
  const Bytes whole = packed.vectors;
  int coarser = 0;
  for (std::size_t n = 0; n < whole.size(); n += 37) {
    packed.vectors.assign(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
    try {
      const EncodedClip back = unpack_clip(packed, sample_space().space, sample_clips()[0].skeleton, clip, "test");
      EXPECT_EQ(back.frames, clip.frames);
      ++coarser;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    }
  }
  EXPECT_GT(coarser, 10);
}

TEST(SpaceCodec, flipped_bytes_are_errors_or_valid_clips) {
  const EncodedClip clip = encode_sample(sample_space(), 0);
  const PackedClip packed = pack_clip(clip, sample_space().space);
  for (Bytes PackedClip::*part : {&PackedClip::vectors, &PackedClip::warps, &PackedClip::side}) {
    for (std::size_t i = 0; i < (packed.*part).size(); i += 11) {
      PackedClip damaged = packed;
      (damaged.*part)[i] ^= std::byte{0x41};
      try {
        EXPECT_EQ(unpack_clip(damaged, sample_space().space, sample_clips()[0].skeleton, clip, "test").frames,
                  clip.frames);
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      }
    }
  }
}

// One spline over the whole run, which is what a long run's parts stand for.
SampleMatrix sampled_from_one_spline(const SampleMatrix& values, double rate_hz, int first, int last, int points) {
  const UniformSpline spline(values);
  SampleMatrix out(points, values.cols());
  for (int i = 0; i < points; ++i) {
    const double x = first + Warp().own_time(static_cast<double>(i) / (points - 1)) * (last - first);
    spline.value(x, out.row(i));
    spline.derivative(x, out.row(i).head<3>());
    out.row(i).head<3>() *= rate_hz;
  }
  return out;
}

TEST(RunSampler, samples_a_long_run_as_one_spline_would) {
  constexpr int frames = 12'000;
  SampleMatrix values(frames, 7);
  for (int f = 0; f < frames; ++f) {
    for (int c = 0; c < 7; ++c) values(f, c) = std::sin(0.01 * (c + 1) * f) + ((7 * f + c) % 11) * 0.1;
  }
  const RunSampler sampler(values, kinespace::Run{{0, frames - 1}}, 120);
  for (const auto& [first, last] :
       {std::pair(0, 110), {5, 130}, {6000, 6100}, {frames - 120, frames - 1}, {0, frames - 1}}) {
    const SampleMatrix wanted = sampled_from_one_spline(values, 120, first, last, 64);
    EXPECT_LT((sampler.sample(first, last, Warp(), 64) - wanted).cwiseAbs().maxCoeff(), 1e-9) << first << " " << last;
  }
}

}  // namespace
}  // namespace kinespace
