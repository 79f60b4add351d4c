#include <algorithm>

#include "kinespace/kernels/detail/covariance.h"
#include "kinespace/kernels/detail/matrix_opencl.h"

namespace kinespace::covariance_detail {

using matrix_opencl::numbers;
using matrix_opencl::padded;

namespace {

// What the kernels read: the curves as they lie, where a tile fits, else a copy with padded rows.
class PaddedCurves {
 public:
  PaddedCurves(const float* curves, Eigen::Index stride, Eigen::Index points, Eigen::Index most_rows)
      : curves_(curves), stride_(stride), points_(points), width_(padded(points)) {
    if (width_ != stride) copy_ = RowMatrix<float>::Zero(most_rows, width_);
  }
  [[nodiscard]] std::span<const float> rows(Eigen::Index first, Eigen::Index count) {
    const auto size = static_cast<std::size_t>(count * width_);
    if (copy_.size() == 0) return {curves_ + first * stride_, size};
    const Eigen::Map<const RowMatrix<float>, 0, Eigen::OuterStride<>> source(curves_ + first * stride_, count, points_,
                                                                             Eigen::OuterStride<>(stride_));
    copy_.topLeftCorner(count, points_) = source;
    return {copy_.data(), size};
  }

 private:
  const float* curves_;
  Eigen::Index stride_;
  Eigen::Index points_;
  Eigen::Index width_;
  RowMatrix<float> copy_;
};

void add(const RowMatrix<float>& scatters, const RowMatrix<float>& sums, Eigen::Index blocks, const Moments& moments) {
  const Eigen::Index width = scatters.cols();
  for (Eigen::Index b = 0; b < blocks; ++b) {
    moments.sum += sums.row(b).head(moments.sum.size()).cast<double>();
    for (Eigen::Index i = 0; i < moments.scatter.rows(); ++i) {
      moments.scatter.row(i).head(i + 1) += scatters.row(b * width + i).head(i + 1).cast<double>();
    }
  }
}

}  // namespace

void add_on_device(OpenClDevice& device, bool lanes, const float* curves, Eigen::Index stride, Eigen::Index count,
                   const Moments& moments) {
  const Eigen::Index points = moments.shift.size();
  const Eigen::Index width = padded(points);
  Eigen::RowVectorXf shift = Eigen::RowVectorXf::Zero(width);
  shift.head(points) = moments.shift;
  constexpr auto float_bytes = static_cast<Eigen::Index>(sizeof(float));
  const Eigen::Index block_bytes = float_bytes * width * std::max(width, kBlockCurves);
  const Eigen::Index all_blocks = (count + kBlockCurves - 1) / kBlockCurves;
  const Eigen::Index batch = std::min(all_blocks, matrix_opencl::rows_at_a_time(device, block_bytes));
  PaddedCurves padded_curves(curves, stride, points, std::min(count, batch * kBlockCurves));
  RowMatrix<float> scatters(batch * width, width);
  RowMatrix<float> sums(batch, width);
  opencl_call("covariance", [&] {
    const auto options = matrix_opencl::options(lanes);
    auto scatter_kernel = device.kernel(opencl_source::covariance, options, "block_scatter");
    auto sum_kernel = device.kernel(opencl_source::covariance, options, "block_sums");
    const auto queue = device.queue();
    const auto shift_buffer = device.input(numbers(shift));
    const auto scatter_buffer = device.output(std::span(scatters.data(), static_cast<std::size_t>(scatters.size())));
    const auto sum_buffer = device.output(std::span(sums.data(), static_cast<std::size_t>(sums.size())));
    for (Eigen::Index first = 0; first < all_blocks; first += batch) {
      const Eigen::Index blocks = std::min(batch, all_blocks - first);
      const Eigen::Index n = std::min(blocks * kBlockCurves, count - first * kBlockCurves);
      const auto curve_buffer = device.input(padded_curves.rows(first * kBlockCurves, n));
      const auto set = [&](cl::Kernel& kernel, const cl::Buffer& out) {
        set_arguments(kernel, curve_buffer, shift_buffer, static_cast<cl_int>(n), static_cast<cl_int>(kBlockCurves),
                      static_cast<cl_int>(width), out);
      };
      set(scatter_kernel, scatter_buffer);
      set(sum_kernel, sum_buffer);
      const auto range = matrix_opencl::range(lanes, width, width, blocks);
      device.launch(KernelFamily::covariance, queue, scatter_kernel, range.global, range.local);
      device.launch(KernelFamily::covariance, queue, sum_kernel,
                    cl::NDRange(static_cast<std::size_t>(width / 16), static_cast<std::size_t>(blocks)));
      device.fetch(queue, sum_buffer, sums.data(), static_cast<std::size_t>(blocks * width * float_bytes));
      device.fetch(queue, scatter_buffer, scatters.data(),
                   static_cast<std::size_t>(blocks * width * width * float_bytes));
      add(scatters, sums, blocks, moments);
    }
  });
}

}  // namespace kinespace::covariance_detail
