#include "kinespace/motion/error_measures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/motion/euler.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

struct Pair {
  int a = 0;
  int b = 0;
};

// Joints of the same name; of those that come more than once, the n-th of one with the n-th of the other.
std::vector<Pair> common_joints(const Skeleton& a, const Skeleton& b) {
  std::map<std::string_view, std::vector<int>> in_b;
  for (int j = b.joint_count() - 1; j >= 0; --j) in_b[b.joints[static_cast<std::size_t>(j)].name].push_back(j);
  std::vector<Pair> out;
  for (int j = 0; j < a.joint_count(); ++j) {
    const auto found = in_b.find(a.joints[static_cast<std::size_t>(j)].name);
    if (found == in_b.end() || found->second.empty()) continue;
    out.push_back({j, found->second.back()});
    found->second.pop_back();
  }
  return out;
}

// What the measures sum up over frames and joints.
struct Sums {
  double distance = 0;
  double largest = 0;
  double shell = 0;
  double angle = 0;
  double squared = 0;        // ||A - B||^2
  double from_centroid = 0;  // ||A - centroid of the frame||^2
};

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond d = a.conjugate() * b;
  return 2 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

// The largest distance of the three points at shell_cm along the joint's axes: in axis i they are apart by
// (p_a - p_b) + 3 (R_a - R_b) e_i.
double shell_distance(const JointFrame& a, const JointFrame& b) {
  const Eigen::Vector3d apart = a.position - b.position;
  const Eigen::Matrix3d turned = shell_cm * (a.rotation.toRotationMatrix() - b.rotation.toRotationMatrix());
  return (turned.colwise() + apart).colwise().norm().maxCoeff();
}

void add_frame(const std::vector<Pair>& pairs, const std::vector<JointFrame>& a, const std::vector<JointFrame>& b,
               Sums& sums) {
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const Pair& pair : pairs) centroid += a[static_cast<std::size_t>(pair.a)].position;
  centroid /= static_cast<double>(pairs.size());
  for (const Pair& pair : pairs) {
    const JointFrame& ja = a[static_cast<std::size_t>(pair.a)];
    const JointFrame& jb = b[static_cast<std::size_t>(pair.b)];
    const double squared = (ja.position - jb.position).squaredNorm();
    sums.squared += squared;
    sums.distance += std::sqrt(squared);
    sums.largest = std::max(sums.largest, std::sqrt(squared));
    sums.shell += shell_distance(ja, jb);
    sums.angle += angle_between(ja.rotation, jb.rotation);
    sums.from_centroid += (ja.position - centroid).squaredNorm();
  }
}

// ||A - mean over time||^2, by shifted sums so that a body far from the origin loses no digits.
class TimeVariance {
 public:
  TimeVariance(std::size_t joints, std::size_t frames) : first_(joints), sum_(joints), frames_(frames) {}

  void add(std::size_t joint, bool first_frame, const Eigen::Vector3d& position) {
    if (first_frame) {
      first_[joint] = position;
      sum_[joint].setZero();
    }
    const Eigen::Vector3d d = position - first_[joint];
    sum_[joint] += d;
    squares_ += d.squaredNorm();
  }

  [[nodiscard]] double total() const {
    double mean_part = 0;
    for (const Eigen::Vector3d& s : sum_) mean_part += s.squaredNorm() / static_cast<double>(frames_);
    return std::max(0.0, squares_ - mean_part);
  }

 private:
  std::vector<Eigen::Vector3d> first_;
  std::vector<Eigen::Vector3d> sum_;
  double squares_ = 0;
  std::size_t frames_;
};

// 0 for equal clips even where the reference does not vary, infinity for others.
double percent(double squared, double reference) {
  if (squared == 0) return 0;
  return reference > 0 ? 100 * std::sqrt(squared / reference) : std::numeric_limits<double>::infinity();
}

double channel_mse(const Clip& a, const Clip& b, const std::vector<Pair>& pairs) {
  double sum = 0;
  double count = 0;
  for (const Pair& pair : pairs) {
    std::vector<Channel> channels = channels_to_write(a, pair.a);
    if (!a.skeleton.joints[static_cast<std::size_t>(pair.a)].has_rotation()) {
      channels = channels_to_write(b, pair.b);
    }
    EulerOrder order = euler_order(channels);
    if (order.given == 0) continue;
    const int compared = order.given;
    order.given = 3;  // the other clip may turn about an axis that the reference has no channel for
    EulerAngles near{};
    for (int f = 0; f < a.frames; ++f) {
      near = f == 0 ? euler_angles(order, a.rotation(pair.a, f)) : euler_angles(order, a.rotation(pair.a, f), near);
      const EulerAngles other = euler_angles(order, b.rotation(pair.b, f), near);
      for (std::size_t c = 0; c < 3; ++c) sum += (near[c] - other[c]) * (near[c] - other[c]);
    }
    count += compared * static_cast<double>(a.frames);
  }
  return count > 0 ? sum / count : 0;
}

void require_comparable(const Clip& a, const Clip& b, const std::vector<Pair>& pairs) {
  if (a.frames != b.frames) {
    throw Error(ErrorKind::bad_input, {.file = b.name,
                                       .found = std::to_string(b.frames) + " frames",
                                       .expected = std::to_string(a.frames) + " as in " + a.name,
                                       .remedy = "compare clips of the same length and rate"});
  }
  if (pairs.empty()) {
    throw Error(ErrorKind::bad_input, {.file = b.name,
                                       .found = "no joint of a name that " + a.name + " has",
                                       .expected = "skeletons with common joints"});
  }
}

}  // namespace

MotionError compare(const Clip& a, const Clip& b) {
  const std::vector<Pair> pairs = common_joints(a.skeleton, b.skeleton);
  require_comparable(a, b, pairs);
  Sums sums;
  TimeVariance variance(pairs.size(), static_cast<std::size_t>(a.frames));
  std::vector<JointFrame> frame_a;
  std::vector<JointFrame> frame_b;
  for (int f = 0; f < a.frames; ++f) {
    world_frames(a, f, frame_a);
    world_frames(b, f, frame_b);
    add_frame(pairs, frame_a, frame_b, sums);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      variance.add(i, f == 0, frame_a[static_cast<std::size_t>(pairs[i].a)].position);
    }
  }
  const double count = static_cast<double>(pairs.size()) * static_cast<double>(a.frames);
  return {.joints = static_cast<int>(pairs.size()),
          .frames = a.frames,
          .mean_joint_error_cm = sums.distance / count,
          .max_joint_error_cm = sums.largest,
          .shell_error_cm = sums.shell / count,
          .mean_rotation_error_deg = sums.angle / count * 180 / std::numbers::pi,
          .kg = percent(sums.squared, sums.from_centroid),
          .kg_time = percent(sums.squared, variance.total()),
          .channel_mse_deg2 = channel_mse(a, b, pairs)};
}

}  // namespace kinespace
