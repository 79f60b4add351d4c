#include "mesh/projection.h"

#include <algorithm>
#include <array>

#include <Eigen/QR>

#include "motion/simd.h"

namespace kinespace {
namespace {

constexpr int block = 512;  // vertices: their three sums stay in the first cache
constexpr int lanes = 8;    // sums side by side, added up in one order

struct Shape {
  int vertices, functions;
};

KINESPACE_VECTOR_CLONES
void add_product(Shape shape, const float* blocks, const double* c, int rows, int c_stride, double* x) {
  std::array<double, block> sum;
  for (int first = 0; first < shape.vertices; first += block) {
    const int count = std::min(block, shape.vertices - first);
    const float* const u = blocks + static_cast<std::ptrdiff_t>(first) * shape.functions;
    for (int d = 0; d < 3; ++d) {
      std::fill_n(sum.begin(), count, 0.0);
      for (int k = 0; k < rows; ++k) {
        const double weight = c[k + static_cast<std::ptrdiff_t>(d) * c_stride];
        const float* const function = u + static_cast<std::ptrdiff_t>(k) * count;
        for (int v = 0; v < count; ++v) sum[static_cast<std::size_t>(v)] += weight * static_cast<double>(function[v]);
      }
      double* const out = x + static_cast<std::ptrdiff_t>(d) * shape.vertices + first;
      for (int v = 0; v < count; ++v) out[v] += sum[static_cast<std::size_t>(v)];
    }
  }
}

KINESPACE_VECTOR_CLONES
void add_correlations(Shape shape, const float* blocks, const double* x, double* c) {
  for (int first = 0; first < shape.vertices; first += block) {
    const int count = std::min(block, shape.vertices - first);
    const float* const u = blocks + static_cast<std::ptrdiff_t>(first) * shape.functions;
    for (int k = 0; k < shape.functions; ++k) {
      const float* const function = u + static_cast<std::ptrdiff_t>(k) * count;
      for (int d = 0; d < 3; ++d) {
        const double* const in = x + static_cast<std::ptrdiff_t>(d) * shape.vertices + first;
        double sum[lanes] = {};
        int v = 0;
        for (; v + lanes <= count; v += lanes) {
          for (int l = 0; l < lanes; ++l) sum[l] += static_cast<double>(function[v + l]) * in[v + l];
        }
        double all = 0;
        for (const double part : sum) all += part;
        for (; v < count; ++v) all += static_cast<double>(function[v]) * in[v];
        c[k + static_cast<std::ptrdiff_t>(d) * shape.functions] += all;
      }
    }
  }
}

bool orthonormal(const Eigen::MatrixXd& u) {
  for (Eigen::Index k = 0; k < u.cols(); ++k) {
    if (std::abs(u.col(k).squaredNorm() - 1) > 1e-7) return false;
    if (k > 0 && std::abs(u.col(k).dot(u.col(k - 1))) > 1e-7) return false;
  }
  return true;
}

}  // namespace

Projection::Projection(const Eigen::MatrixXd& functions)
    : vertices_(static_cast<int>(functions.rows())), functions_(static_cast<int>(functions.cols())) {
  Eigen::MatrixXd made;
  const bool as_they_are = orthonormal(functions);
  if (!as_they_are) {
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(functions);
    made = qr.householderQ() * Eigen::MatrixXd::Identity(functions.rows(), functions.cols());
  }
  const Eigen::MatrixXd& u = as_they_are ? functions : made;
  blocks_.resize(static_cast<std::size_t>(u.size()));
  float* out = blocks_.data();
  for (int first = 0; first < vertices_; first += block) {
    const int count = std::min(block, vertices_ - first);
    for (int k = 0; k < functions_; ++k) {
      for (int v = 0; v < count; ++v) *out++ = static_cast<float>(u(first + v, k));
    }
  }
}

Coefficients Projection::correlations(const Points& x) const {
  Coefficients c = Coefficients::Zero(functions_, 3);
  add_correlations({vertices_, functions_}, blocks_.data(), x.data(), c.data());
  return c;
}

Coefficients Projection::coefficients(const Points& x) const {
  Coefficients c = correlations(x);
  return c + correlations(x - synthesise(c));
}

void Projection::add(const Coefficients& c, Points& x) const {
  const int rows = std::min(static_cast<int>(c.rows()), functions_);
  add_product({vertices_, functions_}, blocks_.data(), c.data(), rows, static_cast<int>(c.rows()), x.data());
}

Points Projection::synthesise(const Coefficients& c) const {
  Points x = Points::Zero(vertices_, 3);
  add(c, x);
  return x;
}

}  // namespace kinespace
