#include <algorithm>

#include "kinespace/kernels/detail/keyframe_distance.h"
#include "kinespace/kernels/detail/matrix_opencl.h"

namespace kinespace::keyframe_detail {

using matrix_opencl::numbers;
using matrix_opencl::padded;

RowMatrix<float> on_device(OpenClDevice& device, bool lanes, const Factors& factors, DistanceKind kind) {
  const Eigen::Index m = factors.b.rows();
  const Eigen::Index d = factors.b.cols();
  RowMatrix<float> turned = RowMatrix<float>::Zero(d, padded(m));
  turned.leftCols(m) = factors.b.transpose();
  Eigen::VectorXf b_norms = Eigen::VectorXf::Zero(padded(m));
  b_norms.head(m) = factors.b_norms;

  RowMatrix<float> out(factors.a.rows(), m);
  opencl_call("keyframe distances", [&] {
    auto kernel = device.kernel(opencl_source::keyframe_distance, matrix_opencl::options(lanes), "keyframe_distance");
    const auto queue = device.queue();
    const auto b_buffer = device.input(numbers(turned));
    const auto b_norm_buffer = device.input(numbers(b_norms));
    const Eigen::Index step =
        matrix_opencl::rows_at_a_time(device, static_cast<Eigen::Index>(sizeof(float)) * std::max(m, d));
    for (Eigen::Index first = 0; first < out.rows(); first += step) {
      const auto n = std::min(step, out.rows() - first);
      const auto a_buffer = device.input(std::span(factors.a.data() + first * d, static_cast<std::size_t>(n * d)));
      const auto a_norm_buffer = device.input(std::span(factors.a_norms.data() + first, static_cast<std::size_t>(n)));
      const auto out_bytes = static_cast<std::size_t>(n * m) * sizeof(float);
      const auto out_buffer = device.output(std::span(out.data() + first * m, static_cast<std::size_t>(n * m)));
      set_arguments(kernel, a_buffer, b_buffer, static_cast<cl_int>(n), static_cast<cl_int>(m), static_cast<cl_int>(d),
                    static_cast<cl_int>(turned.cols()), a_norm_buffer, b_norm_buffer,
                    cl_int{kind == DistanceKind::squared}, out_buffer);
      const auto range = matrix_opencl::range(lanes, n, m);
      device.launch(KernelFamily::keyframe_distances, queue, kernel, range.global, range.local);
      device.fetch(queue, out_buffer, out.data() + first * m, out_bytes);
    }
  });
  return out;
}

}  // namespace kinespace::keyframe_detail
