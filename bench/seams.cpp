#include "bench/seams.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "kinespace/base/parallel.h"
#include "kinespace/motion/kinematics.h"
#include <cstdio>
#include <cstdlib>
#include "kinespace/footskate/skate_measures.h"
#include "kinespace/synthesis/connection.h"
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
  std::vector<Seam> seams;
  for (int i = 0; i < pairs_tried; ++i) {
    const ClipRow& first = rows[random() % rows.size()];
    const ClipRow& second = rows[random() % rows.size()];
    const Sources sources = sources_of(view, first, second);
    const Skeleton& skeleton = view.skeleton(first.skeleton_id);
    const Transition made = make_transition(space, sources.clips, skeleton);
    seams.push_back(measured(sources, made));
    if (getenv("KS_DEBUG")) {  // DEBUG
      const Join& j = made.joins[0];
      const JointPositions p = joint_positions(made.clip);
      double worst = 0; int wf = 0, wj = 0;
      const int from = std::max(1, int((made.begin[0] - .25) * made.clip.rate_hz)), to = std::min(made.clip.frames - 2, int((made.begin[0] + j.duration_s + .25) * made.clip.rate_hz));
      for (int f = from; f <= to; ++f) for (int k = 0; k < p.joints; ++k) { const double a = (p.at(f+1,k) - 2*p.at(f,k) + p.at(f-1,k)).norm(); if (a > worst) { worst = a; wf = f; wj = k; } }
      fprintf(stderr, "%d %s>%s way %d fp %d dur %.2f speed %.2f cost %.1f | est s %.2f a %.2f r %.2f | got s %.2f a %.2f r %.2f slide %.1f/%.1f low %.1f/%.1f pen %.1f | joint %s frame %d of %d..%d rate %.0f\n", i, first.name.c_str(), second.name.c_str(), int(j.way), int(j.feet_planned), j.duration_s, j.connection.speed(), j.connection.cost_cm, j.ratios.speed, j.ratios.acceleration, j.ratios.root_acceleration, seams.back().ratios.speed, seams.back().ratios.acceleration, seams.back().ratios.root_acceleration, seams.back().feet.slide_cm_s.value_or(-1), sources.slide.value_or(-1), seams.back().feet.lowest_speed_cm_s.value_or(-1), sources.lowest.value_or(-1), seams.back().feet.penetration_cm, skeleton.joints[wj].name.c_str(), wf, int(made.begin[0]*made.clip.rate_hz), int((made.begin[0]+j.duration_s)*made.clip.rate_hz), made.clip.rate_hz);
    }
  }
  rows_of(data, "transition", seams, true, report);
}

}  // namespace kinespace
