#include "kinespace/footskate/cleanup.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/footskate/contact_model.h"
#include "kinespace/footskate/detail/leg_goals.h"
#include "kinespace/footskate/detail/leg_pose.h"
#include "kinespace/footskate/detail/root_path.h"

namespace kinespace {
namespace {

using Eigen::Vector3d;

constexpr double settled_cm = 0.05;  // a pass that moves nothing by more is not needed

LegGoals goals_for(const FootTracks& t, const Ground& ground, const std::vector<Plant>& plants) {
  const std::array<FloorUnder, 2> floors = {FloorUnder(t, ground, plants, 0), FloorUnder(t, ground, plants, 1)};
  const std::array<FootTask, 2> tasks = {foot_task(t, 0, plants, floors[0]), foot_task(t, 1, plants, floors[1])};
  return leg_goals(t, floors, tasks, root_shift(t, tasks));
}

Ground ground_for(const FootTracks& tracks, const CleanOptions& options) {
  return options.floor_cm ? Ground{.height_cm = *options.floor_cm} : estimate_ground(tracks);
}

FootContacts contacts_for(const FootTracks& tracks, const Ground& ground, const CleanOptions& options) {
  if (options.contacts) return *options.contacts;
  return (options.model != nullptr ? *options.model : ContactModel::standard()).detect(tracks, ground);
}

void check_contacts(const Clip& clip, const FootTracks& tracks, const FootContacts& contacts) {
  for (const FootContact& c : contacts) {
    const bool good = c.slot >= 0 && c.slot < 4 && tracks.has(c.slot) && c.first_frame >= 0 &&
                      c.first_frame <= c.last_frame && c.last_frame < clip.frames;
    if (good) continue;
    throw Error(ErrorKind::bad_input,
                {.file = clip.name,
                 .found = fmt::format("a contact of slot {} in frames {} to {}", c.slot, c.first_frame, c.last_frame),
                 .expected = fmt::format("a joint of a foot and frames 0 to {}", clip.frames - 1),
                 .remedy = {}});
  }
}

// Hands over the clip part by part: as it was, as it is. A long clip is not held twice.
void for_each_part(const LegTracks& before, const Clip& now,
                   const std::function<void(const Clip& was, const Clip& is)>& visit) {
  constexpr int part_frames = 4096;
  for (int first = 0; first < now.frames; first += part_frames) {
    const int count = std::min(part_frames, now.frames - first);
    visit(before.slice_before(now, first, count), slice(now, first, count));
  }
}

double largest_move_since(const LegTracks& before, const Clip& now) {
  double largest = 0;
  for_each_part(before, now,
                [&](const Clip& was, const Clip& is) { largest = std::max(largest, largest_move_cm(was, is)); });
  return largest;
}

double mean_pose_change_since(const LegTracks& before, const Clip& now) {
  double sum = 0;
  for_each_part(before, now, [&](const Clip& was, const Clip& is) { sum += mean_pose_change_cm(was, is) * is.frames; });
  return sum / now.frames;
}

double deepest_cm(const FootTracks& tracks, const CleanReport& report) {
  double deepest = 0;
  for (int leg = 0; leg < 2; ++leg) {
    const FloorUnder floor(tracks, report.ground, report.plants, leg);
    for (int slot = 2 * leg; slot < 2 * leg + 2; ++slot) {
      for (int f = 0; f < tracks.frames && tracks.has(slot); ++f) {
        const Vector3d& p = tracks.at[slot][f];
        deepest = std::max(deepest, floor.at(p, f) - p.y());
      }
    }
  }
  return deepest;
}

// What there is to say of a cleaned clip; `acceleration_before`: the largest of the clip as it was.
void measure(const LegTracks& before, double acceleration_before, const FootContacts& contacts, const FootLevel& level,
             CleanResult& result) {
  CleanReport& report = result.report;
  const FootTracks after = foot_tracks(result.clip, report.feet);
  report.foot_slide_after_cm_s = foot_slide_cm_s(after, contacts);
  report.feet_after = foot_motion(after, level);
  report.floor_penetration_cm = deepest_cm(after, report);
  report.mean_pose_change_cm = mean_pose_change_since(before, result.clip);
  report.largest_move_cm = largest_move_since(before, result.clip);
  report.acceleration_ratio =
      acceleration_before > 0 ? largest_acceleration_cm_s2(result.clip) / acceleration_before : 1;
}

// Cleans once. False when that would move nothing by more than matters: then nothing is changed.
bool clean_once(FootTracks tracks, const Ground& ground, std::vector<Plant> plants, bool first, CleanResult& result) {
  const LegGoals goals = goals_for(tracks, ground, plants);
  tracks = {};  // of a long clip as large as what else is held of it
  const LegTracks before(result.clip, result.report.feet);
  pose_legs(result.clip, result.report.feet, goals);
  const bool settled = largest_move_since(before, result.clip) <= settled_cm;
  if (settled && !first) {
    before.put_back(result.clip);
    return false;
  }
  result.report.plants = std::move(plants);
  ++result.report.passes;
  return !settled;
}

}  // namespace

void CleanOptions::validate() const {
  const auto require = [](const char* field, double value, double low, double high) {
    if (value >= low && value <= high) return;
    throw Error(
        ErrorKind::usage,
        {.found = fmt::format("{} = {}", field, value), .expected = fmt::format("{} to {}", low, high), .remedy = {}});
  };
  if (floor_cm) require("floor_cm", *floor_cm, -1e5, 1e5);
  require("passes", passes, 1, 20);
}

std::vector<std::string> doubts_about(const CleanReport& report) {
  constexpr double measurable_cm_s = 0.01;
  constexpr double usual_ratio = 1.5;
  std::vector<std::string> out;
  if (!report.foot_slide_before_cm_s || !report.foot_slide_after_cm_s) {
    out.emplace_back("no foot was found to stand: nothing was planted, and how much feet slide is not known");
  } else if (*report.foot_slide_after_cm_s > *report.foot_slide_before_cm_s + measurable_cm_s) {
    out.push_back(fmt::format("planted feet slide more than before: {:.2f} cm/s, before {:.2f} cm/s",
                              *report.foot_slide_after_cm_s, *report.foot_slide_before_cm_s));
  }
  const double slid = report.feet_before.slide_cm_s.value_or(0);
  constexpr double noticed_cm_s = 0.5;
  if (report.feet_after.slide_cm_s.value_or(0) > slid + noticed_cm_s) {
    out.push_back(fmt::format("low, slow feet slide more than before: {:.2f} cm/s, before {:.2f} cm/s",
                              *report.feet_after.slide_cm_s, slid));
  }
  if (report.acceleration_ratio > usual_ratio) {
    out.push_back(fmt::format("the largest acceleration of a joint is {:.1f} times what it was: look at the result",
                              report.acceleration_ratio));
  }
  return out;
}

CleanResult clean(Clip clip, const CleanOptions& options) {
  options.validate();
  CleanResult out{.clip = std::move(clip), .report = {}};
  CleanReport& report = out.report;
  report.feet = require_feet(out.clip, options.feet);
  FootTracks tracks = foot_tracks(out.clip, report.feet);
  report.ground = ground_for(tracks, options);
  const FootLevel level{.ground = report.ground, .standing_cm = standing_heights(tracks, report.ground)};
  report.feet_before = foot_motion(tracks, level);
  const FootContacts contacts = contacts_for(tracks, report.ground, options);
  check_contacts(out.clip, tracks, contacts);
  report.foot_slide_before_cm_s = foot_slide_cm_s(tracks, contacts);
  const double acceleration = largest_acceleration_cm_s2(out.clip);
  const LegTracks before(out.clip, report.feet);
  std::vector<Plant> plants = place_plants(tracks, report.ground, contacts);
  Ground ground = report.ground;
  while (clean_once(std::move(tracks), ground, std::move(plants), report.passes == 0, out) &&
         report.passes < options.passes) {
    tracks = foot_tracks(out.clip, report.feet);
    ground = ground_for(tracks, options);
    plants = place_plants(tracks, ground, contacts_for(tracks, ground, options));
  }
  measure(before, acceleration, contacts, level, out);
  return out;
}

}  // namespace kinespace
