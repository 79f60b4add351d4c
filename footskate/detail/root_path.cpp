#include "kinespace/footskate/detail/root_path.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

namespace kinespace {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double smooth_s = 0.09;
constexpr double home = 0.05;      // weight of staying where the root was
constexpr double along_leg = 2;    // weight of a leg's reach, where 1 is that of the ankle's place
constexpr double stretched = 200;  // the same of a leg that would be too long
constexpr int rounds = 6;
constexpr double longest = 0.99;  // share of the leg

// The quadratic form sum over frames of (u - a)' W (u - a), as W and W a.
struct Pull {
  Matrix3d weight = home * Matrix3d::Identity();
  Vector3d moment = Vector3d::Zero();

  void add(const Matrix3d& w, const Vector3d& wish) {
    weight += w;
    moment += w * wish;
  }
};

// The minimum of the pulls and of smooth_s^6 |u'''|^2.
std::vector<Vector3d> smoothest_of_all(std::span<const Pull> pulls, double rate_hz) {
  const int frames = static_cast<int>(pulls.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(pulls.size() * (9 + 48));
  Eigen::VectorXd right(3 * frames);
  for (int f = 0; f < frames; ++f) {
    right.segment<3>(3 * f) = pulls[f].moment;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) entries.emplace_back(3 * f + r, 3 * f + c, pulls[f].weight(r, c));
    }
  }
  const double stiff = std::pow(smooth_s * rate_hz, 6);
  constexpr std::array<double, 4> third = {-1, 3, -3, 1};
  for (int f = 0; f + 3 < frames; ++f) {
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b) {
        for (int c = 0; c < 3; ++c) {
          entries.emplace_back(3 * (f + a) + c, 3 * (f + b) + c, stiff * third[a] * third[b]);
        }
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(3 * frames, 3 * frames);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>> solver(matrix);
  const Eigen::VectorXd u = solver.solve(right);
  std::vector<Vector3d> out;
  for (int f = 0; f < frames; ++f) out.emplace_back(u.segment<3>(3 * f));
  return out;
}

class RootPath {
 public:
  RootPath(const FootTracks& tracks, const std::array<FootTask, 2>& tasks) : t_(tracks), tasks_(tasks) {
    for (int leg = 0; leg < 2; ++leg) over_[leg].assign(t_.frames, 0);
  }

  std::vector<Vector3d> solve() {
    std::vector<Vector3d> shift(t_.frames, Vector3d::Zero());
    for (int round = 0; round < rounds; ++round) {
      shift = smoothest(shift);
      mark_stretched(shift);
    }
    return shift;
  }

 private:
  // The equations of a long clip take kilobytes a frame, so they are solved part by part, each with so much to both
  // sides that what lies beyond moves it by less than 1e-9 of its shift: an influence falls to a tenth in 0.7 s.
  [[nodiscard]] std::vector<Vector3d> smoothest(const std::vector<Vector3d>& shift) const {
    constexpr int ordinary_frames = 10'000;
    constexpr int part_frames = 8192;
    if (t_.frames <= ordinary_frames) return smoothest_of_all(pulls(shift, 0, t_.frames), t_.rate_hz);
    const int margin = static_cast<int>(std::ceil(8 * t_.rate_hz));
    std::vector<Vector3d> out;
    out.reserve(shift.size());
    for (int first = 0; first < t_.frames; first += part_frames) {
      const int last = std::min(t_.frames, first + part_frames);
      const int from = std::max(0, first - margin);
      const int to = std::min(t_.frames, last + margin);
      const std::vector<Vector3d> part = smoothest_of_all(pulls(shift, from, to), t_.rate_hz);
      out.insert(out.end(), part.begin() + (first - from), part.begin() + (last - from));
    }
    return out;
  }

  // Of the frames [from, to).
  [[nodiscard]] std::vector<Pull> pulls(const std::vector<Vector3d>& shift, int from, int to) const {
    std::vector<Pull> out(to - from);
    for (int leg = 0; leg < 2; ++leg) {
      for (int f = from; f < to; ++f) {
        if (tasks_[leg].planted[f] == 0) continue;
        const Vector3d way = way_after(leg, f, shift);
        const Vector3d along = way.normalized();
        const Matrix3d axis = along * along.transpose();
        const double keep = along_leg * straightness(leg, f);
        Pull& pull = out[f - from];
        pull.add(Matrix3d::Identity(), tasks_[leg].displacement[f]);
        pull.add(keep * axis, shift[f] + along * (way.norm() - reach(leg, f)));
        if (over_[leg][f] != 0) pull.add(stretched * axis, shift[f] + along * (way.norm() - limit(leg, f)));
      }
    }
    return out;
  }

  // Marks the legs that are too long after the shift.
  void mark_stretched(const std::vector<Vector3d>& shift) {
    for (int leg = 0; leg < 2; ++leg) {
      for (int f = 0; f < t_.frames; ++f) {
        if (tasks_[leg].planted[f] != 0 && way_after(leg, f, shift).norm() > limit(leg, f) + 1e-4) over_[leg][f] = 1;
      }
    }
  }

  // From hip to ankle.
  [[nodiscard]] Vector3d way_after(int leg, int f, const std::vector<Vector3d>& shift) const {
    return t_.at[2 * leg][f] + tasks_[leg].displacement[f] - t_.hip[leg][f] - shift[f];
  }
  [[nodiscard]] double length(int leg, int f) const {
    return (t_.knee[leg][f] - t_.hip[leg][f]).norm() + (t_.at[2 * leg][f] - t_.knee[leg][f]).norm();
  }
  [[nodiscard]] double reach(int leg, int f) const { return (t_.at[2 * leg][f] - t_.hip[leg][f]).norm(); }
  [[nodiscard]] double limit(int leg, int f) const { return std::max(longest * length(leg, f), reach(leg, f)); }
  // By how much a change of the reach moves the knee, squared, against a leg bent at a right angle.
  [[nodiscard]] double straightness(int leg, int f) const {
    const double share = reach(leg, f) / length(leg, f);
    return 1 / (1 - share * share + 0.01);
  }

  const FootTracks& t_;
  const std::array<FootTask, 2>& tasks_;
  std::array<std::vector<char>, 2> over_;
};

}  // namespace

std::vector<Vector3d> root_shift(const FootTracks& tracks, const std::array<FootTask, 2>& tasks) {
  return RootPath(tracks, tasks).solve();
}

}  // namespace kinespace
