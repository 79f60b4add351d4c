// `kinespace bench feet`: contacts against the truth of generated clips, and what cleanup does to known skate, to raw
// blends and to captured motion.
#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "bench/report.h"
#include "examples/contact_training.h"
#include "kinespace/base/parallel.h"
#include "kinespace/footskate/cleanup.h"
#include "kinespace/footskate/skate_measures.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

// A clip to be cleaned and when its feet truly stand.
struct Skating {
  Clip clip;
  FootContacts stands;
};

Clip with_path_scaled(Clip clip, double scale) {
  for (Eigen::Vector3d& p : clip.require_translation_track(clip.skeleton.travel_root()).values) {
    p.x() *= scale;
    p.z() *= scale;
  }
  return clip;
}

// Clips of other seeds, heights and speeds than the model has learnt from.
std::vector<SampleMotion> unseen(double rate_hz) {
  std::vector<SampleMotion> out;
  for (const double height : {155.0, 190.0}) {
    for (SampleMotion& m : sample_library({.seed = 77, .takes = 1, .rate_hz = rate_hz, .height_cm = height})) {
      out.push_back(std::move(m));
    }
  }
  return out;
}

std::vector<Skating> scaled(const std::vector<SampleMotion>& motions, double scale) {
  std::vector<Skating> out;
  for (const SampleMotion& m : motions) {
    out.push_back({with_path_scaled(m.clip, scale), contacts_of(m, require_feet(m.clip))});
  }
  return out;
}

// The frames in which both stand.
FootContacts common(const FootContacts& a, const FootContacts& b, int frames) {
  FootContacts out;
  for (int slot = 0; slot < 4; ++slot) {
    std::vector<char> both = planted_frames(a, slot, frames);
    const std::vector<char> other = planted_frames(b, slot, frames);
    for (int f = 0; f < frames; ++f) both[f] = static_cast<char>(both[f] & other[f]);
    append_runs(both, slot, out);
  }
  return out;
}

// The mean of two walks in step, joint by joint: what an interpolation without any cleanup gives.
Skating raw_blend(const SampleMotion& a, const SampleMotion& b) {
  Clip out = a.clip;
  for (int j = 0; j < out.skeleton.joint_count(); ++j) {
    for (int f = 0; f < out.frames; ++f) {
      out.set_rotation(j, f, a.clip.rotation(j, f).slerp(0.5, b.clip.rotation(j, f)));
    }
  }
  auto& track = out.require_translation_track(0).values;
  for (int f = 0; f < out.frames; ++f) track[f] = (a.clip.translation(0, f) + b.clip.translation(0, f)) / 2;
  const Feet feet = require_feet(out);
  return {std::move(out), common(contacts_of(a, feet), contacts_of(b, feet), a.clip.frames)};
}

std::vector<Skating> raw_blends() {
  std::vector<Skating> out;
  std::uint64_t seed = 300;
  for (const double cadence : {95.0, 110.0, 125.0}) {
    for (const double speed : {0.8, 1.0, 1.15}) {
      const auto walk = [&](double factor, double turn) {
        return make_walk({.speed_m_s = speed * factor,
                          .turn_rate_deg_s = turn,
                          .cadence_per_min = cadence,
                          .duration_s = 3,
                          .take = {.seed = seed++}});
      };
      out.push_back(raw_blend(walk(0.85, 0), walk(1.15, 0)));
      out.push_back(raw_blend(walk(1, -25), walk(1, 20)));
    }
  }
  return out;
}

struct Outcome {
  double before = 0;  // slide, cm/s, and how many steps it is the mean of
  double after = 0;
  double steps = 0;
  double penetration = 0;
  double pose = 0;
  double ratio = 1;
  double again = 0;  // cm that cleaning the output moves
};

double steps_of(const FootContacts& contacts) {
  double sum = 0;
  for (const FootContact& c : contacts) sum += c.last_frame - c.first_frame;
  return sum;
}

Outcome outcome_of(const Skating& skating, bool twice) {
  const CleanResult result = clean(skating.clip);
  const CleanReport& r = result.report;
  Outcome out{.before = foot_slide_cm_s(foot_tracks(skating.clip, r.feet), skating.stands).value_or(0),
              .after = foot_slide_cm_s(foot_tracks(result.clip, r.feet), skating.stands).value_or(0),
              .steps = steps_of(skating.stands),
              .penetration = r.floor_penetration_cm,
              .pose = r.mean_pose_change_cm,
              .ratio = r.acceleration_ratio};
  if (twice) out.again = largest_move_cm(result.clip, clean(result.clip).clip);
  return out;
}

std::vector<Outcome> outcomes(const std::vector<Skating>& all, bool twice) {
  std::vector<Outcome> out(all.size());
  parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) { out[i] = outcome_of(all[i], twice); });
  return out;
}

class Rows {
 public:
  explicit Rows(BenchReport& report) : report_(report) {}

  void add(const std::string& name, const std::string& data, double value, const std::string& unit,
           std::optional<double> bar = {}, bool higher = false) {
    report_.results.push_back(
        {.name = name, .data = data, .value = value, .unit = unit, .bar = bar, .higher_is_better = higher});
  }

