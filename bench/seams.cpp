#include "bench/seams.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "kinespace/footskate/skate_measures.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/synthesis/connection.h"
#include "kinespace/synthesis/curve_sampler.h"
#include "kinespace/synthesis/transition.h"

namespace kinespace {
namespace {

constexpr int pairs_tried = 200;

// What a transition is measured against.
struct Sources {
  std::vector<ClipCurves> clips;
  std::array<JointRates, 2> rates;
  std::optional<Feet> feet;
  FootLevel level;  // of the first clip
  std::optional<double> slide, lowest;
};

std::optional<double> mean_of(const std::optional<double>& a, const std::optional<double>& b) {
  if (!a || !b) return a ? a : b;
  return (*a + *b) / 2;
}

Sources sources_of(LibraryView& view, const ClipRow& first, const ClipRow& second) {
  Sources out{.clips = {view.curves(first), view.curves(second)}};
  const std::array<Clip, 2> clips{view.clip(first), view.clip(second)};
  for (std::size_t i = 0; i < 2; ++i) out.rates[i] = joint_rates(clips[i]);
  out.feet = find_feet(clips[0]);
  if (!out.feet) return out;
  std::array<FootMotion, 2> motions;
  for (std::size_t i = 0; i < 2; ++i) {
    const FootTracks tracks = foot_tracks(clips[i], *out.feet);
    const FootLevel level = foot_level(tracks);
    if (i == 0) out.level = level;
    motions[i] = foot_motion(tracks, level);
  }
  out.slide = mean_of(motions[0].slide_cm_s, motions[1].slide_cm_s);
  out.lowest = mean_of(motions[0].lowest_speed_cm_s, motions[1].lowest_speed_cm_s);
  return out;
}

// One transition, measured on what came out, not on what the search saw.
struct Seam {
  SeamRatios ratios;
  FootMotion feet;
  std::optional<double> source_slide, source_lowest;
  double time_scale = 1;
};

Seam measured(const Sources& sources, const Transition& made) {
  const std::array<const JointRates*, 2> rates{&sources.rates[0], &sources.rates[1]};
  const double begin = made.begin[0], end = made.begin[0] + made.joins[0].duration_s;
  Seam out{.ratios = seam_ratios(joint_rates(made.clip), begin, end, usual_rates(rates)),
           .feet = {},
           .source_slide = sources.slide,
           .source_lowest = sources.lowest,
           .time_scale = made.joins[0].connection.speed()};
  if (sources.feet) {
    const int last = made.clip.frames - 1;
    const int from = std::clamp(static_cast<int>(std::ceil(begin * made.clip.rate_hz)), 0, last);
    const int to = std::clamp(static_cast<int>(std::floor(end * made.clip.rate_hz)), from, last);
    out.feet = foot_motion(foot_tracks(made.clip, *sources.feet), sources.level, from, to);
  }
  return out;
}

// Where two poses and what they do are most alike: what a transition that is found by comparing frames begins with.
struct BestPoint {
  double leave_s = 0, enter_s = 0;
};

// Every frame of the last two seconds of one (at most its half) with every one of the first two of the other: the mean
// distance of joints seen from the root on the ground, and a tenth of a second of their difference in speed.
BestPoint best_point(const ClipCurves& first, const ClipCurves& second, const Skeleton& skeleton) {
  constexpr double window_s = 2, lead_s = 0.1, overlap_s = 0.3;
  const auto poses = [&](const ClipCurves& curves) {
    JointPositions positions = joint_positions(clip_from_curves(curves, skeleton));
    const int root = skeleton.travel_root();
    for (int f = 0; f < positions.frames; ++f) {
      const auto q = curves.values.row(f).segment<4>(travel_curves);
      const double heading = heading_of(Eigen::Quaterniond(q(0), q(1), q(2), q(3))) + curves.placement.heading_rad;
      const Eigen::Vector3d at = positions.at(f, root);
      const Eigen::AngleAxisd back(-heading, Eigen::Vector3d::UnitY());
      for (int j = 0; j < positions.joints; ++j) {
        Eigen::Vector3d& p = positions.values[static_cast<std::size_t>(f * positions.joints + j)];
        p = back * (p - Eigen::Vector3d(at.x(), 0, at.z()));
      }
    }
    return positions;
  };
  const JointPositions a = poses(first), b = poses(second);
  const auto steps = [](int frames, double rate_hz) {
    return std::min(frames / 2, static_cast<int>(window_s * rate_hz));
  };
  const int from = std::max(1, a.frames - steps(a.frames, first.rate_hz));
  const int to_a = a.frames - static_cast<int>(overlap_s * first.rate_hz) - 1;
  const int to_b =
      std::min(steps(b.frames, second.rate_hz), b.frames - static_cast<int>(overlap_s * second.rate_hz) - 1);
  double least = std::numeric_limits<double>::infinity();
  BestPoint out{.leave_s = std::max(0, to_a) / first.rate_hz, .enter_s = 1 / second.rate_hz};
  for (int f = from; f <= to_a; ++f) {
    for (int g = 1; g <= to_b; ++g) {
      double sum = 0;
      for (int j = 0; j < a.joints && sum < least; ++j) {
        const Eigen::Vector3d apart = a.at(f, j) - b.at(g, j);
        const Eigen::Vector3d speeds =
            (a.at(f, j) - a.at(f - 1, j)) * first.rate_hz - (b.at(g, j) - b.at(g - 1, j)) * second.rate_hz;
        sum += apart.norm() + lead_s * speeds.norm();
      }
      if (sum >= least) continue;
      least = sum;
      out = {f / first.rate_hz, g / second.rate_hz};
    }
  }
  return out;
}

// What others do at their best point: a crossfade of 0.3 s, or inertialization over 0.5 s.
Transition at_best_point(const BestPoint& point, JoinWay way, const std::vector<ClipCurves>& clips,
                         const Skeleton& skeleton) {
  const double end_s = (clips[1].frames() - 1) / clips[1].rate_hz;
  Join join{.way = way, .duration_s = std::min(way == JoinWay::blend ? 0.3 : 0.5, end_s - point.enter_s)};
  join.connection.leave_s = point.leave_s;
  join.connection.left_s = point.leave_s + join.duration_s;
  join.connection.enter_s = point.enter_s;
  join.connection.entered_s = point.enter_s + join.duration_s;
  const auto at_world_height = [](ClipCurves curves) {
    curves.values.col(1).array() += curves.placement.start_cm.y() / 100;
    curves.placement.start_cm.y() = 0;
    return curves;
  };
  const std::array<double, 1> first_s{point.leave_s}, second_s{point.enter_s};
  join.placement = ground_alignment(CurveSampler(at_world_height(clips[0])), first_s,
                                    CurveSampler(at_world_height(clips[1])), second_s, skeleton);
  return play_joins(clips, std::span(&join, 1), skeleton);
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::ranges::nth_element(values, values.begin() + at);
  return values[static_cast<std::size_t>(at)];
}

template <typename Get>
std::vector<double> values_of(const std::vector<Seam>& seams, const Get& get) {
  std::vector<double> out;
  for (const Seam& seam : seams) {
    const std::optional<double> value = get(seam);
    if (value) out.push_back(*value);
  }
  return out;
}

void rows_of(const std::string& data, const std::string& way, const std::vector<Seam>& seams, bool bars,
             BenchReport& report) {
  const auto row = [&](const std::string& name, double value, const char* unit, std::optional<double> bar = {},
                       bool higher = false) {
    report.results.push_back({.name = "seam, " + way + ": " + name,
                              .data = data,
                              .value = value,
                              .unit = unit,
                              .bar = bars ? bar : std::nullopt,
                              .higher_is_better = higher});
  };
  const auto ratio = [&](double SeamRatios::*which) {
    return values_of(seams, [&](const Seam& s) { return std::optional(s.ratios.*which); });
  };
  const auto speed = ratio(&SeamRatios::speed);
  const auto acceleration = ratio(&SeamRatios::acceleration);
  const auto root = ratio(&SeamRatios::root_acceleration);
  row("largest joint speed over the usual, median", quantile(speed, 0.5), "x", 1.0);
  row("largest joint speed over the usual, worst", quantile(speed, 1), "x", 1.2);
  row("largest joint acceleration over the usual, median", quantile(acceleration, 0.5), "x", 1.0);
  row("largest joint acceleration over the usual, 90 %", quantile(acceleration, 0.9), "x");
  row("largest joint acceleration over the usual, worst", quantile(acceleration, 1), "x", 1.2);
  row("root acceleration over the usual, median", quantile(root, 0.5), "x");
  row("root acceleration over the usual, worst", quantile(root, 1), "x", 1.5);
  const auto source_slide = values_of(seams, [](const Seam& s) { return s.source_slide; });
  const auto slide = values_of(seams, [](const Seam& s) { return s.feet.slide_cm_s; });
  const auto source_lowest = values_of(seams, [](const Seam& s) { return s.source_lowest; });
  const auto lowest = values_of(seams, [](const Seam& s) { return s.feet.lowest_speed_cm_s; });
  const double usual_slide = quantile(source_slide, 0.5);
  const double usual_lowest = quantile(source_lowest, 0.5);
  row("foot slide of the sources, median", usual_slide, "cm/s");
  row("foot slide over the sources', median", quantile(slide, 0.5) / usual_slide, "x", 1.3);
  row("foot slide over the sources', 90 %", quantile(slide, 0.9) / usual_slide, "x", 2.0);
  row("the lowest foot's speed of the sources, median", usual_lowest, "cm/s");
  row("the lowest foot's speed over the sources', median", quantile(lowest, 0.5) / usual_lowest, "x", 1.3);
  row("the lowest foot's speed over the sources', 90 %", quantile(lowest, 0.9) / usual_lowest, "x");
  row("penetration, 90 %",
      quantile(values_of(seams, [](const Seam& s) { return std::optional(s.feet.penetration_cm); }), 0.9), "cm");
  double natural = 0;
  for (const Seam& s : seams) natural += s.time_scale >= 0.8 - 1e-9 && s.time_scale <= 1.25 + 1e-9 ? 1 : 0;
  row("time scale within 0.8 and 1.25", 100 * natural / static_cast<double>(seams.size()), "%", 95, true);
}

// Ours over theirs: of the medians and of the 90th percentiles.
void against(const std::string& data, const std::string& whose, const std::vector<Seam>& ours,
             const std::vector<Seam>& theirs, BenchReport& report) {
  const auto slide = [](const Seam& s) { return s.feet.slide_cm_s; };
  const auto acceleration = [](const Seam& s) { return std::optional(s.ratios.acceleration); };
  for (const double share : {0.5, 0.9}) {
    const std::string at = share < 0.6 ? ", median" : ", 90 %";
    const auto row = [&](const std::string& name, const auto& get) {
      report.results.push_back(
          {.name = "seam, transition: " + name + " over " + whose + at,
           .data = data,
           .value = quantile(values_of(ours, get), share) / quantile(values_of(theirs, get), share),
           .unit = "x",
           .bar = 1.0});
    };
    row("foot slide", slide);
    row("joint acceleration", acceleration);
  }
}

}  // namespace

void seam_rows(const std::string& data, LibraryView& view, BenchReport& report) {
  const std::int64_t space_id = view.library().spaces().front().id;
  const ConnectionSpace space(view.space(space_id));
  std::vector<ClipRow> rows;
  for (const ClipRow& row : view.library().clips()) {
    if (row.space_id == space_id && space.long_enough(static_cast<double>(row.frames - 1) / row.rate_hz)) {
      rows.push_back(row);
    }
  }
  std::mt19937_64 random(2026);
  std::vector<Seam> seams, crossfades, inertialized;
  for (int i = 0; i < pairs_tried; ++i) {
    const ClipRow& first = rows[random() % rows.size()];
    const ClipRow& second = rows[random() % rows.size()];
    const Sources sources = sources_of(view, first, second);
    const Skeleton& skeleton = view.skeleton(first.skeleton_id);
    const Transition made = make_transition(space, sources.clips, skeleton);
    seams.push_back(measured(sources, made));
    const BestPoint point = best_point(sources.clips[0], sources.clips[1], skeleton);
    crossfades.push_back(measured(sources, at_best_point(point, JoinWay::blend, sources.clips, skeleton)));
    inertialized.push_back(measured(sources, at_best_point(point, JoinWay::inertialization, sources.clips, skeleton)));
  }
  rows_of(data, "transition", seams, true, report);
  rows_of(data, "crossfade of 0.3 s at the best point", crossfades, false, report);
  rows_of(data, "inertialization at the best point", inertialized, false, report);
  against(data, "the crossfade's", seams, crossfades, report);
  against(data, "inertialization's", seams, inertialized, report);
}

}  // namespace kinespace
