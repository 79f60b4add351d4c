#include "kinespace/mesh/detail/eigenpairs.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <Spectra/SymEigsShiftSolver.h>
#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

constexpr Eigen::Index half_band = 30;  // pairs on each side of a shift
constexpr int most_restarts = 100;

// What its numbers are of the size of.
double unit_of(const SparseMatrix& matrix) {
  const double mean = matrix.diagonal().mean();
  return mean > 0 ? mean : 1;
}

// A - shift I, factored.
class Shifted {
 public:
  explicit Shifted(const SparseMatrix& matrix) : matrix_(matrix), identity_(matrix.rows(), matrix.cols()) {
    identity_.setIdentity();
  }

  [[nodiscard]] Eigen::Index size() const { return matrix_.rows(); }
  // False where a pivot is zero.
  [[nodiscard]] bool factorise(double shift) {
    const SparseMatrix shifted = matrix_ - shift * identity_;
    if (!analysed_) solver_.analyzePattern(shifted);
    analysed_ = true;
    solver_.factorize(shifted);
    return solver_.info() == Eigen::Success;
  }
  // How many eigenvalues are below the shift.
  [[nodiscard]] Eigen::Index below() const { return (solver_.vectorD().array() < 0).count(); }
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::Ref<const Eigen::VectorXd>& x) const { return solver_.solve(x); }

 private:
  const SparseMatrix& matrix_;
  SparseMatrix identity_;
  Eigen::SimplicialLDLT<SparseMatrix> solver_;
  bool analysed_ = false;
};

// x -> (A - shift I)^-1 x for Spectra, beside vectors that are known already.
class Inverse {
 public:
  using Scalar = double;

  Inverse(const Shifted& shifted, const Eigen::MatrixXd& known) : shifted_(shifted), known_(known) {}

  [[nodiscard]] Eigen::Index rows() const { return shifted_.size(); }
  [[nodiscard]] Eigen::Index cols() const { return shifted_.size(); }
  static void set_shift(double /*shift*/) {}  // it is factored already
  void perform_op(const double* from, double* to) const {
    const Eigen::Map<const Eigen::VectorXd> x(from, rows());
    Eigen::Map<Eigen::VectorXd> y(to, rows());
    y = shifted_.solve(beside(x));
    if (known_.cols() > 0) y = beside(y);
  }

 private:
  [[nodiscard]] Eigen::VectorXd beside(const Eigen::Ref<const Eigen::VectorXd>& x) const {
    if (known_.cols() == 0) return x;
    return x - known_ * (known_.transpose() * x);
  }
  const Shifted& shifted_;
  const Eigen::MatrixXd& known_;
};

using Found = std::optional<Eigenpairs>;

// The `count` pairs nearest to the shift, beside the known vectors; none where the process does not converge.
Found nearest_pairs(const Shifted& shifted, double shift, Eigen::Index count, const Eigen::MatrixXd& known,
                    double tolerance, Eigen::Index space) {
  const Eigen::Index most = shifted.size() - known.cols() - 1;
  count = std::min(count, most - 1);
  if (count < 1) return std::nullopt;
  Inverse inverse(shifted, known);
  Spectra::SymEigsShiftSolver<Inverse> solver(inverse, count, std::clamp(space, count + 1, most), shift);
  try {
    solver.init();
    solver.compute(Spectra::SortRule::LargestMagn, most_restarts, tolerance, Spectra::SortRule::SmallestAlge);
  } catch (const std::runtime_error&) {
    return std::nullopt;  // so Spectra says that its small dense problem did not converge
  }
  if (solver.info() != Spectra::CompInfo::Successful) return std::nullopt;
  return Eigenpairs{solver.eigenvectors(), solver.eigenvalues()};
}

