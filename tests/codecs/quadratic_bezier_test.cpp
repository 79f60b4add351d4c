// Quadratic Bezier break-and-fit against its plain definition, and its promises.
#include "kinespace/codecs/qbc/quadratic_bezier.h"

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "kinespace/base/error.h"
#include "kinespace/codecs/stream/joint_channels.h"
#include "kinespace/motion/read.h"
#include "tests/support/data.h"

namespace kinespace {
namespace {

using test::data_folder;

// [dimension][frame]
std::vector<double> waves(int dimensions, int frames) {
  std::vector<double> out;
  for (int d = 0; d < dimensions; ++d) {
    for (int f = 0; f < frames; ++f) out.push_back(30 * std::sin(0.02 * f * (d + 1)) + 8 * std::cos(0.11 * f + d));
  }
  return out;
}

// The algorithm as the paper lists it: all segments fitted anew after every break, the worst of all broken next.
std::vector<int> plain_breaks(const std::vector<double>& values, int dimensions, double limit, int interval) {
  const int frames = static_cast<int>(values.size()) / dimensions;
  std::vector<int> breaks;
  for (int f = 0; f < frames - 1; f += interval) breaks.push_back(f);
  breaks.push_back(frames - 1);
  for (;;) {
    double largest = 0;
    int worst = 0;
    for (std::size_t s = 0; s + 1 < breaks.size(); ++s) {
      const int first = breaks[s], length = breaks[s + 1] - first;
      if (length < 3) continue;
      Eigen::VectorXd w(length - 1);
      Eigen::MatrixXd rest(length - 1, dimensions);
      for (int i = 1; i < length; ++i) {
        const double t = static_cast<double>(i) / length;
        w[i - 1] = 2 * t * (1 - t);
        for (int d = 0; d < dimensions; ++d) {
          const double* v = values.data() + d * frames + first;
          rest(i - 1, d) = v[i] - (1 - t) * (1 - t) * v[0] - t * t * v[length];
        }
      }
      const Eigen::MatrixXd p1 = w.colPivHouseholderQr().solve(rest);
      const Eigen::VectorXd distance = (rest - w * p1).rowwise().squaredNorm();
      for (int i = 1; i < length; ++i) {
        if (distance[i - 1] > largest) {
          largest = distance[i - 1];
          worst = first + i;
        }
      }
    }
    if (largest <= limit) return breaks;
    breaks.insert(std::ranges::upper_bound(breaks, worst), worst);
  }
}

TEST(QuadraticBezier, breaks_where_the_paper_does) {
  for (const int dimensions : {1, 2, 3, 6}) {
    for (const double limit : {0.01, 1.0, 20.0}) {
      const auto values = waves(dimensions, 311);
      const BezierCurve curve =
          fit_quadratic_bezier(values, dimensions, {.max_squared_distance = limit, .interval = 80});
      EXPECT_EQ(curve.breaks, plain_breaks(values, dimensions, limit, 80)) << dimensions << " " << limit;
      EXPECT_LE(max_squared_distance(curve, values), limit * (1 + 1e-12));
    }
  }
}

TEST(QuadraticBezier, every_interval_has_its_break_and_breaks_lie_on_the_data) {
  const auto values = waves(2, 500);
  const BezierCurve curve = fit_quadratic_bezier(values, 2, {.max_squared_distance = 1e9, .interval = 120});
  EXPECT_EQ(curve.breaks, (std::vector<int>{0, 120, 240, 360, 480, 499}));
  for (std::size_t b = 0; b < curve.breaks.size(); ++b) {
    EXPECT_EQ(curve.ends[2 * b], values[static_cast<std::size_t>(curve.breaks[b])]);
  }
}

TEST(QuadraticBezier, few_points_and_parabolas_are_exact) {
  for (const int frames : {1, 2, 3}) {
    const auto values = waves(3, frames);
    const BezierCurve curve = fit_quadratic_bezier(values, 3, {.max_squared_distance = 1e-9});
    EXPECT_EQ(curve.segments(), frames > 1 ? 1 : 0);
    EXPECT_LT(max_squared_distance(curve, values), 1e-20);
  }
  std::vector<double> parabola;
  for (int f = 0; f < 70; ++f) parabola.push_back(3 - 0.5 * f + 0.02 * f * f);
  const BezierCurve curve = fit_quadratic_bezier(parabola, 1, {.max_squared_distance = 1e-9});
  EXPECT_EQ(curve.segments(), 1);
  EXPECT_LT(max_squared_distance(curve, parabola), 1e-18);
}

TEST(QuadraticBezier, parts_equal_the_whole) {
  const auto values = waves(2, 200);
  const BezierCurve curve = fit_quadratic_bezier(values, 2, {.max_squared_distance = 2, .interval = 50});
  std::vector<double> whole(400), part(2 * 37);
  evaluate(curve, 0, 200, whole);
  for (const int first : {0, 1, 49, 50, 51, 163}) {
    evaluate(curve, first, 37, part);
    for (std::size_t i = 0; i < 37; ++i) {
      EXPECT_EQ(part[i], whole[static_cast<std::size_t>(first) + i]);
      EXPECT_EQ(part[37 + i], whole[200 + static_cast<std::size_t>(first) + i]);
    }
  }
}

TEST(QuadraticBezier, options_out_of_range_are_named) {
  EXPECT_THROW(static_cast<void>(fit_quadratic_bezier(waves(1, 5), 1, {.max_squared_distance = 0})), Error);
  EXPECT_THROW(static_cast<void>(fit_quadratic_bezier(waves(1, 5), 1, {.interval = 0})), Error);
}

TEST(QuadraticBezier, a_recording_is_fitted_within_the_limit_in_a_few_passes) {
  KINESPACE_REQUIRE_FOLDER(data, data_folder);
  const Clip clip = read_clip(data / "cmu" / "01" / "01_01.amc");
  const ChannelLayout layout = find_channel_layout(std::span(&clip, 1));
  const ChannelCurves curves = channel_curves(clip, layout);
  const auto n = static_cast<std::size_t>(clip.frames);
  std::int64_t fitted = 0;
  std::int64_t joints = 0;
  for (const JointFreedom& joint : layout.joints) {
    if (joint.turns == 0) continue;
    const auto values =
        std::span(curves.values)
            .subspan(static_cast<std::size_t>(joint.first_channel) * n, static_cast<std::size_t>(joint.turns) * n);
    const BezierCurve curve = fit_quadratic_bezier(values, joint.turns);
    EXPECT_LE(max_squared_distance(curve, values), 18 * (1 + 1e-12));
    fitted += curve.fitted;
    ++joints;
  }
  EXPECT_LT(fitted, 8 * joints * clip.frames);
}

TEST(QuadraticBezier, ten_times_the_frames_take_ten_times_the_fitting) {
  const BezierFitOptions options{.max_squared_distance = 0.01};
  const auto fitted = [&](int frames) { return fit_quadratic_bezier(waves(2, frames), 2, options).fitted; };
  EXPECT_GT(fitted(2000), 2 * 2000);
  EXPECT_LT(fitted(20'000), 11 * fitted(2000));
}

}  // namespace
}  // namespace kinespace
