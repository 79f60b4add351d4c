#include "kinespace/synthesis/windows.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/functional_pca.h"
#include "tests/support/library_folder.h"

namespace kinespace {
namespace {

// Short vectors: quickly made, and enough for the samples.
constexpr WindowOptions small{.functions = 6, .dimensions = 64};

class Windows : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::LibraryFolder>();
    static_cast<void>(folder_->build());
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static ClipRow long_clip(LibraryView& view) {
    auto rows = view.library().clips();
    return *std::ranges::max_element(rows, {}, &ClipRow::frames);
  }
  static std::unique_ptr<test::LibraryFolder> folder_;
};
std::unique_ptr<test::LibraryFolder> Windows::folder_;

// The clip turned about the vertical and moved.
Clip placed_elsewhere(const Clip& clip) {
  ClipCurves curves = clip_curves(clip);
  curves.placement.heading_rad += 2;
  curves.placement.start_cm += Eigen::Vector3d(300, 0, -70);
  return clip_from_curves(curves, clip.skeleton);
}

TEST_F(Windows, a_window_finds_itself_wherever_it_stands_and_looks) {
  LibraryView view(folder_->library());
  int tried = 0;
  const auto index = WindowIndex::build(view, view.library().clips().front().space_id, small);
  for (const ClipRow& row : view.library().clips()) {
    const Clip clip = view.clip(row);
    const double from = 0.4;
    if (clip.duration_s() < from + 1 || ++tried > 6) continue;
    const auto matches = index.nearest(clip_curves(placed_elsewhere(clip)), from, {.k = 1});
    ASSERT_EQ(matches.size(), 1U);
    EXPECT_EQ(matches[0].clip, row.name);
    EXPECT_NEAR(matches[0].start_s, from, 1e-9);
    EXPECT_NEAR(matches[0].end_s, from + 1, 1e-9);
    // The index has the space's own curves; making a clip of them renormalises the quaternions.
    EXPECT_LT(matches[0].distance, 5e-3);
  }
  EXPECT_GT(tried, 3);
}

TEST_F(Windows, the_full_list_is_that_of_all_windows) {
  LibraryView view(folder_->library());
  const ClipRow row = long_clip(view);
  const auto index = WindowIndex::build(view, row.space_id, small);
  const int all = static_cast<int>(index.windows());
  const auto matches = index.nearest(view.curves(row), 0.2, {.k = all + 5, .overlapping = true});
  ASSERT_EQ(std::ssize(matches), all);
  EXPECT_TRUE(std::ranges::is_sorted(matches, {}, &Match::distance));
  std::int64_t expected = 0;
  for (const ClipRow& clip : view.library().clips()) {
    for (const EncodedRun& run : view.encoded(clip).runs) {
      const int frames = run.sequences.back().last - run.sequences.front().first;
      const auto samples = static_cast<std::int64_t>(std::floor(frames / clip.rate_hz * 30 + 1e-6)) + 1;
      expected += std::max<std::int64_t>(0, samples - 30);
    }
  }
  EXPECT_EQ(all, expected);
}

TEST_F(Windows, the_best_stands_for_those_that_overlap_it) {
  LibraryView view(folder_->library());
  const ClipRow row = long_clip(view);
  const auto index = WindowIndex::build(view, row.space_id, small);
  const int all = static_cast<int>(index.windows());
  const ClipCurves curves = view.curves(row);
  const auto full = index.nearest(curves, 0.2, {.k = all, .overlapping = true});
  std::vector<Match> kept;
  for (const Match& match : full) {
    const bool covered = std::ranges::any_of(
        kept, [&](const Match& k) { return k.clip == match.clip && std::abs(k.start_s - match.start_s) < 1 - 1e-6; });
    if (!covered) kept.push_back(match);
  }
  for (const int k : {1, 5, 12, all}) {
    const auto matches = index.nearest(curves, 0.2, {.k = k});
    ASSERT_EQ(matches.size(), std::min<std::size_t>(static_cast<std::size_t>(k), kept.size()));
    for (std::size_t i = 0; i < matches.size(); ++i) {
      EXPECT_EQ(matches[i].clip, kept[i].clip);
      EXPECT_EQ(matches[i].start_s, kept[i].start_s);
    }
  }
}

// The root's quaternions of a window, turned so that the first has heading 0.
Eigen::MatrixXd turned_root(const WindowSamples& samples, Eigen::Index start, Eigen::Index count) {
  const auto at = [&](Eigen::Index i) {
    const Eigen::Vector4d q = samples.row(start + i).segment<4>(3).transpose().cast<double>();
    return Eigen::Quaterniond(q(0), q(1), q(2), q(3));
  };
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(-heading_of(at(0)), Eigen::Vector3d::UnitY()));
  Eigen::MatrixXd out(count, 4);
  for (Eigen::Index i = 0; i < count; ++i) out.row(i) = (turn * at(i)).coeffs().transpose();
  return out;
}

