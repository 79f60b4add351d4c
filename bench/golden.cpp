#include "bench/golden.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string_view>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"

namespace kinespace {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& file, std::int64_t line, std::string found, std::string expected) {
  throw Error(ErrorKind::bad_input,
              {.file = file.string(), .line = line, .found = std::move(found), .expected = std::move(expected)});
}

std::string quoted(std::string_view text) {
  std::string out = "'";
  out.append(text).push_back('\'');
  return out;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

// Calls work(line, number) for each line that is not blank.
template <typename Work>
void each_line(std::string_view text, const Work& work) {
  for (std::int64_t number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    if (!line.empty()) work(line, number);
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
  }
}

double parse_number(std::string_view text, const fs::path& file, std::int64_t line) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    fail(file, line, quoted(text), "a finite number");
  }
  return value;
}

Eigen::MatrixXd read_table(const fs::path& file) {
  const FileContent mapped(file);
  std::vector<double> values;
  std::size_t columns = 0, rows = 0;
  each_line(mapped.text(), [&](std::string_view line, std::int64_t number) {
    const std::size_t before = values.size();
    while (true) {
      const auto comma = line.find(',');
      values.push_back(parse_number(trimmed(line.substr(0, comma)), file, number));
      if (comma == std::string_view::npos) break;
      line = line.substr(comma + 1);
    }
    if (rows++ == 0) columns = values.size();
    if (values.size() - before != columns) {
      fail(file, number, std::to_string(values.size() - before) + " numbers",
           std::to_string(columns) + " as in the first row");
    }
  });
  if (rows == 0) fail(file, 0, "an empty file", "rows of numbers");
  return Eigen::Map<const CurveMatrix>(values.data(), static_cast<Eigen::Index>(rows),
                                       static_cast<Eigen::Index>(columns));
}

// "name = value" or "name,value" lines.
std::map<std::string, std::string> read_pairs(const fs::path& file, char separator) {
  const FileContent mapped(file);
  std::map<std::string, std::string> out;
  each_line(mapped.text(), [&](std::string_view line, std::int64_t number) {
    const auto at = line.find(separator);
    if (at == std::string_view::npos)
      fail(file, number, quoted(line), "a name, '" + std::string(1, separator) + "' and a value");
    out[std::string(trimmed(line.substr(0, at)))] = std::string(trimmed(line.substr(at + 1)));
  });
  return out;
}

class PackageOptions {
 public:
  explicit PackageOptions(fs::path file) : file_(std::move(file)), values_(read_pairs(file_, '=')) {}

  [[nodiscard]] const std::string& text(const std::string& name) const {
    const auto found = values_.find(name);
    if (found == values_.end()) fail(file_, 0, "no option '" + name + "'", "one");
    return found->second;
  }
  [[nodiscard]] double number(const std::string& name) const { return parse_number(text(name), file_, 0); }
  [[nodiscard]] bool flag(const std::string& name) const { return choose(name, {"FALSE", "TRUE"}) == 1; }
  // The index of the option's value among the choices.
  [[nodiscard]] std::size_t choose(const std::string& name, const std::vector<std::string>& choices) const {
    const auto found = std::find(choices.begin(), choices.end(), text(name));
    if (found != choices.end()) return static_cast<std::size_t>(found - choices.begin());
    std::string list;
    for (const std::string& choice : choices) list += (list.empty() ? "" : ", ") + choice;
    fail(file_, 0, name + " = " + text(name), "one of " + list);
  }

 private:
  fs::path file_;
  std::map<std::string, std::string> values_;
};

FpcaOptions translate(const PackageOptions& package, const Domain& domain) {
  FpcaOptions options;
  options.mode = FpcaMode::pace;
  options.smooth_covariance = package.choose("methodMuCovEst", {"cross-sectional", "smooth"}) == 1;
  options.mean = options.smooth_covariance ? MeanEstimate::smooth : MeanEstimate::cross_sectional;
  options.kernel = static_cast<SmoothingKernel>(package.choose("kernel", {"epan", "quar", "gauss"}));
  if (options.smooth_covariance) {  // else the package does not use them
    options.mean_bandwidth = package.number("userBwMu") / domain.length();
    options.covariance_bandwidth = package.number("userBwCov") / domain.length();
  }
  options.estimate_noise = package.flag("error");
  options.scores = static_cast<ScoreKind>(package.choose("methodXi", {"IN", "CE"}));
  options.shrink = package.flag("shrink") && options.estimate_noise && options.scores == ScoreKind::integration;
  options.truncate_noise = package.choose("methodRho", {"vanilla", "no", "trunc"}) == 2 && options.estimate_noise &&
                           options.scores == ScoreKind::conditional;
  options.variance_share = package.number("FVEthreshold");
  if (package.text("methodSelectK") != "FVE") options.count = static_cast<int>(package.number("methodSelectK"));
  options.max_functions = static_cast<int>(package.number("maxK"));
  options.work_points = static_cast<int>(package.number("nRegGrid"));
  return options;
}

