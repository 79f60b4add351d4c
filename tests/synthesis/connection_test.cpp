#include "kinespace/synthesis/connection.h"

#include <cmath>

#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/functional_pca.h"
#include "kinespace/library/library_view.h"
#include "kinespace/synthesis/detail/graph_bridges.h"
#include "tests/support/library_folder.h"

namespace kinespace {
namespace {

class Connections : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::LibraryFolder>();
    static_cast<void>(folder_->build());
    view_ = std::make_unique<LibraryView>(folder_->library());
    space_ = std::make_unique<ConnectionSpace>(view_->space(view_->library().spaces().front().id));
    for (const ClipRow& row : view_->library().clips()) {
      const ClipCurves curves = view_->curves(row);
      ends_.push_back(space_->end_of(curves));
      starts_.push_back(space_->start_of(curves));
    }
  }
  static void TearDownTestSuite() {
    ends_.clear();
    starts_.clear();
    space_.reset();
    view_.reset();
    folder_.reset();
  }
  static std::unique_ptr<test::LibraryFolder> folder_;
  static std::unique_ptr<LibraryView> view_;
  static std::unique_ptr<ConnectionSpace> space_;
  static std::vector<ConnectionMotion> ends_, starts_;
};
std::unique_ptr<test::LibraryFolder> Connections::folder_;
std::unique_ptr<LibraryView> Connections::view_;
std::unique_ptr<ConnectionSpace> Connections::space_;
std::vector<ConnectionMotion> Connections::ends_, Connections::starts_;

TEST_F(Connections, the_functions_are_orthonormal) {
  const SampleMatrix& f = space_->functions();
  const Eigen::VectorXd weights = trapezoid_weights(static_cast<int>(f.rows()), 1);
  const Eigen::MatrixXd gram = f.transpose() * weights.asDiagonal() * f;
  EXPECT_LT((gram - Eigen::MatrixXd::Identity(f.cols(), f.cols())).norm(), 1e-9);
}

TEST_F(Connections, the_optimum_agrees_with_brute_force) {
  int pairs = 0, within = 0;
  for (std::size_t i = 0; i < ends_.size(); i += 5) {
    for (std::size_t k = 1; k < starts_.size(); k += 7) {
      const auto found = space_->connect(ends_[i], starts_[k]);
      const auto wanted = reference::connect(*space_, ends_[i], starts_[k], 33, 120);
      ASSERT_EQ(found.has_value(), wanted.has_value());
      if (!found) continue;
      ++pairs;
      within += std::pow(found->cost_cm / wanted->cost_cm, 2) <= 1.01 ? 1 : 0;
    }
  }
  ASSERT_GE(pairs, 20);
  EXPECT_EQ(within, pairs);
}

TEST_F(Connections, the_cost_is_that_of_the_place_found) {
  const auto found = space_->connect(ends_[0], starts_[3]);
  ASSERT_TRUE(found);
  EXPECT_NEAR(100 * std::sqrt(space_->cost(ends_[0], starts_[3], found->scale, found->shift)), found->cost_cm, 1e-6);
}

TEST_F(Connections, every_answer_is_legal) {
  for (std::size_t i = 0; i < ends_.size(); ++i) {
    for (const double shortest : {0.3, 0.45}) {
      const auto found = space_->connect(ends_[i], starts_[(i + 5) % starts_.size()], shortest);
      if (!found) continue;
      EXPECT_GE(found->speed(), 0.5 - 1e-6);
      EXPECT_LE(found->speed(), 2 + 1e-6);
      EXPECT_GE(found->left_s - found->leave_s, shortest - 1e-6);
      EXPECT_GE(found->entered_s - found->enter_s, shortest - 1e-6);
      EXPECT_GE(found->leave_s, ends_[i].start_s - 1e-9);
      EXPECT_LE(found->left_s, ends_[i].start_s + ends_[i].length_s + 1e-9);
    }
  }
}

