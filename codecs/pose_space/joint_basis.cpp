#include "kinespace/codecs/pose_space/joint_basis.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "kinespace/entropy/integer_coder.h"

namespace kinespace {
namespace {

// How large an entry is likely to be: as its neighbour in the column and that of the column before.
int entry_context(const JointBasis& basis, std::size_t component, std::size_t dimension) {
  const auto d = static_cast<std::size_t>(basis.dimensions);
  const auto size = [&](std::size_t c, std::size_t r) { return std::abs(basis.entries[c * d + r]); };
  std::int64_t sum = 0;
  if (dimension > 0) sum += size(component, dimension - 1);
  if (dimension > 1) sum += size(component, dimension - 2);
  if (dimension > 2) sum += size(component, dimension - 3);
  if (component > 0) sum += size(component - 1, dimension);
  const int exponent = basis.exponents[component];
  const int width = bit_length(static_cast<std::uint64_t>(sum));
  return 1 + std::min(13, std::max(width, exponent - 5 > 0 ? std::min(exponent - 5, 3) : 0));
}

}  // namespace

Eigen::MatrixXd JointBasis::mixing() const {
  Eigen::MatrixXd out(dimensions, components);
  for (int c = 0; c < components; ++c) {
    const double step = std::ldexp(1.0, -exponents[static_cast<std::size_t>(c)]);
    for (int r = 0; r < dimensions; ++r) {
      out(r, c) =
          step *
          entries[static_cast<std::size_t>(c) * static_cast<std::size_t>(dimensions) + static_cast<std::size_t>(r)];
    }
  }
  return out;
}

JointBasis quantise_basis(const Eigen::MatrixXd& mixing, std::span<const int> exponents) {
  JointBasis out{.dimensions = static_cast<int>(mixing.rows()), .components = static_cast<int>(mixing.cols())};
  for (Eigen::Index c = 0; c < mixing.cols(); ++c) {
    const int exponent = std::clamp(exponents[static_cast<std::size_t>(c)], 0, 20);
    out.exponents.push_back(static_cast<std::int8_t>(exponent));
    for (Eigen::Index r = 0; r < mixing.rows(); ++r) {
      const double steps = std::clamp(std::ldexp(mixing(r, c), exponent), -1e9, 1e9);
      out.entries.push_back(static_cast<std::int32_t>(std::lround(steps)));
    }
  }
  return out;
}

Bytes pack_basis(const JointBasis& basis) {
  IntegerWriter out;
  int last = 8;
  for (std::size_t c = 0; c < basis.exponents.size(); ++c) {
    out.put(basis.exponents[c] - last, 0);
    last = basis.exponents[c];
    for (std::size_t r = 0; r < static_cast<std::size_t>(basis.dimensions); ++r) {
      out.put(basis.entries[c * static_cast<std::size_t>(basis.dimensions) + r], entry_context(basis, c, r));
    }
  }
  return std::move(out).finish();
}

JointBasis unpack_basis(std::span<const std::byte> bytes, int dimensions, int components, const std::string& source) {
  IntegerReader in(bytes, source);
  JointBasis out{.dimensions = dimensions, .components = components};
  out.entries.resize(static_cast<std::size_t>(dimensions) * static_cast<std::size_t>(components));
  int last = 8;
  for (std::size_t c = 0; c < static_cast<std::size_t>(components); ++c) {
    const std::int64_t exponent = last + in.get(0);
    if (exponent < 0 || exponent > 20) in.damaged();
    last = static_cast<int>(exponent);
    out.exponents.push_back(static_cast<std::int8_t>(exponent));
    for (std::size_t r = 0; r < static_cast<std::size_t>(dimensions); ++r) {
      out.entries[c * static_cast<std::size_t>(dimensions) + r] =
          static_cast<std::int32_t>(in.get_between(-1'000'000'000, 1'000'000'000, entry_context(out, c, r)));
    }
  }
  in.expect_end();
  return out;
}

JointBasis sent_basis(const KarhunenLoeve& exact, std::span<const int> kept, double step,
                      const Eigen::MatrixXd& lower) {
  constexpr int coarsest_exponent = 5;
  constexpr int finest_exponent = 20;
  constexpr int extra_exponent = 6;
  Eigen::MatrixXd basis(exact.basis.rows(), static_cast<Eigen::Index>(kept.size()));
  std::vector<int> exponents;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    basis.col(static_cast<Eigen::Index>(i)) = exact.basis.col(kept[i]);
    const double rms = std::sqrt(exact.energy(kept[i]));
    const auto wanted = static_cast<int>(std::ceil(std::log2(std::max(rms / step, 1e-3)))) + extra_exponent;
    exponents.push_back(std::clamp(wanted, coarsest_exponent, finest_exponent));
  }
  return quantise_basis(lower.transpose() * basis, exponents);
}

KarhunenLoeve karhunen_loeve(const Eigen::MatrixXd& metric, const Eigen::MatrixXd& second_moments) {
  const Eigen::LLT<Eigen::MatrixXd> factor(metric);
  const Eigen::MatrixXd lower = factor.matrixL();
  const Eigen::MatrixXd whitened = lower.transpose() * second_moments * lower;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(whitened);
  KarhunenLoeve out;
  out.energy = solver.eigenvalues().reverse().cwiseMax(0);
  const Eigen::MatrixXd vectors = solver.eigenvectors().rowwise().reverse();
  out.basis = lower.transpose().triangularView<Eigen::Upper>().solve(vectors);
  return out;
}

Eigen::MatrixXd projection_onto(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& metric) {
  const Eigen::MatrixXd weighted = metric * basis;
  const Eigen::MatrixXd gram = basis.transpose() * weighted;
  return gram.ldlt().solve(weighted.transpose());
}

}  // namespace kinespace
