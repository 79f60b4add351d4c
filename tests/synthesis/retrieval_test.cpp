#include "kinespace/synthesis/retrieval.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/kernels/detail/dtw.h"
#include "tests/support/data.h"
#include "tests/support/library_folder.h"
#include "tests/support/opencl_device.h"

namespace kinespace {
namespace {

// The clip played `speed` times as fast, at its own rate.
Clip at_speed(const Clip& clip, double speed) {
  const int frames = static_cast<int>(std::lround((clip.frames - 1) / speed)) + 1;
  Clip out = make_clip(clip.name, clip.skeleton, clip.rate_hz, frames);
  auto& track = out.require_translation_track(0).values;
  for (int f = 0; f < frames; ++f) {
    const double x = std::min<double>(f * speed, clip.frames - 1);
    const int i = std::min(static_cast<int>(x), clip.frames - 2);
    const double b = x - i;
    track[static_cast<std::size_t>(f)] = (1 - b) * clip.translation(0, i) + b * clip.translation(0, i + 1);
    for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
      out.set_rotation(j, f, clip.rotation(j, i).slerp(b, clip.rotation(j, i + 1)));
    }
  }
  return out;
}

class Retrieval : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::LibraryFolder>();
    static_cast<void>(folder_->build());
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::unique_ptr<test::LibraryFolder> folder_;
};
std::unique_ptr<test::LibraryFolder> Retrieval::folder_;

TEST_F(Retrieval, a_clip_from_its_file_finds_itself) {
  LibraryView view(folder_->library());
  for (const ClipRow& row : view.library().clips()) {
    const auto matches = nearest_motions(view, read_clip(row.source), {.k = 1});
    ASSERT_EQ(matches.size(), 1U);
    EXPECT_EQ(matches[0].clip, row.name);
  }
}

TEST_F(Retrieval, a_slower_and_a_faster_copy_find_the_original) {
  LibraryView view(folder_->library());
  for (const ClipRow& row : view.library().clips()) {
    for (const double speed : {0.8, 1.25}) {
      for (const bool rerank : {true, false}) {
        const auto matches = nearest_motions(view, at_speed(read_clip(row.source), speed), {.k = 1, .rerank = rerank});
        ASSERT_EQ(matches.size(), 1U);
        EXPECT_EQ(matches[0].clip, row.name) << "at " << speed;
      }
    }
  }
}

TEST_F(Retrieval, the_list_of_vectors_equals_brute_force) {
  LibraryView view(folder_->library());
  const ClipRow query = view.library().clips().front();
  const auto matches = nearest_motions(view, view.curves(query), view.skeleton(query.skeleton_id),
                                       {.k = 5, .rerank = false}, query.name);
  const auto wanted = view.clip_space(query.space_id).vector_of(view.curves(query));
  std::vector<std::pair<double, std::string>> all;
  for (const ClipRow& row : view.library().clips()) {
    if (row.id == query.id) continue;
    all.emplace_back(squared_distance(wanted, view.library().retrieval_vector(row.id), {}), row.name);
  }
  std::ranges::sort(all);
  ASSERT_EQ(matches.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(matches[i].clip, all[i].second);
    EXPECT_NEAR(matches[i].distance * matches[i].distance, all[i].first, 1e-9 + 1e-6 * all[i].first);
  }
}

TEST_F(Retrieval, a_device_leaves_the_list_as_it_is) {
  KINESPACE_REQUIRE_OPENCL();
  LibraryView view(folder_->library());
  const Compute device = Compute::open("opencl");
  for (const ClipRow& row : view.library().clips()) {
    for (const bool weighted : {false, true}) {
      const QueryOptions options{.k = 3, .rerank = false, .weighted = weighted};
      const Clip clip = at_speed(read_clip(row.source), 1.1);
      const auto here = nearest_motions(view, clip, options);
      const auto there = nearest_motions(view, clip, options, {}, device);
      ASSERT_EQ(here.size(), there.size());
      for (std::size_t i = 0; i < here.size(); ++i) {
        EXPECT_EQ(here[i].clip, there[i].clip);
        EXPECT_NEAR(here[i].distance, there[i].distance, 1e-4 * here[i].distance + 1e-5);  // the query's own vector
      }
    }
  }
  EXPECT_GT(device.uses()[static_cast<std::size_t>(KernelFamily::keyframe_distances)].launches, 0U);
}

