#include <algorithm>

#include "kinespace/kernels/detail/matrix_opencl.h"
#include "kinespace/kernels/detail/projection.h"

namespace kinespace::projection_detail {

using matrix_opencl::numbers;
using matrix_opencl::padded;

RowMatrix<float> on_device(OpenClDevice& device, bool lanes, const RowMatrixView<float>& a,
                           const Eigen::VectorXf& shift, const RowMatrix<float>& b, const Eigen::VectorXf& offset) {
  const Eigen::Index depth = a.cols();
  const Eigen::Index m = b.cols();
  RowMatrix<float> wide = RowMatrix<float>::Zero(depth, padded(m));
  wide.leftCols(m) = b;
  Eigen::VectorXf wide_offset = Eigen::VectorXf::Zero(padded(m));
  wide_offset.head(m) = offset;
  RowMatrix<float> contiguous;
  if (a.outerStride() != depth) contiguous = a;
  const float* rows = contiguous.size() == 0 ? a.data() : contiguous.data();

  RowMatrix<float> out(a.rows(), m);
  opencl_call("projection", [&] {
    auto kernel = device.kernel(opencl_source::projection, matrix_opencl::options(lanes), "projection");
    const auto queue = device.queue();
    const auto b_buffer = device.input(numbers(wide));
    const auto shift_buffer = device.input(numbers(shift));
    const auto offset_buffer = device.input(numbers(wide_offset));
    const Eigen::Index step =
        matrix_opencl::rows_at_a_time(device, static_cast<Eigen::Index>(sizeof(float)) * std::max(m, depth));
    for (Eigen::Index first = 0; first < out.rows(); first += step) {
      const auto n = std::min(step, out.rows() - first);
      const auto a_buffer = device.input(std::span(rows + first * depth, static_cast<std::size_t>(n * depth)));
      const auto out_buffer = device.output(std::span(out.data() + first * m, static_cast<std::size_t>(n * m)));
      set_arguments(kernel, a_buffer, b_buffer, shift_buffer, offset_buffer, static_cast<cl_int>(n),
                    static_cast<cl_int>(m), static_cast<cl_int>(depth), static_cast<cl_int>(wide.cols()), out_buffer);
      const auto range = matrix_opencl::range(lanes, n, m);
      device.launch(KernelFamily::projection, queue, kernel, range.global, range.local);
      device.fetch(queue, out_buffer, out.data() + first * m, static_cast<std::size_t>(n * m) * sizeof(float));
    }
  });
  return out;
}

}  // namespace kinespace::projection_detail