Eigenpairs merged(const Eigenpairs& a, const Eigenpairs& b) {
  const Eigen::Index all = a.values.size() + b.values.size();
  std::vector<Eigen::Index> order(static_cast<std::size_t>(all));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  const auto value = [&](Eigen::Index i) { return i < a.values.size() ? a.values[i] : b.values[i - a.values.size()]; };
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index i, Eigen::Index j) { return value(i) < value(j); });
  Eigenpairs out{Eigen::MatrixXd(a.vectors.rows(), all), Eigen::VectorXd(all)};
  for (Eigen::Index k = 0; k < all; ++k) {
    const Eigen::Index i = order[static_cast<std::size_t>(k)];
    out.values[k] = value(i);
    out.vectors.col(k) = i < a.values.size() ? a.vectors.col(i) : b.vectors.col(i - a.values.size());
  }
  return out;
}

class Bands {
 public:
  Bands(const SparseMatrix& matrix, int count, double tolerance)
      : matrix_(matrix),
        count_(count),
        tolerance_(tolerance),
        unit_(unit_of(matrix)),
        shifted_(matrix),
        counter_(matrix),
        vectors_(matrix.rows(), count),
        values_(count),
        shift_(-1e-6 * unit_),
        cut_(-1e300) {}

  // None where the bands do not add up.
  [[nodiscard]] Found find() && {
    constexpr int most_bands = 10'000;
    for (int band = 0; have_ < count_ && band < most_bands; ++band) {
      if (!find_band()) return std::nullopt;
      shift_ = next_shift();
    }
    const bool good = have_ == count_ && holds();
    return good ? Found(Eigenpairs{std::move(vectors_), std::move(values_)}) : std::nullopt;
  }

 private:
  // All pairs between the last cut and the next.
  bool find_band() {
    if (!place_shift()) return false;
    const Eigen::Index wanted = std::min(2 * (shifted_.below() - have_) + 12, count_ - have_ + half_band + 12);
    const Eigen::Index asked = std::max<Eigen::Index>(wanted, std::min(2 * half_band, count_ - have_ + 12));
    const Eigen::MatrixXd none(matrix_.rows(), 0);
    Found found = nearest_pairs(shifted_, shift_, asked, none, tolerance_, 2 * asked);
    if (!found) return false;
    constexpr int most_searches = 8;
    for (int search = 0; search < most_searches; ++search) {
      const Eigen::Index last = end_of_band(found->values);
      const double cut = (found->values[last - 1] + found->values[last]) / 2;
      if (cut <= cut_) {  // a gap: all that was found is known already
        stretch_ *= 2;
        return true;
      }
      if (!counter_.factorise(cut)) return false;
      const Eigen::Index first = (found->values.array() <= cut_).count();
      const Eigen::Index missing = counter_.below() - have_ - (last - first);
      if (missing < 0) return false;
      if (missing == 0) {
        accept(*found, first, last, cut);
        return true;
      }
      const Found more = nearest_pairs(shifted_, shift_, missing + 4, found->vectors, tolerance_, 3 * missing + 40);
      if (!more) return false;
      found = merged(*found, *more);
    }
    return false;
  }

  // Moved back towards the cut where more lies between them than a band holds.
  bool place_shift() {
    constexpr int most_tries = 20;
    for (int i = 0; i < most_tries; ++i) {
      if (!shifted_.factorise(shift_)) {
        shift_ += 1e-3 * std::abs(shift_);
        continue;
      }
      const Eigen::Index between = shifted_.below() - have_;
      if (between <= 2 * half_band || have_ == 0) return between >= 0;
      shift_ = cut_ + (shift_ - cut_) * static_cast<double>(half_band) / static_cast<double>(between);
    }
    return false;
  }

  // A cut through the widest gap near the end: nearly equal eigenvalues stay together.
  [[nodiscard]] static Eigen::Index end_of_band(const Eigen::VectorXd& values) {
    constexpr Eigen::Index looked_at = 12;
    Eigen::Index best = values.size() - 1;
    for (Eigen::Index i = best; i > std::max<Eigen::Index>(values.size() - looked_at, 1); --i) {
      if (values[i] - values[i - 1] > values[best] - values[best - 1]) best = i;
    }
    return best;
  }

