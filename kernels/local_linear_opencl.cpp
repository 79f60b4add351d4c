// The OpenCL forms of local_linear.h: in double where the device has it, else in float.
#include <algorithm>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "kinespace/kernels/detail/matrix_opencl.h"
#include "kinespace/kernels/local_linear.h"

namespace kinespace {
namespace {

constexpr int kWidth = 16;

int padded_to_width(int count) {
  return (count + kWidth - 1) / kWidth * kWidth;
}

template <typename T>
std::string build_options(bool lanes, SmoothingKernel kernel) {
  const std::string real = std::is_same_v<T, double> ? "-DREAL=double -DWITH_DOUBLE" : "-DREAL=float";
  return real + " -DWIDTH=" + (lanes ? "16" : "1") + " -DKERNEL=" + std::to_string(static_cast<int>(kernel));
}

cl::NDRange items(bool lanes, int count, int rows = 1) {
  const int width = lanes ? kWidth : 1;
  return {static_cast<std::size_t>((count + width - 1) / width), static_cast<std::size_t>(rows)};
}

template <typename T>
using Numbers = RowMatrix<T>;

// Rows of `stride` numbers, the table in their left part.
template <typename T, typename Table>
Numbers<T> widened(const Table& table, int stride) {
  Numbers<T> out = Numbers<T>::Zero(table.rows(), stride);
  out.leftCols(table.cols()) = table.template cast<T>();
  return out;
}

template <typename T>
cl::Buffer input(const OpenClDevice& device, const Numbers<T>& numbers) {
  return device.input(std::span<const T>(numbers.data(), static_cast<std::size_t>(numbers.size())));
}

// What a smoother holds, as the kernels take it.
struct SurfaceTables {
  const RowMatrix<double>& weight;  // out_points x points
  const RowMatrix<double>& weight_u;
  const RowMatrix<double>& constant_share;  // out_points x out_points
  const RowMatrix<double>& slope_share;
  std::vector<cl_int2> bands;
};

template <typename T>
void smooth_surface(OpenClDevice& device, bool lanes, const SurfaceTables& tables, const Eigen::MatrixXd& surface,
                    Eigen::MatrixXd& out) {
  const auto points = static_cast<int>(tables.weight.cols());
  const auto out_points = static_cast<int>(tables.weight.rows());
  const int stride = padded_to_width(out_points);
  const auto weight = widened<T>(tables.weight.transpose(), stride);
  const auto weight_u = widened<T>(tables.weight_u.transpose(), stride);
  const Numbers<T> constant_share = tables.constant_share.template cast<T>();
  const Numbers<T> slope_share = tables.slope_share.template cast<T>();
  const Numbers<T> columns = surface.transpose().template cast<T>();
  Numbers<T> result(out_points, out_points);
  const auto options = build_options<T>(lanes, SmoothingKernel::epanechnikov);  // the weights are in the tables
  const auto columns_kernel = [&](const char* name) {
    return device.kernel(opencl_source::local_linear, options, name);
  };
  opencl_call("local linear surface", [&] {
    auto smooth_columns = columns_kernel("smooth_columns");
    auto smooth_rows = columns_kernel("smooth_rows");
    auto combine = columns_kernel("combine");
    const auto queue = device.queue();
    const auto bands = device.input(std::span<const cl_int2>(tables.bands));
    const auto weights = input(device, weight);
    const auto weights_u = input(device, weight_u);
    const auto surface_buffer = input(device, columns);
    const auto constant_buffer = input(device, constant_share);
    const auto slope_buffer = input(device, slope_share);
    const auto half = device.scratch(static_cast<std::size_t>(points) * stride * sizeof(T));
    const auto sum = device.scratch(static_cast<std::size_t>(out_points) * stride * sizeof(T));
    const auto sum_u = device.scratch(static_cast<std::size_t>(out_points) * stride * sizeof(T));
    const auto out_buffer = device.output(std::span(result.data(), static_cast<std::size_t>(result.size())));
    set_arguments(smooth_columns, surface_buffer, weights, bands, cl_int{points}, cl_int{out_points}, cl_int{stride},
                  half);
    set_arguments(smooth_rows, half, weights, weights_u, bands, cl_int{stride}, sum, sum_u);
    set_arguments(combine, sum, sum_u, constant_buffer, slope_buffer, cl_int{out_points}, cl_int{stride}, out_buffer);
    device.launch(KernelFamily::local_linear, queue, smooth_columns, items(lanes, out_points, points));
    device.launch(KernelFamily::local_linear, queue, smooth_rows, items(lanes, out_points, out_points));
    device.launch(KernelFamily::local_linear, queue, combine, items(false, out_points, out_points));
    device.fetch(queue, out_buffer, result.data(), static_cast<std::size_t>(result.size()) * sizeof(T));
  });
  out = result.template cast<double>();
}

struct LineFit {
  std::vector<double> values;
  double least_regularity = 0;  // of all fits
};

template <typename T>
LineFit fit_line(OpenClDevice& device, bool lanes, std::span<const double> values, std::span<const double> weights,
                 SmoothingKernel kernel, double bandwidth, std::span<const double> at) {
  const auto count = static_cast<int>(at.size());
  const std::vector<T> value_numbers(values.begin(), values.end());
  std::vector<T> weight_numbers(weights.begin(), weights.end());
  weight_numbers.resize(values.size(), weights.empty() ? T{1} : T{0});
  std::vector<T> places(at.begin(), at.end());
  places.resize(static_cast<std::size_t>(padded_to_width(count)), static_cast<T>(at.back()));
  std::vector<T> fitted(places.size());
  std::vector<T> regularity(places.size());
  opencl_call("local linear line", [&] {
    auto local_line = device.kernel(opencl_source::local_linear, build_options<T>(lanes, kernel), "local_line");
    const auto queue = device.queue();
    const auto value_buffer = device.input(std::span<const T>(value_numbers));
    const auto weight_buffer = device.input(std::span<const T>(weight_numbers));
    const auto place_buffer = device.input(std::span<const T>(places));
    const auto out_buffer = device.output(std::span<T>(fitted));
    const auto regularity_buffer = device.output(std::span<T>(regularity));
    set_arguments(local_line, value_buffer, weight_buffer, place_buffer, static_cast<cl_int>(values.size()),
                  static_cast<T>(bandwidth), out_buffer, regularity_buffer);
    device.launch(KernelFamily::local_linear, queue, local_line, items(lanes, static_cast<int>(places.size())));
    device.fetch(queue, out_buffer, fitted.data(), fitted.size() * sizeof(T));
    device.fetch(queue, regularity_buffer, regularity.data(), regularity.size() * sizeof(T));
  });
  LineFit fit{.values = {fitted.begin(), fitted.begin() + count}, .least_regularity = 1};
  for (int i = 0; i < count; ++i) {
    const auto one = static_cast<double>(regularity[i]);
    fit.least_regularity = one >= fit.least_regularity ? fit.least_regularity : one;  // not-a-number stays
  }
  return fit;
}

}  // namespace

void LocalLinearSurface::smooth(const Eigen::MatrixXd& surface, Eigen::MatrixXd& out, const Compute& compute) {
  const double per_row = static_cast<double>(points_) + out_points_;
  auto* device = compute.device_for(KernelFamily::local_linear, 4.0 * points_ * out_points_ * per_row);
  if (device == nullptr) {
    smooth(surface, out);
    return;
  }
  SurfaceTables tables{.weight = weight_,
                       .weight_u = weight_u_,
                       .constant_share = constant_share_,
                       .slope_share = slope_share_,
                       .bands = {}};
  for (const Band& band : bands_) tables.bands.push_back({{band.first, band.last}});
  Eigen::MatrixXd source = surface;
  if (diagonal_ == Diagonal::left_out) source.diagonal().setZero();
  const bool lanes = compute.uses_lanes(*device);
  if (compute.uses_double(*device)) {
    smooth_surface<double>(*device, lanes, tables, source, out);
  } else {
    smooth_surface<float>(*device, lanes, tables, source, out);
  }
}

std::vector<double> local_linear_line(std::span<const double> values, std::span<const double> weights,
                                      SmoothingKernel kernel, double bandwidth, std::span<const double> at,
                                      const Compute& compute) {
  const double flops = 12.0 * static_cast<double>(values.size()) * static_cast<double>(at.size());
  auto* device = compute.device_for(KernelFamily::local_linear, flops);
  const bool fits = values.size() >= 2 && bandwidth > 0 && (weights.empty() || weights.size() == values.size());
  if (device == nullptr || at.empty() || !fits) return local_linear_line(values, weights, kernel, bandwidth, at);
  const bool lanes = compute.uses_lanes(*device);
  const bool fp64 = compute.uses_double(*device);
  auto fit = fp64 ? fit_line<double>(*device, lanes, values, weights, kernel, bandwidth, at)
                  : fit_line<float>(*device, lanes, values, weights, kernel, bandwidth, at);
  // Windows that are nearly empty are the plain code's to judge.
  if (!(fit.least_regularity > (fp64 ? 1e-9 : 1e-4))) {
    compute.count_on_processor(KernelFamily::local_linear);
    return local_linear_line(values, weights, kernel, bandwidth, at);
  }
  return std::move(fit.values);
}

}  // namespace kinespace
