#include "kinespace/codecs/rma/root_alignment.h"

#include <algorithm>

#include "kinespace/codecs/stream/natural_functions.h"

namespace kinespace {
namespace {

Eigen::Vector3d parameters_at(const PoseVectors& vectors, int first_dimension, std::size_t frame) {
  return {vectors.curve(first_dimension)[frame], vectors.curve(first_dimension + 1)[frame],
          vectors.curve(first_dimension + 2)[frame]};
}

}  // namespace

Eigen::Quaterniond from_rodrigues(const Eigen::Vector3d& m) {
  const double square = (m.x() * m.x() + m.y() * m.y() + m.z() * m.z()) * 0.0625;
  const double inverse = 1 / (1 + square);
  const double half = 0.5 * inverse;
  return {(1 - square) * inverse, half * m.x(), half * m.y(), half * m.z()};
}

int alignment_degrees(const PoseVectors& vectors, const ReferencePose& reference) {
  constexpr double leaning = 0.5;  // cosine of 60 degrees
  constexpr int share = 20;
  // The direction of the root that is up in the reference pose.
  const Eigen::Quaterniond q = reference.orientation(0);
  const Eigen::Vector3d own_up = q.conjugate() * Eigen::Vector3d::UnitY();
  int leans = 0;
  for (int f = 0; f < vectors.frames; ++f) {
    const Eigen::Quaterniond tilt = from_rodrigues(parameters_at(vectors, 4, static_cast<std::size_t>(f)));
    leans += (q * (tilt * own_up)).y() < leaning ? 1 : 0;
  }
  return leans > vectors.frames / share ? 6 : 4;
}

RootAlignment root_alignment(const PoseVectors& vectors, int degrees) {
  RootAlignment out{.degrees = degrees, .frames = vectors.frames, .curves = {}};
  const auto count = RootAlignment::curve_count(degrees);
  out.curves.reserve(static_cast<std::size_t>(count) * static_cast<std::size_t>(vectors.frames));
  for (int c = 0; c < count; ++c) {
    const auto curve = vectors.curve(c);
    out.curves.insert(out.curves.end(), curve.begin(), curve.end());
  }
  return out;
}

RigidFrame alignment_frame(std::span<const double> values, const ReferencePose& reference) {
  double sine = 0, cosine = 0;
  fixed_sin_cos(values[3] / 2, sine, cosine);
  RigidFrame out{.turn = Eigen::Quaterniond(cosine, 0, sine, 0), .position = {values[0], values[1], values[2]}};
  if (values.size() < 7) return out;
  const Eigen::Quaterniond upright = reference.orientation(0);
  const Eigen::Quaterniond tilt = from_rodrigues({values[4], values[5], values[6]});
  out.turn = out.turn * (upright * (tilt * upright.conjugate()));
  return out;
}

}  // namespace kinespace