// Nothing left out, the distance of two vectors is the mean squared difference of the two windows' curves.
TEST_F(Windows, distances_are_those_of_the_curves) {
  LibraryView view(folder_->library());
  const auto rows = view.library().clips();
  constexpr int samples = 10;
  const WindowOptions options{.length_s = 0.3, .functions = samples, .dimensions = 4096, .travel_share = 0};
  std::vector<WindowSamples> stretches;
  for (const ClipRow& row : rows) {
    const ClipCurves curves = view.curves(row);
    stretches.push_back(window_samples(curves, 0, curves.frames() - 1, 0, options));
  }
  const MotionSpace& space = view.space(rows.front().space_id).plain();
  const auto windows = WindowSpace::fit(stretches, space.skeleton(), space.references(), options);
  const Eigen::VectorXd weights = trapezoid_weights(samples, 1.0);
  for (const WindowSamples& stretch : stretches) {
    const RowMatrix<float> vectors = windows.vectors(stretch);
    for (const Eigen::Index other : {1, 5, 9}) {
      const Eigen::MatrixXd joints =
          (stretch.topRows(samples) - stretch.middleRows(other, samples)).rightCols(stretch.cols() - 7).cast<double>();
      const Eigen::MatrixXd root = turned_root(stretch, 0, samples);
      const Eigen::MatrixXd root_later = turned_root(stretch, other, samples);
      const double sign = root.cwiseProduct(root_later).sum() < 0 ? -1 : 1;
      const double by_hand = (joints.array().square().colwise() * weights.array()).sum() +
                             ((root - sign * root_later).array().square().colwise() * weights.array()).sum();
      const double squared = static_cast<double>((vectors.row(0) - vectors.row(other)).squaredNorm());
      EXPECT_NEAR(squared, by_hand, 1e-3 * by_hand + 1e-6);
    }
  }
}

TEST_F(Windows, labels_and_what_overlaps_the_query_are_left_out) {
  LibraryView view(folder_->library());
  const ClipRow row = long_clip(view);
  const auto matches =
      nearest_windows(view, view.curves(row), view.skeleton(row.skeleton_id), {.from_s = 0.1},
                      {.k = 1000, .overlapping = true, .labels = {row.labels.front()}}, small, row.name);
  EXPECT_FALSE(matches.empty());
  for (const Match& match : matches) {
    EXPECT_EQ(match.labels.front(), row.labels.front());
    EXPECT_TRUE(match.clip != row.name || std::abs(match.start_s - 0.1) >= 1 - 1e-6);
  }
}

TEST_F(Windows, weights_and_length_are_those_asked_for) {
  LibraryView view(folder_->library());
  const ClipRow row = long_clip(view);
  const auto matches = nearest_windows(view, view.clip(row), {.from_s = 0.2, .to_s = 0.7}, {.k = 3},
                                       {.functions = 6, .dimensions = 64, .weighted = true});
  ASSERT_EQ(matches.size(), 3U);
  EXPECT_EQ(matches[0].clip, row.name);
  for (const Match& match : matches) EXPECT_NEAR(match.end_s - match.start_s, 0.5, 1e-9);
  const auto plain = nearest_windows(view, view.clip(row), {.from_s = 0.2, .to_s = 0.7}, {.k = 3}, small);
  EXPECT_NE(plain[1].distance, matches[1].distance);
}

TEST_F(Windows, a_window_beyond_the_clip_is_refused) {
  LibraryView view(folder_->library());
  const ClipRow row = long_clip(view);
  const Clip clip = view.clip(row);
  for (const TimeRange range :
       {TimeRange{.from_s = clip.duration_s() - 0.5}, TimeRange{.from_s = -0.1}, TimeRange{.from_s = 0.5, .to_s = 0.5},
        TimeRange{.from_s = std::nan("")}, TimeRange{.from_s = 0, .to_s = clip.duration_s() + 1}}) {
    EXPECT_THROW(static_cast<void>(nearest_windows(view, clip, range)), Error);
  }
  EXPECT_THROW(static_cast<void>(nearest_windows(view, slice(clip, 0, 9))), Error);
  EXPECT_THROW(static_cast<void>(WindowIndex::build(view, row.space_id, {.length_s = 20})), Error);
}

TEST_F(Windows, another_skeleton_has_no_matches) {
  LibraryView view(folder_->library());
  Clip stranger = make_clip("stranger", sample_skeleton(), 30, 60);
  stranger.skeleton.joints.back().name = "other";
  EXPECT_TRUE(nearest_windows(view, stranger).empty());
  const auto index = WindowIndex::build(view, view.library().clips().front().space_id, small);
  ClipCurves fewer = clip_curves(stranger);
  fewer.values.conservativeResize(Eigen::NoChange, 7);
  EXPECT_THROW(static_cast<void>(index.nearest(fewer, 0)), Error);
}

TEST(WindowOptions, out_of_range_is_refused) {
  EXPECT_THROW(WindowOptions{.length_s = 0}.validate(), Error);
  EXPECT_THROW((WindowOptions{.length_s = 0.1, .rate_hz = 20}.validate()), Error);
  EXPECT_THROW(WindowOptions{.functions = 0}.validate(), Error);
  EXPECT_THROW(WindowOptions{.dimensions = 0}.validate(), Error);
  EXPECT_THROW(WindowQueryOptions{.k = 0}.validate(), Error);
}

}  // namespace
}  // namespace kinespace
