#include "kinespace/kernels/keyframe_distance.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <cblas.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/kernels/blas_call.h"
#include "kinespace/kernels/detail/keyframe_distance.h"

namespace kinespace {
namespace {

using keyframe_detail::Factors;
constexpr Eigen::Index kBlockRows = 128;

void require_same_features(Eigen::Index a, Eigen::Index b) {
  if (a == b) return;
  throw Error(ErrorKind::usage, {.found = "rows of " + std::to_string(a) + " and of " + std::to_string(b) + " features",
                                 .expected = "the same features"});
}

Factors prepare(const RowMatrixView<float>& a, const RowMatrixView<float>& b) {
  const Eigen::RowVectorXf mean = b.cast<double>().colwise().mean().cast<float>();
  Factors factors{.a = a.rowwise() - mean, .b = b.rowwise() - mean};
  factors.a_norms = factors.a.rowwise().squaredNorm();
  factors.b_norms = factors.b.rowwise().squaredNorm();
  return factors;
}

void distances_of_rows(const Factors& factors, Eigen::Index first, Eigen::Index count, DistanceKind kind,
                       RowMatrix<float>& out) {
  const auto n = static_cast<int>(count);
  const auto m = static_cast<int>(factors.b.rows());
  const auto d = static_cast<int>(factors.a.cols());
  float* to = out.data() + first * out.cols();
  {
    const BlasCall call;
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, n, m, d, -2, factors.a.data() + first * d, d, factors.b.data(),
                d, 0, to, m);
  }
  for (Eigen::Index i = first; i < first + count; ++i) {
    auto row = out.row(i).array();
    row = (row + factors.b_norms.transpose().array() + factors.a_norms[i]).max(0.0F);
    if (kind == DistanceKind::rooted) row = row.sqrt();
  }
}

RowMatrix<float> on_processor(const Factors& factors, DistanceKind kind) {
  use_single_threaded_blas();
  RowMatrix<float> out(factors.a.rows(), factors.b.rows());
  const Eigen::Index blocks = (out.rows() + kBlockRows - 1) / kBlockRows;
  parallel_for(Eigen::Index{0}, blocks, [&](Eigen::Index block) {
    const Eigen::Index first = block * kBlockRows;
    distances_of_rows(factors, first, std::min(kBlockRows, out.rows() - first), kind, out);
  });
  return out;
}

}  // namespace

RowMatrix<float> keyframe_distances(const RowMatrixView<float>& a, const RowMatrixView<float>& b, DistanceKind kind,
                                    const Compute& compute) {
  require_same_features(a.cols(), b.cols());
  if (a.rows() == 0 || b.rows() == 0 || a.cols() == 0) return RowMatrix<float>::Zero(a.rows(), b.rows());
  const Factors factors = prepare(a, b);
  const double flops =
      2.0 * static_cast<double>(a.rows()) * static_cast<double>(b.rows()) * static_cast<double>(a.cols());
  auto* device = compute.device_for(KernelFamily::keyframe_distances, flops);
  if (device == nullptr) return on_processor(factors, kind);
  return keyframe_detail::on_device(*device, compute.uses_lanes(*device), factors, kind);
}

namespace reference {

RowMatrix<float> keyframe_distances(const RowMatrixView<float>& a, const RowMatrixView<float>& b, DistanceKind kind) {
  require_same_features(a.cols(), b.cols());
  RowMatrix<float> out(a.rows(), b.rows());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index j = 0; j < b.rows(); ++j) {
      double sum = 0;
      for (Eigen::Index k = 0; k < a.cols(); ++k) {
        const double difference = static_cast<double>(a(i, k)) - b(j, k);
        sum += difference * difference;
      }
      out(i, j) = static_cast<float>(kind == DistanceKind::squared ? sum : std::sqrt(sum));
    }
  }
  return out;
}

}  // namespace reference
}  // namespace kinespace
