#include "kinespace/kernels/covariance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <type_traits>
#include <vector>

#include <cblas.h>

#include "kinespace/base/error.h"
#include "kinespace/base/parallel.h"
#include "kinespace/kernels/blas_call.h"
#include "kinespace/kernels/detail/covariance.h"
#include "kinespace/kernels/simd.h"

namespace kinespace {
namespace {

using covariance_detail::kBlockCurves;
using covariance_detail::Moments;
constexpr std::size_t kWave = 8;  // blocks computed side by side, then added in order

[[noreturn]] void misuse(std::string found, std::string expected) {
  throw Error(ErrorKind::usage, {.found = std::move(found), .expected = std::move(expected)});
}

// out = y - shift, sum += y - shift, for one curve.
template <typename T>
KINESPACE_SIMD_BODY void centre_curve(const float* curve, const float* shift, int points, T* out, double* sum) {
  for (int t = 0; t < points; ++t) {
    const T centred = static_cast<T>(curve[t]) - static_cast<T>(shift[t]);
    out[t] = centred;
    sum[t] += static_cast<double>(centred);
  }
}

template <typename T>
KINESPACE_SIMD_BODY void centre_body(const float* curves, std::ptrdiff_t stride, int count, const float* shift,
                                     int points, T* out, double* sum) {
  for (int c = 0; c < count; ++c) {
    centre_curve(curves + c * stride, shift, points, out + static_cast<std::ptrdiff_t>(c) * points, sum);
  }
}
KINESPACE_SIMD_BODY void centre_single_body(const float* curves, std::ptrdiff_t stride, int count, const float* shift,
                                            int points, float* out, double* sum) {
  centre_body(curves, stride, count, shift, points, out, sum);
}
KINESPACE_SIMD_BODY void centre_double_body(const float* curves, std::ptrdiff_t stride, int count, const float* shift,
                                            int points, double* out, double* sum) {
  centre_body(curves, stride, count, shift, points, out, sum);
}
KINESPACE_SIMD(centre_single, void,
               (const float* curves, std::ptrdiff_t stride, int count, const float* shift, int points, float* out,
                double* sum),
               (curves, stride, count, shift, points, out, sum))
KINESPACE_SIMD(centre_double, void,
               (const float* curves, std::ptrdiff_t stride, int count, const float* shift, int points, double* out,
                double* sum),
               (curves, stride, count, shift, points, out, sum))

// The moments of one block, with its work space.
template <typename T>
struct Block {
  RowMatrix<T> centred;
  RowMatrix<T> scatter;  // lower half
  Eigen::RowVectorXd sum;