TEST_F(Retrieval, labels_and_the_query_itself_are_left_out) {
  LibraryView view(folder_->library());
  const ClipRow query = view.library().clips().front();
  const auto matches = nearest_motions(view, view.curves(query), view.skeleton(query.skeleton_id),
                                       {.k = 100, .labels = {query.labels.front()}}, query.name);
  EXPECT_FALSE(matches.empty());
  for (const Match& match : matches) {
    EXPECT_NE(match.clip, query.name);
    EXPECT_EQ(match.labels.front(), query.labels.front());
  }
}

TEST_F(Retrieval, weights_change_distances_and_keep_the_nearest) {
  LibraryView view(folder_->library());
  const ClipRow row = view.library().clips().front();
  const auto matches = nearest_motions(view, read_clip(row.source), {.k = 1, .rerank = false, .weighted = true});
  EXPECT_EQ(matches.at(0).clip, row.name);
}

TEST_F(Retrieval, another_skeleton_has_no_matches) {
  LibraryView view(folder_->library());
  Clip stranger = make_clip("stranger", sample_skeleton(), 30, 40);
  stranger.skeleton.joints.back().name = "other";
  EXPECT_TRUE(nearest_motions(view, stranger).empty());
}

TEST_F(Retrieval, a_wrong_name_brings_the_nearest_one) {
  const LibraryView view(folder_->library());
  const std::string name = view.library().clips().front().name;
  try {
    static_cast<void>(view.require_clip(name + "x"));
    FAIL() << "found";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_NE(std::string(error.what()).find('"' + name + '"'), std::string::npos);
  }
}

// Keyframes are taken at 30 Hz.
double rerank_cells(int frames, double rate_hz) {
  const RerankClip clip{frames, static_cast<int>(frames * 30 / rate_hz)};
  const auto region = dtw_detail::region_of(clip.keyframes, clip.keyframes,
                                            {.band_fraction = rerank_band(QueryOptions{}.band, clip, clip)});
  double cells = 0;
  for (int j = 0; j < clip.keyframes; ++j) cells += static_cast<double>(region.end_row(j) - region.first_row(j));
  return cells;
}

TEST(Rerank, takes_at_most_fourteen_times_the_cells_for_clips_that_are_ten_times_as_long) {
  for (const double rate : {30.0, 60.0, 120.0}) {
    for (const int frames : {10'000, 50'000, 100'000}) {
      EXPECT_LE(rerank_cells(10 * frames, rate), 14 * rerank_cells(frames, rate)) << frames << " at " << rate;
    }
  }
}

TEST(Rerank, leaves_the_band_of_ordinary_clips_and_of_short_partners_as_it_is) {
  EXPECT_EQ(rerank_band(0.1, {10'000, 10'000}, {10'000, 10'000}), 0.1);
  EXPECT_EQ(rerank_band(0.1, {100'000, 25'000}, {200, 50}), 0.1);
  EXPECT_LT(rerank_band(0.1, {100'000, 25'000}, {100'000, 25'000}), 0.1);
  EXPECT_GE(rerank_band(0.1, {10'000'000, 2'500'000}, {10'000'000, 2'500'000}) * 2'500'000, 99);
}

TEST(QueryOptions, out_of_range_is_refused) {
  EXPECT_THROW(QueryOptions{.k = 0}.validate(), Error);
  EXPECT_THROW(QueryOptions{.band = 0}.validate(), Error);
}

}  // namespace
}  // namespace kinespace
