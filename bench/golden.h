// Golden FPCA cases: folders written by the fdapace package (R) that say what it computes, and how far we are from it.
//
// A folder holds input.csv (a curve a row), obsGrid.csv, workGrid.csv, options.txt ("name = value"), scalars.csv
// ("name,value") and, of the results, any of mu_obsGrid, mu_workGrid, smoothedCov, eig_smoothedCov_matrix, lambda,
// phi_workGrid, cumFVE, xiEst, xiVar_curve1 and sigma2_diag (.csv, no header). Bandwidths there are in the grid's unit.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "kinespace/fpca/functional_pca.h"

namespace kinespace {

struct GoldenCase {
  std::string name;  // the folder's
  CurveMatrix curves;
  Domain domain;
  FpcaOptions options;                            // as the package was called
  std::map<std::string, Eigen::MatrixXd> tables;  // expected results by file name without .csv
  std::map<std::string, double> scalars;          // sigma2, rho, selectK, ...; those that are NA left out
};

// Throws Error{bad_input} naming file, line and what is wrong: a missing file, rows of different lengths, words where
// numbers should be, a grid that is not regular, an option that we do not have.
[[nodiscard]] GoldenCase read_golden_case(const std::filesystem::path& folder);

// The folder of golden cases: the one given, else $KINESPACE_GOLDEN, else ../shared/golden/fpca where that is there.
[[nodiscard]] std::optional<std::filesystem::path> find_golden_folder(
    const std::optional<std::filesystem::path>& given);

// The folders of `root` that hold an input.csv, by name; `root` itself when it is one. Throws Error{bad_input} for
// none.
[[nodiscard]] std::vector<std::filesystem::path> find_golden_cases(const std::filesystem::path& root);

struct GoldenDifference {
  std::string quantity;  // mean, covariance, eigenvalues, sigma2, functions, scores, ...
  double relative = 0;   // the largest difference over the largest value; of each eigenvalue (lambda) to itself
  double bar = 0;        // what it should stay below
  [[nodiscard]] bool ok() const { return relative <= bar; }
};

// One entry for each result of the case. A number of functions other than expected shows as an infinite difference.
[[nodiscard]] std::vector<GoldenDifference> compare_with_golden(const GoldenCase& golden, const FunctionalPca& result);

}  // namespace kinespace
