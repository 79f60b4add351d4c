#include "kinespace/synthesis/motion_graph.h"

#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/synthesis/detail/graph_ways.h"
#include "kinespace/synthesis/transition_plan.h"
#include "tests/support/library_folder.h"

namespace kinespace {
namespace {

class Graph : public ::testing::Test {
 protected:
  void SetUp() override { static_cast<void>(folder_.build()); }
  test::LibraryFolder folder_;
};

TEST_F(Graph, the_best_ways_are_those_of_brute_force) {
  LibraryView view(folder_.library());
  const std::int64_t space_id = view.library().spaces().front().id;
  const MotionGraph graph = MotionGraph::make(view, space_id, {});
  const ConnectionSpace space(view.space(space_id), graph.functions(), graph.options().connection);
  std::map<std::int64_t, ConnectionMotion> ends, starts;
  for (const std::int64_t id : graph.clips()) {
    const ClipCurves curves = view.curves(view.library().clip(id));
    ends[id] = space.end_of(curves);
    starts[id] = space.start_of(curves);
  }
  for (const std::int64_t from : graph.clips()) {
    std::vector<std::pair<double, std::int64_t>> all;
    for (const std::int64_t to : graph.clips()) {
      if (to == from) continue;
      const auto connection = space.connect(ends[from], starts[to]);
      if (connection && connection->cost_cm <= graph.options().largest_cost_cm)
        all.emplace_back(connection->cost_cm, to);
    }
    std::ranges::sort(all);
    all.resize(std::min<std::size_t>(all.size(), 4));
    for (const auto& [cost, to] : all) {
      const bool kept = std::ranges::any_of(graph.arrows(), [&](const GraphArrow& arrow) {
        return arrow.from == from && arrow.to == to && arrow.kind == GraphArrow::Kind::connection &&
               std::abs(arrow.cost_cm - cost) < 1e-9;
      });
      EXPECT_TRUE(kept) << from << " to " << to;
    }
  }
}

TEST_F(Graph, survives_the_file_and_is_not_made_twice) {
  LibraryView view(folder_.library());
  const std::int64_t space_id = view.library().spaces().front().id;
  bool changed = false;
  const MotionGraph made = MotionGraph::of(view, space_id, {}, {}, &changed);
  EXPECT_TRUE(changed);
  {
    Library library = Library::open(folder_.library());
    made.save(library);
  }
  const MotionGraph kept = MotionGraph::of(view, space_id, {}, {}, &changed);
  EXPECT_FALSE(changed);
  EXPECT_EQ(kept.arrows(), made.arrows());
}

TEST_F(Graph, takes_in_clips_that_were_added) {
  {
    LibraryView view(folder_.library());
    Library library = Library::open(folder_.library());
    MotionGraph::of(view, view.library().spaces().front().id, {}).save(library);
  }
  const auto motion = make_walk({.speed_m_s = 1.2, .take = {.seed = 77}});
  write_clip(folder_.clips() / "walk_added_001.bvh", motion.clip);
  static_cast<void>(build_library({folder_.clips() / "walk_added_001.bvh"}, folder_.library(), {.add = true}));

  LibraryView view(folder_.library());
  const std::int64_t space_id = view.library().spaces().front().id;
  const auto added = view.require_clip("walk_added_001").id;
  bool changed = false;
  const MotionGraph graph = MotionGraph::of(view, space_id, {}, {}, &changed);
  EXPECT_TRUE(changed);
  EXPECT_TRUE(std::ranges::binary_search(graph.clips(), added));
  EXPECT_TRUE(graph.path(added, graph.clips().front()));
  EXPECT_TRUE(graph.path(graph.clips().front(), added));
}

TEST_F(Graph, far_motions_are_joined_through_at_least_a_third) {
  LibraryView view(folder_.library());
  const MotionGraph graph = MotionGraph::make(view, view.library().spaces().front().id, {});
  std::size_t longest = 0;
  for (const std::int64_t from : graph.clips()) {
    for (const std::int64_t to : graph.clips()) {
      const auto path = graph.path(from, to);
      ASSERT_TRUE(path);
      EXPECT_EQ(path->clips.front(), from);
      EXPECT_EQ(path->clips.back(), to);
      longest = std::max(longest, path->clips.size());
    }
  }
  EXPECT_GE(longest, 3U);
}

TEST_F(Graph, no_path_is_an_answer) {
  LibraryView view(folder_.library());
  const MotionGraph graph =
      MotionGraph::make(view, view.library().spaces().front().id, {.neighbours = 0, .largest_cost_cm = 1e-6});
  EXPECT_TRUE(graph.arrows().empty());
  EXPECT_FALSE(graph.path(graph.clips()[0], graph.clips()[1]));
  TransitionPlanOptions options{.via_graph = true, .keep_graph = false};
  options.graph = graph.options();
  EXPECT_FALSE(plan_transition(view, std::vector<std::string>{"stand_calm_001", "run_fast_001"}, options));
}

TEST_F(Graph, damaged_bytes_are_an_error_and_never_a_crash) {
  LibraryView view(folder_.library());
  const Bytes whole = MotionGraph::make(view, view.library().spaces().front().id, {}).pack();
  for (std::size_t size = 0; size < whole.size(); size += 1 + size / 7) {
    EXPECT_THROW(static_cast<void>(MotionGraph::unpack(std::span(whole).first(size), "test")), Error) << size;
  }
  for (std::size_t at = 0; at < whole.size(); at += 1 + at / 5) {
    Bytes damaged = whole;
    damaged[at] ^= std::byte{0x81};
    try {
      static_cast<void>(MotionGraph::unpack(damaged, "test"));
    } catch (const Error&) {
      continue;  // as good as a graph with another number in it
    }
  }
}

TEST(SmallGraph, a_library_of_one_clip_has_a_graph_without_arrows) {
  test::TemporaryFolder folder;
  const auto file = folder / "walk_one_001.bvh";
  write_clip(file, make_walk().clip);
  static_cast<void>(build_library({file}, folder / "one.kspace", {}));
  LibraryView view(folder / "one.kspace");
  const MotionGraph graph = MotionGraph::make(view, view.library().spaces().front().id, {});
  EXPECT_EQ(graph.clips().size(), 1U);
  EXPECT_TRUE(graph.arrows().empty());
  const std::vector<std::string> twice{"walk_one_001", "walk_one_001"};
  EXPECT_TRUE(plan_transition(view, twice, {.via_graph = true}));
}

}  // namespace
}  // namespace kinespace
