#include "kinespace/synthesis/window_space.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/fpca/clip_space.h"
#include "kinespace/fpca/motion_space.h"
#include "kinespace/fpca/symmetric_eigen.h"
#include "kinespace/kernels/covariance.h"
#include "kinespace/kernels/projection.h"
#include "kinespace/kernels/simd.h"

namespace kinespace {
namespace {

constexpr int function_windows = 4000;    // enough to find functions of time
constexpr int component_windows = 16000;  // and components of scores
constexpr int window_block = 512;         // windows projected at once

// out (rows x curves) = projector (rows x samples) times in (samples x curves), sums in the order of the samples.
KINESPACE_SIMD_BODY void project_window_body(const float* projector, std::ptrdiff_t rows, std::ptrdiff_t samples,
                                             const float* in, std::ptrdiff_t curves, float* out) {
  for (std::ptrdiff_t r = 0; r < rows; ++r) {
    float* __restrict sum = out + r * curves;
    std::fill(sum, sum + curves, 0.0F);
    for (std::ptrdiff_t s = 0; s < samples; ++s) {
      const float weight = projector[r * samples + s];
      const float* __restrict row = in + s * curves;
      for (std::ptrdiff_t c = 0; c < curves; ++c) sum[c] += weight * row[c];
    }
  }
}
KINESPACE_SIMD(project_window, void,
               (const float* projector, std::ptrdiff_t rows, std::ptrdiff_t samples, const float* in,
                std::ptrdiff_t curves, float* out),
               (projector, rows, samples, in, curves, out))

// The turn about +Y that gives a root orientation heading 0: the quaternion (c, 0, s, 0).
struct Turn {
  float c = 1;
  float s = 0;
};

Turn turn_of(const float* root) {
  const float length = std::hypot(root[0], root[2]);
  if (length < 1e-6F) return {};
  return {root[0] / length, -root[2] / length};
}

// Turns the velocity and the root's quaternion in one row of curves (or of their scores: the turn is linear).
template <typename Row>
void apply(const Turn& turn, Row&& row) {
  const auto cosine = turn.c * turn.c - turn.s * turn.s;
  const auto sine = 2 * turn.c * turn.s;
  const auto vx = row[0];
  const auto vz = row[2];
  row[0] = cosine * vx + sine * vz;
  row[2] = cosine * vz - sine * vx;
  const auto w = row[3];
  const auto x = row[4];
  const auto y = row[5];
  const auto z = row[6];
  row[3] = turn.c * w - turn.s * y;
  row[4] = turn.c * x + turn.s * z;
  row[5] = turn.c * y + turn.s * w;
  row[6] = turn.c * z - turn.s * x;
}

// 1 or -1 by which a joint's quaternions come on the side of its reference: the root's by its first, turned sample,
// others by the window's mean.
float side(const Eigen::Vector4f& q, const Eigen::Vector4f& reference) {
  return q.dot(reference) < 0 ? -1.0F : 1.0F;
}

Eigen::RowVectorXf sides(const float* first, const float* mean, const Turn& turn, const Eigen::Matrix4Xf& references) {
  Eigen::RowVectorXf out = Eigen::RowVectorXf::Ones(3 + 4 * references.cols());
  Eigen::Vector<float, 7> root = Eigen::Map<const Eigen::Vector<float, 7>>(first);
  apply(turn, root);
  out.segment<4>(3).setConstant(side(root.tail<4>(), references.col(0)));
  for (Eigen::Index k = 1; k < references.cols(); ++k) {
    out.segment<4>(3 + 4 * k).setConstant(side(Eigen::Map<const Eigen::Vector4f>(mean + 3 + 4 * k), references.col(k)));
  }
  return out;
}

// A window's curves, turned and on their sides.
SampleMatrix normalised_window(const WindowSamples& stretch, int start, int samples,
                               const Eigen::Matrix4Xf& references) {
  WindowSamples rows = stretch.middleRows(start, samples);
  const Eigen::RowVectorXf mean = rows.colwise().mean();
  const Turn turn = turn_of(rows.row(0).data() + 3);
  const Eigen::RowVectorXf side = sides(rows.row(0).data(), mean.data(), turn, references);
  for (Eigen::Index s = 0; s < samples; ++s) {
    auto row = rows.row(s);
    apply(turn, row);
    row.array() *= side.array();
  }
  return rows.cast<double>();
}

std::int64_t count_windows(std::span<const WindowSamples> stretches, int samples) {
  std::int64_t out = 0;
  for (const WindowSamples& s : stretches) out += std::max<std::int64_t>(0, s.rows() - samples + 1);
  return out;
}

// Calls visit(stretch, first window, count) for the windows 0, every, 2 every, ... counted over all stretches.
template <typename Visit>
void for_each_stretch(std::span<const WindowSamples> stretches, int samples, int every, const Visit& visit) {
  std::int64_t skip = 0;  // windows of the next stretch before its first one looked at
  for (const WindowSamples& stretch : stretches) {
    const std::int64_t windows = std::max<std::int64_t>(0, stretch.rows() - samples + 1);
    if (skip >= windows) {
      skip -= windows;
      continue;
    }
    const std::int64_t count = (windows - skip + every - 1) / every;
    visit(stretch, static_cast<int>(skip), static_cast<int>(count));
    skip += count * every - windows;
  }
}

int every_of(std::int64_t windows, int wanted) {
  return static_cast<int>(std::max<std::int64_t>(1, windows / wanted));
}

}  // namespace

void WindowOptions::validate() const {
  const auto fail = [](const std::string& found, const std::string& expected) {
    throw Error(ErrorKind::usage, {.found = found, .expected = expected});
  };
  if (!(length_s >= 0.1 && length_s <= 20)) fail(fmt::format("length_s = {}", length_s), "0.1 to 20 seconds");
  if (!(rate_hz >= 1 && rate_hz <= 240)) fail(fmt::format("rate_hz = {}", rate_hz), "1 to 240");
  if (samples() < 4) fail(fmt::format("length_s * rate_hz = {}", length_s * rate_hz), "3 or more");
  if (functions < 1 || functions > 64) fail(fmt::format("functions = {}", functions), "1 to 64");
  if (dimensions < 1 || dimensions > 4096) fail(fmt::format("dimensions = {}", dimensions), "1 to 4096");
  if (!(travel_share >= 0 && travel_share <= 10)) fail(fmt::format("travel_share = {}", travel_share), "0 to 10");
}

int WindowOptions::samples() const {
  return static_cast<int>(std::lround(length_s * rate_hz)) + 1;
}

WindowSamples window_samples(const ClipCurves& curves, int first, int last, double start_s,
                             const WindowOptions& options) {
  const UniformSpline spline(curves.values.middleRows(first, last - first + 1));
  const double step = curves.rate_hz / options.rate_hz;
  const double start = start_s * curves.rate_hz - first;
  // Rounding of start_s must not cost the last sample.
  const double rest = (last - first - start) / step + 1e-6;
  const auto count = rest < 0 ? Eigen::Index{0} : static_cast<Eigen::Index>(std::floor(rest)) + 1;
  WindowSamples out(count, spline.curves());
  Eigen::RowVectorXd row(spline.curves());
  for (Eigen::Index i = 0; i < count; ++i) {
    const double x = start + static_cast<double>(i) * step;
    spline.value(x, row);
    spline.derivative(x, row.head<3>());
    row.head<3>() *= curves.rate_hz;
    out.row(i) = row.cast<float>();
  }
  return out;
}

WindowSpace::WindowSpace(WindowOptions options, Eigen::Matrix4Xf references)
    : options_(options), references_(std::move(references)) {}

WindowSpace WindowSpace::fit(std::span<const WindowSamples> stretches, const Skeleton& skeleton,
                             const Eigen::Matrix4Xd& references, const WindowOptions& options) {
  options.validate();
  const std::int64_t windows = count_windows(stretches, options.samples());
  if (windows == 0) {
    throw Error(ErrorKind::usage, {.found = "no stretch of motion as long as a window",
                                   .expected = fmt::format("{} s without a break", options.length_s),
                                   .remedy = "take shorter windows"});
  }
  WindowSpace out(options, references.cast<float>());
  out.fit_functions(stretches, skeleton, every_of(windows, function_windows));
  out.fit_components(stretches, every_of(windows, component_windows));
  return out;
}

void WindowSpace::fit_functions(std::span<const WindowSamples> stretches, const Skeleton& skeleton, int every) {
  const int samples = options_.samples();
  MotionSpace space(skeleton, {.functions = std::min(options_.functions, samples)}, samples);
  const int curves = space.curves();
  std::vector<SampleMatrix> windows;
  for_each_stretch(stretches, samples, every, [&](const WindowSamples& stretch, int first, int count) {
    for (int i = 0; i < count; ++i) {
      windows.push_back(normalised_window(stretch, first + i * every, samples, references_));
    }
  });
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(curves);
  Eigen::RowVectorXd squares = sum;
  for (const SampleMatrix& w : windows) {
    sum += w.colwise().mean();
    squares += w.colwise().squaredNorm() / samples;
  }
  const auto n = static_cast<double>(windows.size());
  const Eigen::RowVectorXd variance = (squares / n - (sum / n).cwiseAbs2()).cwiseMax(0.0);
  scale_ = Eigen::RowVectorXf::Ones(curves);
  if (options_.weighted) {
    const std::vector<float> weights = distance_weights(skeleton);
    scale_ = Eigen::Map<const Eigen::RowVectorXf>(weights.data(), curves);
  }
  const double travel = variance.head<3>().sum();
  const double rotation = variance.tail(curves - 3).sum();
  const double ratio = travel > 0 && rotation > 0 ? std::sqrt(options_.travel_share * rotation / travel) : 1;
  scale_.head<3>() *= static_cast<float>(ratio);

  for (SampleMatrix& w : windows) w.array().rowwise() *= scale_.cast<double>().array();
  std::vector<CurveMoments> moments = space.empty_moments();
  space.accumulate(windows, moments);
  space.fit(std::move(moments));
  const Eigen::MatrixXd& functions = space.groups().front().functions;
  projector_.resize(functions.cols() + 1, samples);
  projector_.row(0).setConstant(1.0F / static_cast<float>(samples));
  projector_.bottomRows(functions.cols()) =
      (functions.array().colwise() * trapezoid_weights(samples, 1.0).array()).matrix().transpose().cast<float>();
}

RowMatrix<float> WindowSpace::scores(const WindowSamples& stretch, int first, int every, int count) const {
  const Eigen::Index curves = stretch.cols();
  const Eigen::Index functions = projector_.rows() - 1;
  RowMatrix<float> out(count, functions * curves);
  RowMatrix<float> raw(functions + 1, curves);
  for (int i = 0; i < count; ++i) {
    const float* start = stretch.row(first + static_cast<Eigen::Index>(i) * every).data();
    project_window(projector_.data(), projector_.rows(), projector_.cols(), start, curves, raw.data());
    const Turn turn = turn_of(start + 3);
    const Eigen::RowVectorXf factor = sides(start, raw.data(), turn, references_).cwiseProduct(scale_);
    for (Eigen::Index k = 0; k < functions; ++k) {
      auto row = raw.row(k + 1);
      apply(turn, row);
      out.row(i).segment(k * curves, curves) = row.cwiseProduct(factor);
    }
  }
  return out;
}

void WindowSpace::fit_components(std::span<const WindowSamples> stretches, int every) {
  const auto size = static_cast<int>((projector_.rows() - 1) * scale_.size());
  CovarianceStream stream(size);
  for_each_stretch(stretches, options_.samples(), every, [&](const WindowSamples& stretch, int first, int count) {
    stream.add(scores(stretch, first, every, count));
  });
  const CurveCovariance moments = stream.result(0);
  SymmetricEigen eigen;
  eigen.decompose(moments.covariance);
  mean_ = moments.mean;
  components_ = eigen.vectors(std::min(options_.dimensions, size));
}

int WindowSpace::windows(Eigen::Index samples) const {
  return static_cast<int>(std::max<Eigen::Index>(0, samples - options_.samples() + 1));
}

RowMatrix<float> WindowSpace::vectors(const WindowSamples& stretch) const {
  const int count = windows(stretch.rows());
  RowMatrix<float> out(count, components_.cols());
  for (int first = 0; first < count; first += window_block) {
    const int n = std::min(window_block, count - first);
    const RowMatrix<double> part = scores(stretch, first, 1, n).cast<double>();
    out.middleRows(first, n) = project(part, mean_, components_).cast<float>();
  }
  return out;
}

}  // namespace kinespace
