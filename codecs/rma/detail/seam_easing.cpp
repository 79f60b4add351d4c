#include "kinespace/codecs/rma/detail/seam_easing.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "kinespace/base/parallel.h"
#include "kinespace/motion/kinematics.h"

namespace kinespace {
namespace {

constexpr std::array reaches_s{0.1, 0.2, 0.4};
constexpr std::array stiffnesses{1.0, 16.0, 256.0, 4096.0};
constexpr double limit_quantile = 0.998;  // of the changes away from seams

// Positions of all joints in a few frames of a clip.
class FramePositions {
 public:
  FramePositions(const Clip& clip, int first, int last) : first_(first) {
    for (int f = first; f <= last; ++f) world_frames(clip, f, frames_.emplace_back());
  }
  // The largest of all joints at a frame that has neighbours.
  [[nodiscard]] double largest_change(int frame) const {
    double out = 0;
    for (std::size_t j = 0; j < frames_.front().size(); ++j) {
      const double after = (at(frame + 1, j) - at(frame, j)).norm();
      const double before = (at(frame, j) - at(frame - 1, j)).norm();
      out = std::max(out, std::abs(after - before));
    }
    return out;
  }

 private:
  [[nodiscard]] const Eigen::Vector3d& at(int frame, std::size_t joint) const {
    return frames_[static_cast<std::size_t>(frame - first_)][joint].position;
  }
  int first_;
  std::vector<std::vector<JointFrame>> frames_;
};

// Symmetric, two bands beside the diagonal; solved for all right sides at once, a column each.
class SmoothingSystem {
 public:
  explicit SmoothingSystem(Eigen::Index size) : bands_(Eigen::Matrix3Xd::Zero(3, size)) {}
  void add(Eigen::Index i, Eigen::Index j, double value) {
    if (j <= i) bands_(i - j, i) += value;
  }
  // Rows of `x` are the right sides before, the solutions after.
  void solve(Eigen::MatrixXd& x) {
    const Eigen::Index n = bands_.cols();
    for (Eigen::Index i = 0; i < n; ++i) {
      double& diagonal = bands_(0, i);
      double& near = bands_(1, i);
      double& far = bands_(2, i);
      if (i >= 2) {
        near -= far * bands_(1, i - 1);
        far /= bands_(0, i - 2);
        diagonal -= far * far * bands_(0, i - 2);
        x.col(i) -= far * x.col(i - 2);
      }
      if (i >= 1) {
        near /= bands_(0, i - 1);
        diagonal -= near * near * bands_(0, i - 1);
        x.col(i) -= near * x.col(i - 1);
      }
    }
    for (Eigen::Index i = n - 1; i >= 0; --i) {
      x.col(i) /= bands_(0, i);
      if (i + 1 < n) x.col(i) -= bands_(1, i + 1) * x.col(i + 1);
      if (i + 2 < n) x.col(i) -= bands_(2, i + 2) * x.col(i + 2);
    }
  }

 private:
  Eigen::Matrix3Xd bands_;  // by unknown: diagonal, to the one before, to the one before that
};

// The curves of a clip around a seam: frames [first, last), of which [from, to) may move.
class SeamWindow {
 public:
  SeamWindow(const Clip& clip, int seam, int reach, int lower, int upper)
      : joints_(clip.skeleton.rotating_joints()), root_(clip.skeleton.travel_root()), seam_(seam) {
    from_ = std::max(lower, seam - reach);
    to_ = std::min(upper, seam + reach);
    first_ = std::max(lower, from_ - 2);
    const int last = std::min(upper, to_ + 2);
    values_.resize(static_cast<Eigen::Index>(4 * joints_.size() + 3), last - first_);
    for (int f = first_; f < last; ++f) load(clip, f);
  }