  void compute(const float* curves, Eigen::Index stride, Eigen::Index count, const Eigen::RowVectorXf& shift) {
    const auto points = static_cast<int>(shift.size());
    const auto n = static_cast<int>(count);
    if (centred.rows() == 0) {
      centred.resize(kBlockCurves, points);
      scatter.resize(points, points);
    }
    sum = Eigen::RowVectorXd::Zero(points);
    if constexpr (std::is_same_v<T, float>) {
      centre_single(curves, stride, n, shift.data(), points, centred.data(), sum.data());
      const BlasCall call;
      cblas_ssyrk(CblasRowMajor, CblasLower, CblasTrans, points, n, 1, centred.data(), points, 0, scatter.data(),
                  points);
    } else {
      centre_double(curves, stride, n, shift.data(), points, centred.data(), sum.data());
      const BlasCall call;
      cblas_dsyrk(CblasRowMajor, CblasLower, CblasTrans, points, n, 1, centred.data(), points, 0, scatter.data(),
                  points);
    }
  }
};

template <typename T>
void add_on_processor(const float* curves, Eigen::Index stride, Eigen::Index count, const Moments& moments) {
  use_single_threaded_blas();
  const auto blocks = static_cast<std::size_t>((count + kBlockCurves - 1) / kBlockCurves);
  std::vector<Block<T>> wave(std::min(kWave, blocks));
  for (std::size_t first = 0; first < blocks; first += kWave) {
    const std::size_t in_wave = std::min(kWave, blocks - first);
    parallel_for(std::size_t{0}, in_wave, [&](std::size_t b) {
      const auto at = static_cast<Eigen::Index>(first + b) * kBlockCurves;
      wave[b].compute(curves + at * stride, stride, std::min(kBlockCurves, count - at), moments.shift);
    });
    for (std::size_t b = 0; b < in_wave; ++b) {
      moments.sum += wave[b].sum;
      for (Eigen::Index i = 0; i < moments.scatter.rows(); ++i) {
        moments.scatter.row(i).head(i + 1) += wave[b].scatter.row(i).head(i + 1).template cast<double>();
      }
    }
  }
}

}  // namespace

CovarianceStream::CovarianceStream(int points, BlockPrecision precision, Compute compute)
    : points_(points), precision_(precision), compute_(std::move(compute)) {
  if (points < 1) misuse("curves of " + std::to_string(points) + " points", "1 or more");
  sum_ = Eigen::RowVectorXd::Zero(points);
  scatter_ = RowMatrix<double>::Zero(points, points);
}

void CovarianceStream::add(const RowMatrixView<float>& curves) {
  if (curves.cols() != points_) {
    misuse("curves of " + std::to_string(curves.cols()) + " points", std::to_string(points_) + " points");
  }
  const Eigen::Index stride = curves.outerStride();
  Eigen::Index at = 0;
  while (at < curves.rows()) {
    const Eigen::Index rest = curves.rows() - at;
    const Eigen::Index whole = rest / kBlockCurves * kBlockCurves;
    if (pending_ == 0 && whole > 0 && shift_.size() > 0) {  // from the caller's memory
      add_blocks(curves.data() + at * stride, stride, whole);
      at += whole;
      continue;
    }
    if (block_.rows() == 0) block_.resize(kBlockCurves, points_);
    const Eigen::Index taken = std::min(rest, kBlockCurves - pending_);
    block_.middleRows(pending_, taken) = curves.middleRows(at, taken);
    pending_ += taken;
    at += taken;
    if (pending_ == kBlockCurves) flush();
  }
}

void CovarianceStream::choose_shift() {
  shift_ = block_.topRows(pending_).cast<double>().colwise().mean().cast<float>();
}

void CovarianceStream::flush() {
  if (pending_ == 0) return;
  if (shift_.size() == 0) choose_shift();
  add_blocks(block_.data(), points_, std::exchange(pending_, 0));
}

void CovarianceStream::add_blocks(const float* curves, Eigen::Index stride, Eigen::Index count) {
  const Moments moments{.shift = shift_, .sum = sum_, .scatter = scatter_};
  const double flops = static_cast<double>(count) * points_ * (points_ + 1.0);
  const bool exact = precision_ == BlockPrecision::double_precision;
  auto* device = exact ? nullptr : compute_.device_for(KernelFamily::covariance, flops);
  if (device != nullptr) {
    covariance_detail::add_on_device(*device, compute_.uses_lanes(*device), curves, stride, count, moments);
  } else if (exact) {
    add_on_processor<double>(curves, stride, count, moments);
  } else {
    add_on_processor<float>(curves, stride, count, moments);
  }
  count_ += count;
}

void CovarianceStream::merge(const CovarianceStream& other) {
  if (other.points_ != points_) {
    misuse("a stream of " + std::to_string(other.points_) + " points", std::to_string(points_) + " points");
  }
  CovarianceStream more(other);
  more.flush();
  if (more.count_ == 0) return;
  flush();
  if (count_ == 0) shift_ = more.shift_;
  // From the other's shift to ours: y - ours = (y - theirs) + d.
  const Eigen::RowVectorXd d = more.shift_.cast<double>() - shift_.cast<double>();
  const auto n = static_cast<double>(more.count_);
  scatter_ += more.scatter_;
  scatter_ += (d.transpose() * more.sum_ + more.sum_.transpose() * d + n * d.transpose() * d)
                  .triangularView<Eigen::Lower>()
                  .toDenseMatrix();
  sum_ += more.sum_ + n * d;
  count_ += more.count_;
}

CurveCovariance CovarianceStream::result(int lost) const {
  if (lost < 0 || lost > 1 || count() <= lost) {
    misuse(std::to_string(count()) + " curves with " + std::to_string(lost) + " degrees of freedom taken off",
           "0 or 1 taken off more curves than that");
  }
  if (pending_ > 0) {
    CovarianceStream whole(*this);
    whole.flush();
    return whole.result(lost);
  }
  const auto n = static_cast<double>(count_);
  const Eigen::RowVectorXd offset = sum_ / n;
  CurveCovariance out{.count = count_, .mean = (shift_.cast<double>() + offset).transpose()};
  out.covariance.resize(points_, points_);
  for (int i = 0; i < points_; ++i) {
    for (int j = 0; j <= i; ++j) {
      out.covariance(i, j) = out.covariance(j, i) = (scatter_(i, j) - sum_[i] * offset[j]) / (n - lost);
    }
  }
  if (!out.mean.allFinite() || !out.covariance.allFinite()) {
    throw Error(ErrorKind::bad_input,
                {.found = "curves with numbers that are not finite", .expected = "finite curves"});
  }
  return out;
}

CurveCovariance covariance(const RowMatrixView<float>& curves, int lost, BlockPrecision precision,
                           const Compute& compute) {
  CovarianceStream stream(static_cast<int>(curves.cols()), precision, compute);
  stream.add(curves);
  return stream.result(lost);
}

namespace reference {

CurveCovariance covariance(const RowMatrixView<float>& curves, int lost) {
  const auto n = static_cast<double>(curves.rows());
  const Eigen::Index points = curves.cols();
  CurveCovariance out{.count = curves.rows(),
                      .mean = Eigen::VectorXd::Zero(points),
                      .covariance = Eigen::MatrixXd::Zero(points, points)};
  for (Eigen::Index c = 0; c < curves.rows(); ++c) {
    for (Eigen::Index i = 0; i < points; ++i) out.mean[i] += curves(c, i) / n;
  }
  for (Eigen::Index c = 0; c < curves.rows(); ++c) {
    for (Eigen::Index i = 0; i < points; ++i) {
      for (Eigen::Index j = 0; j < points; ++j) {
        out.covariance(i, j) += (curves(c, i) - out.mean[i]) * (curves(c, j) - out.mean[j]);
      }
    }
  }
  out.covariance /= n - lost;
  return out;
}

}  // namespace reference
}  // namespace kinespace
