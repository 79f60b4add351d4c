#include "kinespace/mesh_codecs/frame_basis.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>

#include "kinespace/entropy/integer_coder.h"

namespace kinespace {
namespace {

constexpr int finest = 40;  // bits behind the point of a coefficient

// cos x for x in [0, pi/2], by its series: no library, no surprise.
double cosine(double x) {
  double term = 1, sum = 1;
  for (int n = 1; n <= 14; ++n) {
    term *= -x * x / (static_cast<double>(2 * n - 1) * static_cast<double>(2 * n));
    sum += term;
  }
  return sum;
}

// cos(2 pi n / period) by its quarter.
double cosine_of_turn(std::int64_t n, std::int64_t period) {
  constexpr double two_pi = 6.283185307179586;
  n %= period;
  if (2 * n > period) n = period - n;
  const bool second = 4 * n > period;
  const double x = two_pi * static_cast<double>(second ? period - 2 * n : 2 * n) / static_cast<double>(2 * period);
  return second ? -cosine(x) : cosine(x);
}

double column_dot(const Eigen::MatrixXd& a, Eigen::Index i, Eigen::Index j) {
  double sum = 0;
  for (Eigen::Index f = 0; f < a.rows(); ++f) sum += a(f, i) * a(f, j);
  return sum;
}

// Twice, since once leaves a rest where columns were close. A column that adds nothing becomes zero.
void make_orthonormal(Eigen::MatrixXd& a) {
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    const double before = column_dot(a, j, j);
    for (int round = 0; round < 2; ++round) {
      for (Eigen::Index i = 0; i < j; ++i) {
        const double part = column_dot(a, i, j);
        for (Eigen::Index f = 0; f < a.rows(); ++f) a(f, j) -= part * a(f, i);
      }
    }
    const double rest = column_dot(a, j, j);
    const double scale = rest > 1e-12 * before && rest > 0 ? 1 / std::sqrt(rest) : 0;
    for (Eigen::Index f = 0; f < a.rows(); ++f) a(f, j) *= scale;
  }
}

// a * b in a written order.
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(a.rows(), b.cols());
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    for (Eigen::Index k = 0; k < a.cols(); ++k) {
      const double by = b(k, j);
      if (by == 0) continue;
      for (Eigen::Index i = 0; i < a.rows(); ++i) out(i, j) += a(i, k) * by;
    }
  }
  return out;
}

int context(std::int64_t before, std::int64_t earlier, int offset) {
  const auto sum = static_cast<std::uint64_t>(std::abs(before) * 2 + std::abs(earlier));
  return offset + std::min(bit_length(sum), 7);
}

double power_of_half(int e) {
  double out = 1;
  for (int i = 0; i < e; ++i) out *= 0.5;
  return out;
}

}  // namespace

Eigen::MatrixXd cosine_basis(int frames) {
  Eigen::MatrixXd out(frames, frames);
  const std::int64_t period = std::int64_t{4} * frames;
  for (int j = 0; j < frames; ++j) {
    const double scale = std::sqrt((j == 0 ? 1.0 : 2.0) / frames);
    for (int f = 0; f < frames; ++f) out(f, j) = scale * cosine_of_turn((2 * std::int64_t{f} + 1) * j, period);
  }
  return out;
}

CodedFrameBasis encode_frame_basis(const Eigen::MatrixXd& functions, std::span<const double> sizes, double coarseness) {
  const auto frames = static_cast<int>(functions.rows());
  const auto components = static_cast<int>(functions.cols());
  const Eigen::MatrixXd cosines = cosine_basis(frames);
  const Eigen::MatrixXd spectrum = cosines.transpose() * functions;
  IntegerWriter out;
  for (int r = 0; r < components; ++r) {
    const double fineness = std::log2(std::max(sizes[static_cast<std::size_t>(r)] / coarseness, 1.0));
    const int e = std::clamp(static_cast<int>(std::lround(fineness)), 1, finest - 10);
    out.put(e, 15);
    const double per_unit = 1 / power_of_half(e);
    std::vector<std::int64_t> q(static_cast<std::size_t>(frames));
    std::int64_t last = 0;
    for (int j = 0; j < frames; ++j) {
      // A dead zone of 0.6: small cosines cost more than they tell.
      const double x = spectrum(j, r) * per_unit;
      const std::int64_t size = static_cast<std::int64_t>(std::abs(x) + 0.4);
      q[static_cast<std::size_t>(j)] = x < 0 ? -size : size;
      if (size != 0) last = j + 1;
    }
    out.put(last, 14);
    for (std::int64_t j = 0; j < last; ++j) {
      const std::int64_t before = j > 0 ? q[static_cast<std::size_t>(j - 1)] : 1;
      const std::int64_t earlier = j > 1 ? q[static_cast<std::size_t>(j - 2)] : 1;
      out.put(q[static_cast<std::size_t>(j)], context(before, earlier, 0));
    }
  }
  CodedFrameBasis coded{.bytes = std::move(out).finish(), .functions = {}};
  coded.functions = decode_frame_basis(coded.bytes, frames, components, "");
  return coded;
}

Eigen::MatrixXd decode_frame_basis(std::span<const std::byte> bytes, int frames, int components,
                                   const std::string& source) {
  IntegerReader in(bytes, source);
  Eigen::MatrixXd spectrum = Eigen::MatrixXd::Zero(frames, components);
  for (int r = 0; r < components; ++r) {
    const auto e = static_cast<int>(in.get_between(1, finest, 15));
    const std::int64_t last = in.get_between(0, frames, 14);
    const double step = power_of_half(e);
    std::int64_t before = 1, earlier = 1;
    for (std::int64_t j = 0; j < last; ++j) {
      const std::int64_t q =
          in.get_between(-(std::int64_t{1} << 36), std::int64_t{1} << 36, context(before, earlier, 0));
      spectrum(j, r) = static_cast<double>(q) * step;
      earlier = before;
      before = q;
    }
  }
  in.expect_end();
  Eigen::MatrixXd out = product(cosine_basis(frames), spectrum);
  make_orthonormal(out);
  return out;
}

PrincipalComponents principal_components(const Eigen::MatrixXd& gram) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
  PrincipalComponents out;
  out.functions = solver.eigenvectors().rowwise().reverse();
  out.sizes = solver.eigenvalues().reverse().cwiseMax(0).cwiseSqrt();
  for (Eigen::Index r = 0; r < out.functions.cols(); ++r) {  // one sign, for streams that look alike on every machine
    Eigen::Index at = 0;
    out.functions.col(r).cwiseAbs().maxCoeff(&at);
    if (out.functions(at, r) < 0) out.functions.col(r) *= -1;
  }
  return out;
}

}  // namespace kinespace