  void write_smoothed(double stiffness, Clip& clip) const {
    const Eigen::MatrixXd x = smoothed(stiffness);
    for (int f = from_; f < to_; ++f) {
      const auto column = x.col(f - from_);
      for (std::size_t j = 0; j < joints_.size(); ++j) {
        const auto row = static_cast<Eigen::Index>(4 * j);
        Eigen::Vector4d q = column.segment<4>(row);
        // Sides that are half a turn apart meet at nothing: those frames stay.
        if (q.squaredNorm() < 1e-2) q = values_.col(f - first_).segment<4>(row);
        clip.set_rotation(joints_[j], f, Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized());
      }
      if (auto* track = clip.translation_track(root_)) track->values[static_cast<std::size_t>(f)] = column.tail<3>();
    }
  }

 private:
  void load(const Clip& clip, int frame) {
    auto column = values_.col(frame - first_);
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const Eigen::Quaterniond q = clip.rotation(joints_[j], frame);
      Eigen::Vector4d own(q.w(), q.x(), q.y(), q.z());
      const auto row = static_cast<Eigen::Index>(4 * j);
      if (frame > first_ && own.dot(values_.col(frame - first_ - 1).segment<4>(row)) < 0) own = -own;
      column.segment<4>(row) = own;
    }
    column.tail<3>() = clip.translation(root_, frame);
  }
  [[nodiscard]] Eigen::MatrixXd smoothed(double stiffness) const {
    const Eigen::Index count = to_ - from_;
    SmoothingSystem system(count);
    Eigen::MatrixXd x = values_.middleCols(from_ - first_, count);
    for (int f = from_; f < to_; ++f) {
      const double u = (f - (seam_ - 0.5)) / std::max(seam_ - from_, to_ - seam_);
      system.add(f - from_, f - from_, u * u);
      x.col(f - from_) *= u * u;
    }
    constexpr std::array difference{1.0, -2.0, 1.0};
    for (Eigen::Index f = 1; f + 1 < values_.cols(); ++f) {
      for (int a = 0; a < 3; ++a) {
        const Eigen::Index i = f + a - 1 - (from_ - first_);
        if (i < 0 || i >= count) continue;
        for (int b = 0; b < 3; ++b) {
          const Eigen::Index j = f + b - 1 - (from_ - first_);
          const double weight =
              stiffness * difference[static_cast<std::size_t>(a)] * difference[static_cast<std::size_t>(b)];
          if (j >= 0 && j < count) {
            system.add(i, j, weight);
          } else {
            x.col(i) -= weight * values_.col(f + b - 1);
          }
        }
      }
    }
    system.solve(x);
    return x;
  }

  std::vector<int> joints_;
  int root_, seam_, from_ = 0, to_ = 0, first_ = 0;
  Eigen::MatrixXd values_;  // a column for each frame
};

// `most`: frames of reach.
void ease(Clip& clip, int seam, double limit_cm_s, int most, int lower, int upper) {
  for (const double reach_s : reaches_s) {
    const int reach = std::max(3, static_cast<int>(std::min<double>(reach_s * clip.rate_hz, most)));
    const SeamWindow window(clip, seam, reach, lower, upper);
    for (const double stiffness : stiffnesses) {
      window.write_smoothed(stiffness, clip);
      if (speed_change_at_seam(clip, seam) <= limit_cm_s) return;
    }
  }
}

// Counts of speed changes in steps of a 32nd of an octave.
class ChangeCounts {
 public:
  void add(double cm_s) {
    ++counts_[static_cast<std::size_t>(std::clamp(32 * std::log2(std::max(cm_s, 1e-30)) + 256, 0.0, 1023.0))];
  }
  void add(const ChangeCounts& other) {
    for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
  }
  // cm/s, of the lower end of the step that holds it.
  [[nodiscard]] double quantile(double part) const {
    std::int64_t all = 0;
    for (const std::int64_t c : counts_) all += c;
    auto left = static_cast<std::int64_t>(part * static_cast<double>(all));
    std::size_t at = 0;
    while (at + 1 < counts_.size() && left >= counts_[at]) left -= counts_[at++];
    return std::exp2((static_cast<double>(at) - 256) / 32);
  }