  void add_cleanup(const std::string& data, const std::vector<Outcome>& all, bool level) {
    Outcome sum{.ratio = 0};
    Outcome worst;
    for (const Outcome& o : all) {
      sum.before += o.before * o.steps;
      sum.after += o.after * o.steps;
      sum.steps += o.steps;
      sum.pose += o.pose;
      sum.ratio += o.ratio;
      worst.pose = std::max(worst.pose, o.pose);
      worst.ratio = std::max(worst.ratio, o.ratio);
      worst.penetration = std::max(worst.penetration, o.penetration);
      worst.again = std::max(worst.again, o.again);
    }
    const double clips = static_cast<double>(all.size());
    add("foot slide before", data, sum.before / sum.steps, "cm/s");
    add("foot slide after", data, sum.after / sum.steps, "cm/s");
    add("foot slide taken out", data, 100 * (1 - sum.after / sum.before), "%", 95, true);
    add("floor penetration, worst clip", data, worst.penetration, "cm", level ? std::optional(0.01) : std::nullopt);
    add("pose change, mean", data, sum.pose / clips, "cm", 1.0);
    add("pose change, worst clip", data, worst.pose, "cm");
    add("largest acceleration, after / before, mean", data, sum.ratio / clips, "ratio", 1.2);
    add("largest acceleration, after / before, worst clip", data, worst.ratio, "ratio", 1.2);
    add("cleaned again, largest move", data, worst.again, "cm", level ? std::optional(0.1) : std::nullopt);
  }

 private:
  BenchReport& report_;
};

struct Counts {
  double both = 0;
  double first = 0;
  double second = 0;

  void add(const FootContacts& a, const FootContacts& b, int frames) {
    for (int slot = 0; slot < 4; ++slot) {
      const auto x = planted_frames(a, slot, frames);
      const auto y = planted_frames(b, slot, frames);
      for (int f = 0; f < frames; ++f) {
        both += x[f] != 0 && y[f] != 0 ? 1 : 0;
        first += x[f] != 0 && y[f] == 0 ? 1 : 0;
        second += x[f] == 0 && y[f] != 0 ? 1 : 0;
      }
    }
  }
  [[nodiscard]] double f1() const { return 2 * both / (2 * both + first + second); }
};

void add_detection(Rows& rows, double rate_hz, const std::vector<SampleMotion>& motions) {
  Counts model;
  Counts rule;
  for (const SampleMotion& m : motions) {
    const Feet feet = require_feet(m.clip);
    const FootTracks tracks = foot_tracks(m.clip, feet);
    const Ground ground = estimate_ground(tracks);
    const FootContacts truth = contacts_of(m, feet);
    model.add(ContactModel::standard().detect(tracks, ground), truth, m.clip.frames);
    rule.add(contacts_by_rule(tracks, ground), truth, m.clip.frames);
  }
  const std::string data = fmt::format("{} generated clips, {:.0f} Hz", motions.size(), rate_hz);
  rows.add("contacts, F1 per frame and joint, learnt model", data, model.f1(), "F1", 0.97, true);
  rows.add("contacts, F1 per frame and joint, height and speed", data, rule.f1(), "F1");
}

double largest_change(const std::vector<SampleMotion>& motions) {
  std::vector<double> moved(motions.size());
  parallel_for(std::size_t{0}, motions.size(),
               [&](std::size_t i) { moved[i] = largest_move_cm(motions[i].clip, clean(motions[i].clip).clip); });
  return std::ranges::max(moved);
}

// 50 ms off both ends: when exactly a captured foot comes to stand, and leaves, nobody knows.
FootContacts inner(const FootContacts& contacts, double rate_hz) {
  const int off = static_cast<int>(0.05 * rate_hz);
  FootContacts out;
  for (const FootContact& c : contacts) {
    if (c.last_frame - c.first_frame > 2 * off) out.push_back({c.slot, c.first_frame + off, c.last_frame - off});
  }
  return out;
}

// Captured clips; where they stand is what the rule of height and speed says, which is not what cleanup goes by.
std::vector<Skating> captured(const std::filesystem::path& folder, Rows& rows) {
  std::vector<Skating> out;
  for (const auto& file : find_motion_files({folder})) {
    Clip clip = read_clip(file);
    const FootTracks tracks = foot_tracks(clip, require_feet(clip));
    const Ground ground = estimate_ground(tracks);
    FootContacts by_rule = contacts_by_rule(tracks, ground);
    Counts counts;
    counts.add(ContactModel::standard().detect(tracks, ground), by_rule, clip.frames);
    const double frames = clip.frames;
    rows.add("model plants, rule does not: joint frames a frame", clip.name, counts.first / frames, "joints");
    rows.add("rule plants, model does not: joint frames a frame", clip.name, counts.second / frames, "joints");
    FootContacts stands = inner(by_rule, clip.rate_hz);
    out.push_back({std::move(clip), std::move(stands)});
  }
  return out;
}

}  // namespace

BenchReport bench_feet(const BenchOptions& options) {
  BenchReport report{.bench = "feet", .device = "processor", .threads = 2, .results = {}};
  Rows rows(report);
  for (const double rate : {30.0, 60.0, 120.0}) {
    const std::vector<SampleMotion> motions = unseen(rate);
    add_detection(rows, rate, motions);
    rows.add("clean clips, largest move", fmt::format("generated, {:.0f} Hz", rate), largest_change(motions), "cm",
             0.1);
    for (const double scale : {0.9, 1.15}) {
      rows.add_cleanup(fmt::format("generated, {:.0f} Hz, path x {:.2f}", rate, scale),
                       outcomes(scaled(motions, scale), true), true);
    }
  }
  rows.add_cleanup("raw blends of walks", outcomes(raw_blends(), true), true);
  for (const auto& [folder, data, level] :
       {std::tuple("cmu/02", "cmu 02, walks and more", true), std::tuple("cmu/03", "cmu 03, uneven ground", false),
        std::tuple("cmu/01", "cmu 01, climbing", false), std::tuple("foreign/xia31", "foreign/xia31, 120 Hz", false),
        std::tuple("foreign/hips15", "foreign/hips15, 30 Hz", false)}) {
    rows.add_cleanup(data, outcomes(captured(options.data / folder, rows), true), level);
  }
  return report;
}

}  // namespace kinespace
