#include "bench/golden.h"

#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

TEST(Golden, pace_mode_reproduces_every_case_of_the_package) {
  KINESPACE_REQUIRE_FOLDER(root, golden_folder);
  int compared = 0;
  for (const auto& folder : find_golden_cases(root)) {
    const GoldenCase golden = read_golden_case(folder);
    for (const GoldenDifference& d :
         compare_with_golden(golden, fit_functional_pca(golden.curves, golden.options, golden.domain))) {
      EXPECT_LE(d.relative, d.bar) << golden.name << ": " << d.quantity;
      ++compared;
    }
  }
  EXPECT_GE(compared, 70);
}

TEST(Golden, moments_give_what_the_curves_give) {
  KINESPACE_REQUIRE_FOLDER(root, golden_folder);
  for (const auto& folder : find_golden_cases(root)) {
    const GoldenCase golden = read_golden_case(folder);
    CurveMoments moments(static_cast<int>(golden.curves.cols()));
    moments.add(golden.curves.topRows(17));
    moments.add(golden.curves.bottomRows(golden.curves.rows() - 17));
    for (const GoldenDifference& d :
         compare_with_golden(golden, fit_functional_pca(moments, golden.options, golden.domain))) {
      EXPECT_LE(d.relative, d.bar) << golden.name << ": " << d.quantity;
    }
  }
}

// A comparison that never fails would be worth nothing.
TEST(Golden, another_bandwidth_or_kernel_is_noticed) {
  KINESPACE_REQUIRE_FOLDER(root, golden_folder);
  const GoldenCase golden = read_golden_case(root / "case6_synth_smooth_epan_CE");
  FpcaOptions other = golden.options;
  other.covariance_bandwidth *= 1.0001;
  bool noticed = false;
  for (const GoldenDifference& d :
       compare_with_golden(golden, fit_functional_pca(golden.curves, other, golden.domain))) {
    noticed = noticed || !d.ok();
  }
  EXPECT_TRUE(noticed);
}

class BrokenCase : public ::testing::Test {
 protected:
  BrokenCase() {
    write("input.csv", "1,2,3\n4,5,6\r\n7,8,10");
    write("obsGrid.csv", "0\n0.5\n1\n");
    write("scalars.csv", "sigma2,NA\nrho,NA\n");
    write("options.txt", good_options);
  }
  void write(const char* name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  std::string error() const {
    try {
      (void)read_golden_case(folder_.path());
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::bad_input);
      return e.what();
    }
    return "";
  }

  test::TemporaryFolder folder_;
  const std::string good_options =
      "methodMuCovEst = cross-sectional\nkernel = epan\nuserBwMu = 0.05\nuserBwCov = 0.1\nmethodXi = IN\nerror = "
      "FALSE\n"
      "shrink = FALSE\nFVEthreshold = 0.9\nmethodSelectK = FVE\nmaxK = 3\nnRegGrid = 3\nmethodRho = vanilla\n";
};

TEST_F(BrokenCase, a_whole_one_is_read) {
  EXPECT_EQ(error(), "");
  EXPECT_EQ(read_golden_case(folder_.path()).curves(2, 2), 10);
  EXPECT_EQ(find_golden_cases(folder_.path()).size(), 1U);
}

TEST_F(BrokenCase, a_word_among_the_numbers_is_named_with_its_line) {
  write("input.csv", "1,2,3\n4,five,6\n");
  EXPECT_THAT(error(), ::testing::AllOf(::testing::HasSubstr("input.csv:2"), ::testing::HasSubstr("'five'")));
  write("input.csv", "1,2,3\n4,nan,6\n");
  EXPECT_THAT(error(), ::testing::HasSubstr("'nan'"));
}

TEST_F(BrokenCase, rows_of_different_lengths_are_named) {
  write("input.csv", "1,2,3\n4,5\n");
  EXPECT_THAT(error(), ::testing::HasSubstr("input.csv:2: 2 numbers, expected 3"));
}

TEST_F(BrokenCase, an_empty_input_is_an_error) {
  write("input.csv", "\n");
  EXPECT_THAT(error(), ::testing::HasSubstr("empty"));
}

TEST_F(BrokenCase, an_irregular_grid_is_an_error) {
  write("obsGrid.csv", "0\n0.4\n1\n");
  EXPECT_THAT(error(), ::testing::HasSubstr("obsGrid.csv:2"));
}

TEST_F(BrokenCase, an_option_we_do_not_have_is_named_with_the_choices) {
  std::string options = good_options;
  write("options.txt", options.replace(options.find("epan"), 4, "rect"));
  EXPECT_THAT(error(), ::testing::HasSubstr("kernel = rect, expected one of epan, quar, gauss"));
}

TEST(Golden, a_folder_without_cases_is_an_error) {
  const test::TemporaryFolder folder;
  EXPECT_THROW((void)find_golden_cases(folder.path()), Error);
  EXPECT_THROW((void)find_golden_cases(folder / "nowhere"), Error);
}

}  // namespace
}  // namespace kinespace
