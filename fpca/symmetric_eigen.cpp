#include "kinespace/fpca/symmetric_eigen.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "kinespace/base/error.h"
#include "kinespace/fpca/detail/blas.h"
#include "kinespace/kernels/blas_call.h"

extern "C" {
void dsytrd_(const char* uplo, const int* n, double* a, const int* lda, double* d, double* e, double* tau, double* work,
             const int* lwork, int* info);
void dsterf_(const int* n, double* d, double* e, int* info);
void dstemr_(const char* jobz, const char* range, const int* n, double* d, double* e, const double* vl,
             const double* vu, const int* il, const int* iu, int* m, double* w, double* z, const int* ldz,
             const int* nzc, int* isuppz, int* tryrac, double* work, const int* lwork, int* iwork, const int* liwork,
             int* info);
void dormtr_(const char* side, const char* uplo, const char* trans, const int* m, const int* n, const double* a,
             const int* lda, const double* tau, double* c, const int* ldc, double* work, const int* lwork, int* info);
}

namespace kinespace {
namespace {

void require_success(int info, const char* routine) {
  if (info == 0) return;
  throw Error(ErrorKind::machine, {.found = std::string(routine) + " did not converge (" + std::to_string(info) + ")",
                                   .expected = "the eigenvalues of a finite symmetric matrix"});
}

}  // namespace

const Eigen::VectorXd& SymmetricEigen::decompose(const Eigen::MatrixXd& matrix) {
  blas::use_one_thread();
  size_ = static_cast<int>(matrix.rows());
  reflectors_ = matrix;
  tau_.resize(std::max(size_ - 1, 1));
  diagonal_.resize(size_);
  below_.setZero(std::max(size_, 1));
  work_.resize(64 * static_cast<std::size_t>(size_) + 64);
  int info = 0;
  const int work_size = static_cast<int>(work_.size());
  const BlasCall call;
  dsytrd_("L", &size_, reflectors_.data(), &size_, diagonal_.data(), below_.data(), tau_.data(), work_.data(),
          &work_size, &info);
  require_success(info, "dsytrd");
  values_ = diagonal_;
  scratch_below_ = below_;
  dsterf_(&size_, values_.data(), scratch_below_.data(), &info);
  require_success(info, "dsterf");
  values_.reverseInPlace();
  return values_;
}

const Eigen::MatrixXd& SymmetricEigen::vectors(int count) {
  count = std::clamp(count, 0, size_);
  vectors_.resize(size_, count);
  if (count == 0) return vectors_;
  const BlasCall call;
  select_vectors(count);
  int info = 0;
  const int work_size = static_cast<int>(work_.size());
  dormtr_("L", "L", "N", &size_, &count, reflectors_.data(), &size_, tau_.data(), vectors_.data(), &size_, work_.data(),
          &work_size, &info);
  require_success(info, "dormtr");
  orthonormalise();
  vectors_ = vectors_.rowwise().reverse().eval();
  return vectors_;
}

// Of the tridiagonal matrix, in ascending order of their values.
void SymmetricEigen::select_vectors(int count) {
  integers_.resize(10 * static_cast<std::size_t>(size_) + 1);
  support_.resize(2 * static_cast<std::size_t>(count) + 2);
  scratch_diagonal_ = diagonal_;
  scratch_below_ = below_;
  scratch_values_.resize(size_);
  const int first = size_ - count + 1, work_size = static_cast<int>(work_.size());
  const int integer_size = static_cast<int>(integers_.size());
  const double unused = 0;
  int found = 0, high_accuracy = 1, info = 0;
  dstemr_("V", "I", &size_, scratch_diagonal_.data(), scratch_below_.data(), &unused, &unused, &first, &size_, &found,
          scratch_values_.data(), vectors_.data(), &size_, &count, support_.data(), &high_accuracy, work_.data(),
          &work_size, integers_.data(), &integer_size, &info);
  require_success(info, "dstemr");
  if (found != count) require_success(found, "dstemr");
}

// dstemr leaves up to some hundred roundings between vectors of a tight cluster; one pass of Gram-Schmidt from the
// largest value down takes them away.
void SymmetricEigen::orthonormalise() {
  for (Eigen::Index j = vectors_.cols() - 1; j >= 0; --j) {
    auto column = vectors_.col(j);
    for (Eigen::Index i = vectors_.cols() - 1; i > j; --i) column -= vectors_.col(i).dot(column) * vectors_.col(i);
    column.normalize();
  }
}

}  // namespace kinespace
