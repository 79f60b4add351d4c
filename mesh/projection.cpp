#include "kinespace/mesh/projection.h"

#include <algorithm>
#include <cmath>

#include <Eigen/QR>

#include "kinespace/motion/simd.h"

namespace kinespace {
namespace {

constexpr int block = 128;  // vertices; the last block is filled up with zeros
constexpr int lanes = 8;    // sums side by side: vectors run along them, and their order is the same everywhere

struct Shape {
  int vertices, functions;
};

// Three coordinates of up to `block` vertices, zeros behind them, all set by load(). (Clang loses constructors that
// only functions with clones use, so there is none.)
struct Tile {
  double x[3][block];

  void load(const Shape& shape, const double* points, int first) {
    const int count = std::min(block, shape.vertices - first);
    for (int d = 0; d < 3; ++d) {
      const double* const in = points + static_cast<std::ptrdiff_t>(d) * shape.vertices + first;
      std::fill(std::copy_n(in, count, x[d]), x[d] + block, 0.0);
    }
  }
  void store(const Shape& shape, double* points, int first) const {
    const int count = std::min(block, shape.vertices - first);
    for (int d = 0; d < 3; ++d)
      std::copy_n(x[d], count, points + static_cast<std::ptrdiff_t>(d) * shape.vertices + first);
  }
};

// `c`: the three coefficients of each function, one after the other.
KINESPACE_VECTOR_CLONES
void add_product(Shape shape, const float* blocks, const double* c, int rows, double* x) {
  Tile tile;
  for (int first = 0; first < shape.vertices; first += block) {
    const float* const u = blocks + static_cast<std::ptrdiff_t>(first) * shape.functions;
    tile.load(shape, x, first);
    for (int part = 0; part < block; part += lanes) {
      double sum[3][lanes] = {};
      for (int k = 0; k < rows; ++k) {
        const float* const function = u + static_cast<std::ptrdiff_t>(k) * block + part;
        for (int d = 0; d < 3; ++d) {
          for (int l = 0; l < lanes; ++l) sum[d][l] += c[3 * k + d] * static_cast<double>(function[l]);
        }
      }
      for (int d = 0; d < 3; ++d) {
        for (int l = 0; l < lanes; ++l) tile.x[d][part + l] += sum[d][l];
      }
    }
    tile.store(shape, x, first);
  }
}

KINESPACE_VECTOR_CLONES
void add_correlations(Shape shape, const float* blocks, const double* x, double* c) {
  Tile tile;
  for (int first = 0; first < shape.vertices; first += block) {
    const float* const u = blocks + static_cast<std::ptrdiff_t>(first) * shape.functions;
    tile.load(shape, x, first);
    for (int k = 0; k < shape.functions; ++k) {
      const float* const function = u + static_cast<std::ptrdiff_t>(k) * block;
      double sum[3][lanes] = {};
      for (int part = 0; part < block; part += lanes) {
        for (int d = 0; d < 3; ++d) {
          for (int l = 0; l < lanes; ++l) sum[d][l] += static_cast<double>(function[part + l]) * tile.x[d][part + l];
        }
      }
      for (int d = 0; d < 3; ++d) {
        for (int half = lanes / 2; half > 0; half /= 2) {
          for (int l = 0; l < half; ++l) sum[d][l] += sum[d][l + half];
        }
        c[3 * k + d] += sum[d][0];
      }
    }
  }
}

using ByFunction = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

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
  const int blocks = (vertices_ + block - 1) / block;
  blocks_.resize(static_cast<std::size_t>(blocks) * block * static_cast<std::size_t>(functions_));
  for (int first = 0; first < vertices_; first += block) {
    float* const out = blocks_.data() + static_cast<std::ptrdiff_t>(first) * functions_;
    const int count = std::min(block, vertices_ - first);
    for (int k = 0; k < functions_; ++k) {
      for (int v = 0; v < count; ++v)
        out[static_cast<std::ptrdiff_t>(k) * block + v] = static_cast<float>(u(first + v, k));
    }
  }
}

Coefficients Projection::correlations(const Points& x) const {
  ByFunction c = ByFunction::Zero(functions_, 3);
  add_correlations({vertices_, functions_}, blocks_.data(), x.data(), c.data());
  return c;
}

Coefficients Projection::coefficients(const Points& x) const {
  Coefficients c = correlations(x);
  return c + correlations(x - synthesise(c));
}

void Projection::add(const Coefficients& c, Points& x) const {
  const ByFunction by_function = c;
  const int rows = std::min(static_cast<int>(c.rows()), functions_);
  add_product({vertices_, functions_}, blocks_.data(), by_function.data(), rows, x.data());
}

Points Projection::synthesise(const Coefficients& c) const {
  Points x = Points::Zero(vertices_, 3);
  add(c, x);
  return x;
}

}  // namespace kinespace