 private:
  std::array<std::int64_t, 1024> counts_{};
};

void count_changes(const Clip& clip, std::span<const int> seams, ChangeCounts& counts) {
  constexpr int block = 1024;
  for (int first = 1; first + 1 < clip.frames; first += block) {
    const int last = std::min(first + block, clip.frames - 1);
    const JointPositions p = joint_positions(slice(clip, first - 1, last + 1 - (first - 1)));
    for (int f = first; f < last; ++f) {
      const bool at_seam = std::ranges::binary_search(seams, f) || std::ranges::binary_search(seams, f + 1);
      if (at_seam) continue;
      const int at = f - (first - 1);
      for (int j = 0; j < p.joints; ++j) {
        const double after = (p.at(at + 1, j) - p.at(at, j)).norm();
        const double before = (p.at(at, j) - p.at(at - 1, j)).norm();
        counts.add(std::abs(after - before) * clip.rate_hz);
      }
    }
  }
}

}  // namespace

double speed_change_at_seam(const Clip& clip, int seam) {
  const int first = std::max(0, seam - 2);
  const int last = std::min(clip.frames - 1, seam + 1);
  const FramePositions positions(clip, first, last);
  double out = 0;
  for (int f = std::max(first + 1, seam - 1); f <= std::min(last - 1, seam); ++f) {
    out = std::max(out, positions.largest_change(f));
  }
  return out * clip.rate_hz;
}

void ease_seams(Clip& clip, std::span<const int> seams, double limit_cm_s, std::span<const int> breaks) {
  if (!(limit_cm_s > 0)) return;
  for (std::size_t s = 0; s < seams.size(); ++s) {
    const int seam = seams[s];
    if (speed_change_at_seam(clip, seam) <= limit_cm_s) continue;
    // Twice the way to the seams around it, so that many seams take no longer than many frames.
    const int before = s > 0 ? seams[s - 1] : 0;
    const int after = s + 1 < seams.size() ? seams[s + 1] : clip.frames;
    const int most = 2 * std::max(seam - before, after - seam);
    const auto next = std::ranges::upper_bound(breaks, seam);
    ease(clip, seam, limit_cm_s, most, next == breaks.begin() ? 0 : *(next - 1),
         next == breaks.end() ? clip.frames : *next);
  }
}

EasedError measure_eased(std::span<const Clip> originals, std::span<const ClipSeams> seams,
                         const std::function<Clip(std::size_t)>& decode, const Progress& progress) {
  std::vector<ClipErrorSums> parts(originals.size());
  std::vector<ChangeCounts> counts(originals.size());
  std::vector<double> largest(originals.size(), 0.0);
  const auto error = [&](std::size_t c, const Clip& decoded) {
    parts[c] = clip_error(originals[c], decoded, 0, originals[c].frames, 0);
  };
  parallel_for(std::size_t{0}, originals.size(), [&](std::size_t c) {
    progress.check_stop();
    const Clip decoded = decode(c);
    error(c, decoded);
    count_changes(decoded, seams[c].seams, counts[c]);
    for (const int seam : seams[c].seams) largest[c] = std::max(largest[c], speed_change_at_seam(decoded, seam));
  });
  ChangeCounts all;
  for (const ChangeCounts& one : counts) all.add(one);
  EasedError out;
  if (std::ranges::any_of(largest, [](double change) { return change > 0; })) {
    out.limit_cm_s =
        static_cast<int>(std::clamp(std::floor(all.quantile(limit_quantile)), 1.0, double{most_seam_limit}));
  }
  parallel_for(std::size_t{0}, originals.size(), [&](std::size_t c) {
    if (largest[c] <= out.limit_cm_s) return;
    progress.check_stop();
    Clip decoded = decode(c);
    ease_seams(decoded, seams[c].seams, out.limit_cm_s, seams[c].breaks);
    error(c, decoded);
  });
  for (const ClipErrorSums& part : parts) out.error.add(part);
  return out;
}

}  // namespace kinespace