Domain read_domain(const fs::path& file, Eigen::Index points) {
  const Eigen::MatrixXd grid = read_table(file);
  if (grid.size() != points || grid.size() < 2) {
    fail(file, 0, std::to_string(grid.size()) + " points", std::to_string(points) + " as the curves have, at least 2");
  }
  const Domain domain{.start = grid(0), .end = grid(grid.size() - 1)};
  for (Eigen::Index i = 0; i < grid.size(); ++i) {
    const double regular = domain.start + domain.length() * static_cast<double>(i) / static_cast<double>(points - 1);
    if (!(std::abs(grid(i) - regular) <= 1e-9 * domain.length())) {
      fail(file, i + 1, "a grid that is not regular", std::to_string(regular));
    }
  }
  return domain;
}

double relative_difference(const Eigen::MatrixXd& ours, const Eigen::MatrixXd& theirs) {
  const double scale = theirs.cwiseAbs().maxCoeff();
  if (ours.rows() != theirs.rows() || ours.cols() != theirs.cols()) return std::numeric_limits<double>::infinity();
  const double difference = (ours - theirs).cwiseAbs().maxCoeff();
  return scale > 0 ? difference / scale : difference;
}

double largest_relative(const Eigen::VectorXd& ours, const Eigen::VectorXd& theirs) {
  if (ours.size() != theirs.size()) return std::numeric_limits<double>::infinity();
  return ((ours - theirs).array() / theirs.array()).abs().maxCoeff();
}

}  // namespace

GoldenCase read_golden_case(const fs::path& folder) {
  GoldenCase out;
  out.name = folder.filename().string();
  out.curves = read_table(folder / "input.csv");
  out.domain = read_domain(folder / "obsGrid.csv", out.curves.cols());
  out.options = translate(PackageOptions(folder / "options.txt"), out.domain);
  for (const char* name : {"mu_obsGrid", "mu_workGrid", "smoothedCov", "eig_smoothedCov_matrix", "lambda",
                           "phi_workGrid", "cumFVE", "xiEst", "xiVar_curve1", "sigma2_diag"}) {
    const fs::path file = folder / (std::string(name) + ".csv");
    if (fs::exists(file)) out.tables[name] = read_table(file);
  }
  const fs::path scalars = folder / "scalars.csv";
  for (const auto& [name, value] : read_pairs(scalars, ',')) {
    if (value != "NA") out.scalars[name] = parse_number(value, scalars, 0);
  }
  return out;
}

std::optional<fs::path> find_golden_folder(const std::optional<fs::path>& given) {
  if (given) return given;
  const char* named = std::getenv("KINESPACE_GOLDEN");
  const fs::path standard = named != nullptr && *named != '\0' ? fs::path(named) : fs::path("../shared/golden/fpca");
  std::error_code error;
  if (fs::is_directory(standard, error)) return standard;
  return std::nullopt;
}

std::vector<fs::path> find_golden_cases(const fs::path& root) {
  std::vector<fs::path> out;
  std::error_code error;
  if (fs::exists(root / "input.csv", error)) return {root};
  for (const auto& entry : fs::directory_iterator(root, error)) {
    if (fs::exists(entry.path() / "input.csv", error)) out.push_back(entry.path());
  }
  if (out.empty()) fail(root, 0, "no golden cases", "folders with an input.csv");
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<GoldenDifference> compare_with_golden(const GoldenCase& golden, const FunctionalPca& result) {
  constexpr double tight = 1e-8, loose = 1e-6;
  std::vector<GoldenDifference> out;
  const auto compare = [&](const char* quantity, const char* table, double bar, const auto& ours) {
    const auto found = golden.tables.find(table);
    if (found != golden.tables.end()) out.push_back({quantity, relative_difference(ours, found->second), bar});
  };
  const double step = result.grid[1] - result.grid[0];
  compare("mean", "mu_obsGrid", tight, result.observed_mean);
  compare("mean", "mu_workGrid", tight, result.mean);
  compare("covariance", "smoothedCov", tight, result.covariance);
  compare("eigenvalues", "eig_smoothedCov_matrix", tight, result.all_eigenvalues / step);
  compare("variance shares", "cumFVE", tight, result.cumulative_shares);
  compare("noise diagonal", "sigma2_diag", tight, result.noise_diagonal);
  compare("functions", "phi_workGrid", loose, result.functions);
  if (const auto found = golden.tables.find("lambda"); found != golden.tables.end()) {
    out.push_back({"eigenvalues", largest_relative(result.eigenvalues, found->second.reshaped()), tight});
  }
  if (golden.tables.contains("xiEst")) {
    compare("scores", "xiEst", loose, Eigen::MatrixXd(result.scores(golden.curves)));
  }
  compare("posterior covariance", "xiVar_curve1", loose, result.posterior_covariance);
  if (const auto found = golden.scalars.find("sigma2"); found != golden.scalars.end()) {
    out.push_back({"sigma2", std::abs(result.noise_variance.value_or(0) / found->second - 1), tight});
  }
  if (const auto found = golden.scalars.find("rho"); found != golden.scalars.end() && golden.options.truncate_noise) {
    out.push_back({"rho", std::abs(result.score_noise / found->second - 1), tight});
  }
  return out;
}

}  // namespace kinespace