TEST_F(Connections, an_illegal_place_costs_infinity) {
  EXPECT_TRUE(std::isinf(space_->cost(ends_[0], starts_[0], 1, 0.99)));
  EXPECT_TRUE(std::isinf(space_->cost(ends_[0], starts_[0], -1, 0)));
}

TEST_F(Connections, a_rigid_motion_in_the_ground_plane_changes_nothing) {
  const ClipRow row = view_->library().clips().front();
  ClipCurves moved = view_->curves(row);
  const GroundMotion motion{.turn_rad = 1.1, .x_m = 3, .z_m = -2};
  for (Eigen::Index f = 0; f < moved.values.rows(); ++f) motion.apply(moved.values.row(f));
  const ConnectionMotion end = space_->end_of(moved);
  EXPECT_LT((end.scores - ends_.front().scores).norm(), 1e-4 * ends_.front().scores.norm());
}

TEST_F(Connections, a_motion_cut_in_two_is_joined_where_it_was_cut) {
  // The two halves share 0.5 s: the best connection lays these over each other.
  const ClipRow row = view_->require_clip("walk_normal_001");
  const Clip whole = view_->clip(row);
  const int half = whole.frames / 2, shared = static_cast<int>(std::lround(whole.rate_hz / 2));
  auto first = clip_curves(slice(whole, 0, half + shared)),
       second = clip_curves(slice(whole, half, whole.frames - half));
  view_->space(row.space_id).apply_references(first.values);
  view_->space(row.space_id).apply_references(second.values);
  const auto found = space_->connect(space_->end_of(first), space_->start_of(second), 0.4);
  ASSERT_TRUE(found);
  EXPECT_LT(found->cost_cm, 1.5);
  EXPECT_NEAR(found->speed(), 1, 0.05);
  EXPECT_NEAR(found->leave_s - found->enter_s, half / whole.rate_hz, 0.05);
}

TEST_F(Connections, no_connection_is_below_its_bound) {
  std::vector<const ConnectionMotion*> ends, starts;
  for (const auto& motion : ends_) ends.push_back(&motion);
  for (const auto& motion : starts_) starts.push_back(&motion);
  const ConnectionBounds bounds(space_->options(), ends, starts);
  double tightest = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    for (std::size_t k = 0; k < starts.size(); ++k) {
      const auto found = space_->connect(ends_[i], starts_[k]);
      if (!found) continue;
      EXPECT_LE(bounds.cm(i, k), found->cost_cm);
      tightest = std::max(tightest, bounds.cm(i, k) / found->cost_cm);
    }
  }
  EXPECT_GT(tightest, 0.3);  // a bound of zero would be true as well
}

TEST_F(Connections, a_clip_that_is_too_short_has_no_end) {
  EXPECT_FALSE(space_->long_enough(0.5));
  EXPECT_TRUE(space_->long_enough(0.6));
}

TEST(ConnectionOptionsTest, name_field_and_range) {
  EXPECT_THROW((ConnectionOptions{.shortest_s = 3}.validate()), Error);
  EXPECT_THROW((ConnectionOptions{.functions = 3}.validate()), Error);
  EXPECT_THROW((ConnectionOptions{.window_s = 0}.validate()), Error);
  EXPECT_NO_THROW(ConnectionOptions{}.validate());
}

TEST(StrongComponents, are_the_circles_of_a_graph) {
  const std::vector<std::pair<std::size_t, std::size_t>> arrows{{0, 1}, {1, 2}, {2, 0}, {2, 3}, {3, 4}, {4, 3}};
  const auto component = strong_components(6, arrows);
  EXPECT_EQ(component[0], component[1]);
  EXPECT_EQ(component[1], component[2]);
  EXPECT_EQ(component[3], component[4]);
  EXPECT_NE(component[0], component[3]);
  EXPECT_NE(component[5], component[0]);
  EXPECT_NE(component[5], component[3]);
}

}  // namespace
}  // namespace kinespace
