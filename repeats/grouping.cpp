#include "kinespace/repeats/grouping.h"

#include <algorithm>
#include <limits>

#include <Eigen/Core>

#include "kinespace/base/parallel.h"
#include "kinespace/repeats/detail/behaviour_groups.h"
#include "kinespace/repeats/detail/frame_moments.h"
#include "kinespace/repeats/detail/normalised_cut.h"
#include "kinespace/repeats/detail/option_range.h"

namespace kinespace {
namespace {

// Numbers that the frames keep while they are grouped.
constexpr int working_dimensions = 32;

// What equation 1 compares of a segment.
struct Signature {
  Eigen::MatrixXf components;  // [dimension][p], each times the root of its weight
  Eigen::VectorXf mean;        // normalised
};

Signature signature_of(const FrameMoments& moments, const Eigen::VectorXd& origin, const GroupingOptions& options) {
  const PrincipalAxes principal = principal_axes(moments.covariance);
  const int count = std::min<int>(options.components, static_cast<int>(principal.axes.cols()));
  Signature out{principal.axes.leftCols(count).cast<float>(), (moments.mean - origin).normalized().cast<float>()};
  double sum = 0;
  for (int p = 0; p < count; ++p) sum += std::ldexp(1.0, -p);
  for (int p = 0; p < count; ++p) {
    // A component without variance is no direction at all.
    const bool real = principal.variances(p) > 1e-9 * std::max(principal.variances.sum(), 1e-9);
    out.components.col(p) *= real ? static_cast<float>(std::sqrt(std::ldexp(1.0, -p) / sum)) : 0.0F;
  }
  return out;
}

float affinity(const Signature& a, const Signature& b, float alpha) {
  float components = 0;
  for (Eigen::Index p = 0; p < a.components.cols(); ++p) {
    components += std::abs(a.components.col(p).dot(b.components.col(p)));
  }
  return std::max(alpha * components + (1 - alpha) * a.mean.dot(b.mean), 0.0F);
}

Eigen::MatrixXf affinities(std::span<const FrameMoments> moments, const Eigen::VectorXd& origin,
                           const GroupingOptions& options) {
  std::vector<Signature> signatures(moments.size());
  parallel_for(std::size_t{0}, moments.size(),
               [&](std::size_t s) { signatures[s] = signature_of(moments[s], origin, options); });
  const auto count = static_cast<Eigen::Index>(moments.size());
  Eigen::MatrixXf out(count, count);
  parallel_for(Eigen::Index{0}, count, [&](Eigen::Index c) {
    for (Eigen::Index r = 0; r < count; ++r) {
      out(r, c) = affinity(signatures[static_cast<std::size_t>(r)], signatures[static_cast<std::size_t>(c)],
                           static_cast<float>(options.alpha));
    }
  });
  return out;
}

std::vector<int> renumbered(std::vector<int> group, int& groups) {
  std::vector<int> number;
  groups = 0;
  for (int& g : group) {
    if (static_cast<std::size_t>(g) >= number.size()) number.resize(static_cast<std::size_t>(g) + 1, -1);
    int& mine = number[static_cast<std::size_t>(g)];
    if (mine < 0) mine = groups++;
    g = mine;
  }
  return group;
}

}  // namespace

void GroupingOptions::validate() const {
  require_option("alpha", alpha, 0, 1);
  require_option("components", components, 1, 20);
  require_option("max_groups", max_groups, 1, 64);
  require_option("variance", variance, 0.5, 0.9999);
  require_option("coefficient_rate", coefficient_rate, 1e-6, 1e6);
  require_option("axis_weight", axis_weight, 1e-6, 1e6);
  require_option("refinements", refinements, 0, 100);
}

std::vector<FrameSpan> SegmentGrouping::ranges(int wanted, const FrameTable& table) const {
  std::vector<FrameSpan> out;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    if (group[s] != wanted) continue;
    const bool starts = std::binary_search(table.starts.begin(), table.starts.end(), segments[s].first);
    if (!starts && !out.empty() && out.back().last == segments[s].first) {
      out.back().last = segments[s].last;
    } else {
      out.push_back(segments[s]);
    }
  }
  return out;
}

SegmentGrouping group_segments(const FrameTable& table, std::span<const FrameSpan> segments,
                               const GroupingOptions& options) {
  options.validate();
  SegmentGrouping out;
  out.segments.assign(segments.begin(), segments.end());
  out.group.assign(segments.size(), 0);
  out.groups = segments.empty() ? 0 : 1;
  const int most = std::min<int>(options.max_groups, static_cast<int>(segments.size()));
  if (most <= 1) return out;

  const FrameTable reduced = reduced_table(table, working_dimensions);
  std::vector<FrameMoments> moments(segments.size());
  parallel_for(std::size_t{0}, segments.size(),
               [&](std::size_t s) { moments[s] = frame_moments(reduced, segments.subspan(s, 1)); });
  const FrameSpan all{0, reduced.frames};
  const FrameMoments total = frame_moments(reduced, std::span(&all, 1));
  const Eigen::MatrixXd embedding = normalised_cut_embedding(affinities(moments, total.mean, options), most);

  const BehaviourGroups behaviours(moments, table.dimensions, table.rate_hz,
                                   (1 - options.variance) * total.covariance.trace(), options);
  std::vector<std::vector<int>> tried(static_cast<std::size_t>(most));
  std::vector<double> cost(tried.size());
  parallel_for(std::size_t{0}, tried.size(), [&](std::size_t k) {
    tried[k] = cluster_rows(embedding.leftCols(static_cast<Eigen::Index>(k) + 1), static_cast<int>(k) + 1);
    behaviours.refine(tried[k]);
    cost[k] = behaviours.cost(tried[k]);
  });
  const auto best = static_cast<std::size_t>(std::min_element(cost.begin(), cost.end()) - cost.begin());
  out.group = renumbered(std::move(tried[best]), out.groups);
  return out;
}

}  // namespace kinespace
