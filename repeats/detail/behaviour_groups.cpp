#include "kinespace/repeats/detail/behaviour_groups.h"

#include <algorithm>
#include <limits>

namespace kinespace {
namespace {

// The moments of the union of sets of frames.
class Union {
 public:
  explicit Union(Eigen::Index dimensions)
      : sum_(Eigen::VectorXd::Zero(dimensions)), products_(Eigen::MatrixXd::Zero(dimensions, dimensions)) {}
  void add(const FrameMoments& part) {
    const auto n = static_cast<double>(part.count);
    count_ += part.count;
    sum_ += n * part.mean;
    products_ += n * (part.covariance + part.mean * part.mean.transpose());
  }
  [[nodiscard]] FrameMoments moments() const {
    const double n = static_cast<double>(std::max<std::int64_t>(count_, 1));
    const Eigen::VectorXd mean = sum_ / n;
    return {count_, mean, products_ / n - mean * mean.transpose()};
  }

 private:
  std::int64_t count_ = 0;
  Eigen::VectorXd sum_;
  Eigen::MatrixXd products_;
};

}  // namespace

std::vector<BehaviourGroups::Space> BehaviourGroups::spaces(const std::vector<int>& group) const {
  const Eigen::Index d = moments_.front().mean.size();
  const auto groups = static_cast<std::size_t>(*std::max_element(group.begin(), group.end()) + 1);
  std::vector<Union> unions(groups, Union(d));
  for (std::size_t s = 0; s < group.size(); ++s) unions[static_cast<std::size_t>(group[s])].add(moments_[s]);
  std::vector<Space> out(groups);
  for (std::size_t g = 0; g < groups; ++g) {
    const FrameMoments moments = unions[g].moments();
    out[g].frames = moments.count;
    if (moments.count == 0) continue;
    const PrincipalAxes principal = principal_axes(moments.covariance);
    double rest = principal.variances.sum();
    int axes = 0;
    while (axes < d && (axes == 0 || rest > residual_)) rest -= principal.variances(axes++);
    const auto kept = principal.axes.leftCols(axes);
    out[g].axes = axes;
    out[g].mean = moments.mean;
    out[g].outside = Eigen::MatrixXd::Identity(d, d) - kept * kept.transpose();
  }
  return out;
}

double BehaviourGroups::cost(std::span<const Space> spaces) const {
  double sum = 0;
  for (const Space& space : spaces) {
    const double seconds = static_cast<double>(space.frames) / rate_hz_;
    // The mean posture is one more axis to keep, but has no coefficients.
    if (space.frames > 0) sum += dimensions_ * options_.axis_weight;
    sum += space.axes * (seconds * options_.coefficient_rate + dimensions_ * options_.axis_weight);
  }
  return sum;
}

double BehaviourGroups::cost(const std::vector<int>& group) const {
  return cost(spaces(group));
}

void BehaviourGroups::refine(std::vector<int>& group) const {
  std::vector<Space> now = spaces(group);
  double now_cost = cost(now);
  for (int round = 0; round < options_.refinements; ++round) {
    std::vector<int> moved = group;
    for (std::size_t s = 0; s < group.size(); ++s) {
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t g = 0; g < now.size(); ++g) {
        if (now[g].frames == 0) continue;
        const Eigen::VectorXd off = moments_[s].mean - now[g].mean;
        const double left = now[g].outside.cwiseProduct(moments_[s].covariance).sum() + off.dot(now[g].outside * off);
        if (left >= least) continue;
        least = left;
        moved[s] = static_cast<int>(g);
      }
    }
    if (moved == group) return;
    std::vector<Space> next = spaces(moved);
    const double next_cost = cost(next);
    if (next_cost >= now_cost) return;
    group = std::move(moved);
    now = std::move(next);
    now_cost = next_cost;
  }
}

}  // namespace kinespace
