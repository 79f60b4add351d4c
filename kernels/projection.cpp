#include "kinespace/kernels/projection.h"

#include <algorithm>
#include <string>
#include <type_traits>

#include <cblas.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/kernels/blas_call.h"
#include "kinespace/kernels/detail/projection.h"

namespace kinespace {
namespace {

constexpr Eigen::Index kProjectionRows = 256;
template <typename T>
using Vector = Eigen::Matrix<T, Eigen::Dynamic, 1>;

std::string shape(Eigen::Index rows, Eigen::Index columns) {
  return std::to_string(rows) + " x " + std::to_string(columns);
}

void require(bool fits, const std::string& left, Eigen::Index mean, const std::string& right) {
  if (fits) return;
  throw Error(ErrorKind::usage,
              {.found = left + " numbers, a mean of " + std::to_string(mean) + " and " + right + " functions",
               .expected = "sizes that fit"});
}

template <typename T>
void gemm(Eigen::Index n, Eigen::Index m, Eigen::Index k, const T* a, Eigen::Index a_stride, bool turn_b, const T* b,
          Eigen::Index b_stride, T beta, T* out) {
  const auto turned = turn_b ? CblasTrans : CblasNoTrans;
  const auto size = [](Eigen::Index x) { return static_cast<int>(x); };
  const BlasCall call;
  if constexpr (std::is_same_v<T, float>) {
    cblas_sgemm(CblasRowMajor, CblasNoTrans, turned, size(n), size(m), size(k), 1, a, size(a_stride), b, size(b_stride),
                beta, out, size(m));
  } else {
    cblas_dgemm(CblasRowMajor, CblasNoTrans, turned, size(n), size(m), size(k), 1, a, size(a_stride), b, size(b_stride),
                beta, out, size(m));
  }
}

template <typename Body>
void for_row_blocks(Eigen::Index rows, const Body& body) {
  use_single_threaded_blas();
  parallel_for(Eigen::Index{0}, (rows + kProjectionRows - 1) / kProjectionRows, [&](Eigen::Index block) {
    const Eigen::Index first = block * kProjectionRows;
    body(first, std::min(kProjectionRows, rows - first));
  });
}

template <typename T>
RowMatrix<T> project_on_processor(const RowMatrixView<T>& curves, const Vector<T>& mean,
                                  const RowMatrixView<T>& projection) {
  RowMatrix<T> out(curves.rows(), projection.cols());
  for_row_blocks(curves.rows(), [&](Eigen::Index first, Eigen::Index count) {
    const RowMatrix<T> centred = curves.middleRows(first, count).rowwise() - mean.transpose();
    gemm<T>(count, out.cols(), curves.cols(), centred.data(), centred.cols(), false, projection.data(),
            projection.outerStride(), 0, out.data() + first * out.cols());
  });
  return out;
}

template <typename T>
RowMatrix<T> reconstruct_on_processor(const RowMatrixView<T>& scores, const Vector<T>& mean,
                                      const RowMatrixView<T>& functions) {
  RowMatrix<T> out(scores.rows(), functions.rows());
  for_row_blocks(scores.rows(), [&](Eigen::Index first, Eigen::Index count) {
    out.middleRows(first, count).rowwise() = mean.transpose();
    gemm<T>(count, out.cols(), scores.cols(), scores.data() + first * scores.outerStride(), scores.outerStride(), true,
            functions.data(), functions.outerStride(), 1, out.data() + first * out.cols());
  });
  return out;
}

template <typename T>
void require_projection(const RowMatrixView<T>& curves, const Vector<T>& mean, const RowMatrixView<T>& projection) {
  require(curves.cols() == mean.size() && mean.size() == projection.rows(), shape(curves.rows(), curves.cols()),
          mean.size(), shape(projection.rows(), projection.cols()));
}

template <typename T>
void require_reconstruction(const RowMatrixView<T>& scores, const Vector<T>& mean, const RowMatrixView<T>& functions) {
  require(scores.cols() == functions.cols() && mean.size() == functions.rows(), shape(scores.rows(), scores.cols()),
          mean.size(), shape(functions.rows(), functions.cols()));
}

double flops(Eigen::Index n, const RowMatrixView<float>& functions) {
  return 2.0 * static_cast<double>(n) * static_cast<double>(functions.rows()) * static_cast<double>(functions.cols());
}

}  // namespace

RowMatrix<float> project(const RowMatrixView<float>& curves, const Eigen::VectorXf& mean,
                         const RowMatrixView<float>& projection, const Compute& compute) {
  require_projection<float>(curves, mean, projection);
  if (curves.rows() == 0 || projection.size() == 0) return RowMatrix<float>::Zero(curves.rows(), projection.cols());
  auto* device = compute.device_for(KernelFamily::projection, flops(curves.rows(), projection));
  if (device == nullptr) return project_on_processor<float>(curves, mean, projection);
  return projection_detail::on_device(*device, compute.uses_lanes(*device), curves, mean, projection,
                                      Eigen::VectorXf::Zero(projection.cols()));
}

RowMatrix<double> project(const RowMatrixView<double>& curves, const Eigen::VectorXd& mean,
                          const RowMatrixView<double>& projection) {
  require_projection<double>(curves, mean, projection);
  if (curves.rows() == 0 || projection.size() == 0) return RowMatrix<double>::Zero(curves.rows(), projection.cols());
  return project_on_processor<double>(curves, mean, projection);
}

RowMatrix<float> reconstruct(const RowMatrixView<float>& scores, const Eigen::VectorXf& mean,
                             const RowMatrixView<float>& functions, const Compute& compute) {
  require_reconstruction<float>(scores, mean, functions);
  if (scores.size() == 0 || functions.size() == 0) return mean.transpose().replicate(scores.rows(), 1);
  auto* device = compute.device_for(KernelFamily::projection, flops(scores.rows(), functions));
  if (device == nullptr) return reconstruct_on_processor<float>(scores, mean, functions);
  return projection_detail::on_device(*device, compute.uses_lanes(*device), scores,
                                      Eigen::VectorXf::Zero(scores.cols()), functions.transpose(), mean);
}

RowMatrix<double> reconstruct(const RowMatrixView<double>& scores, const Eigen::VectorXd& mean,
                              const RowMatrixView<double>& functions) {
  require_reconstruction<double>(scores, mean, functions);
  if (scores.size() == 0 || functions.size() == 0) return mean.transpose().replicate(scores.rows(), 1);
  return reconstruct_on_processor<double>(scores, mean, functions);
}

namespace reference {

RowMatrix<float> project(const RowMatrixView<float>& curves, const Eigen::VectorXf& mean,
                         const RowMatrixView<float>& projection) {
  RowMatrix<float> out(curves.rows(), projection.cols());
  for (Eigen::Index i = 0; i < out.rows(); ++i) {
    for (Eigen::Index j = 0; j < out.cols(); ++j) {
      double sum = 0;
      for (Eigen::Index t = 0; t < curves.cols(); ++t) {
        sum += (static_cast<double>(curves(i, t)) - mean[t]) * projection(t, j);
      }
      out(i, j) = static_cast<float>(sum);
    }
  }
  return out;
}

RowMatrix<float> reconstruct(const RowMatrixView<float>& scores, const Eigen::VectorXf& mean,
                             const RowMatrixView<float>& functions) {
  RowMatrix<float> out(scores.rows(), functions.rows());
  for (Eigen::Index i = 0; i < out.rows(); ++i) {
    for (Eigen::Index t = 0; t < out.cols(); ++t) {
      double sum = mean[t];
      for (Eigen::Index j = 0; j < scores.cols(); ++j) sum += static_cast<double>(scores(i, j)) * functions(t, j);
      out(i, t) = static_cast<float>(sum);
    }
  }
  return out;
}

}  // namespace reference
}  // namespace kinespace