  void accept(const Eigenpairs& found, Eigen::Index first, Eigen::Index last, double cut) {
    const Eigen::Index taken = std::min(last - first, count_ - have_);
    auto added = vectors_.middleCols(have_, taken);
    added = found.vectors.middleCols(first, taken);
    values_.segment(have_, taken) = found.values.segment(first, taken);
    // Pairs of far bands are orthogonal by the distance of their eigenvalues; the nearest may hold a rest.
    const Eigen::Index near = std::min(have_, 3 * half_band);
    const auto before = vectors_.middleCols(have_ - near, near);
    if (near > 0) {
      const Eigen::MatrixXd held = before.transpose() * added;
      added.noalias() -= before * held;
      added.colwise().normalize();
    }
    have_ += taken;
    cut_ = cut;
    stretch_ = 1;
  }

  // Half a band beyond the cut, by the density of the last eigenvalues.
  [[nodiscard]] double next_shift() const {
    if (have_ < 2) return cut_ + stretch_ * 1e-6 * unit_;
    const Eigen::Index back = std::min<Eigen::Index>(have_ - 1, 40);
    const double apart = (values_[have_ - 1] - values_[have_ - 1 - back]) / static_cast<double>(back);
    const double ahead = static_cast<double>(std::min(half_band, (count_ - have_) / 2 + 6));
    return cut_ + stretch_ * ahead * std::max(apart, 1e-12 * unit_);
  }

  // A last look: pivots are not sought, so a factorisation may have gone astray.
  [[nodiscard]] bool holds() const {
    const Eigen::MatrixXd rest = matrix_ * vectors_ - vectors_ * values_.asDiagonal();
    return rest.allFinite() && rest.cwiseAbs().maxCoeff() <= 100 * tolerance_ * unit_;
  }

  const SparseMatrix& matrix_;
  Eigen::Index count_;
  double tolerance_;
  double unit_;  // of the matrix
  Shifted shifted_, counter_;
  Eigen::MatrixXd vectors_;
  Eigen::VectorXd values_;
  Eigen::Index have_ = 0;
  double shift_, cut_;  // all pairs below the cut are there
  double stretch_ = 1;  // of the way to the next shift, where a gap is wide
};

[[noreturn]] void fail_to_converge(int count) {
  throw Error(ErrorKind::machine,
              {.found = fmt::format("the eigenproblem of the mesh does not converge for {} functions", count),
               .remedy = "ask for another number of functions"});
}

// All at once: slow, and nothing says that no pair is missing.
Eigenpairs one_band(const SparseMatrix& matrix, int count, double tolerance) {
  const double shift = -1e-6 * unit_of(matrix);
  Shifted shifted(matrix);
  const Eigen::MatrixXd none(matrix.rows(), 0);
  Found found;
  if (shifted.factorise(shift)) found = nearest_pairs(shifted, shift, count, none, tolerance, count * 7 / 5 + 20);
  if (!found) fail_to_converge(count);
  return std::move(*found);
}

}  // namespace

Eigenpairs smallest_eigenpairs(const SparseMatrix& matrix, int count, double tolerance) {
  if (matrix.squaredNorm() == 0) {  // a mesh without size: any vectors do
    return {Eigen::MatrixXd::Identity(matrix.rows(), count), Eigen::VectorXd::Zero(count)};
  }
  if (Found found = Bands(matrix, count, tolerance).find()) return std::move(*found);
  return one_band(matrix, count, tolerance);
}

Eigenpairs smallest_eigenpairs_dense(const SparseMatrix& matrix, int count) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(Eigen::MatrixXd{matrix});
  if (solver.info() != Eigen::Success) fail_to_converge(count);
  return {solver.eigenvectors().leftCols(count), solver.eigenvalues().head(count)};
}

}  // namespace kinespace
