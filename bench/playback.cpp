// `kinespace bench playback`: what a full pose costs - the local rotations of all joints and the root's place - at
// random times of random clips, with all coefficients in memory, on one core; and how feet stand at a level of detail,
// as it is and planted.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "bench/report.h"
#include "kinespace/base/parallel.h"
#include "kinespace/library/library_builder.h"
#include "kinespace/motion/read.h"
#include "kinespace/synthesis/planted_player.h"

namespace kinespace {
namespace {

constexpr int poses = 10000;
constexpr int rounds = 100;  // the least counts: another program may be in the way

struct Played {
  RegisteredSpace space;
  std::vector<EncodedClip> clips;
  std::vector<Skeleton> skeletons;
  std::vector<Player> players;
  std::vector<PlantedPlayer> planted;
};

Played load_played(const std::filesystem::path& folder) {
  const auto files = find_motion_files({folder});
  std::vector<PreparedClip> clips(files.size());
  parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) { clips[i] = prepare(read_clip(files[i])); });
  BuiltSpace built = build_space(source_of(clips), {});
  Played out{std::move(built.space), {}, {}, {}, {}};
  const auto basis = std::make_shared<const PlaybackBasis>(out.space);
  for (std::size_t i = 0; i < clips.size(); ++i) {
    ClipCurves curves = clips[i].curves;
    out.space.apply_references(curves.values);
    out.clips.push_back(encode(out.space, curves, built.runs_of(static_cast<int>(i), clips[i].runs), built.warps[i]));
    const Clip original = clip_from_curves(clips[i].curves, clips[i].skeleton);
    out.clips.back().feet = keep_feet(original, clips[i].curves.placement);
    out.skeletons.push_back(clips[i].skeleton);
    out.players.emplace_back(basis, out.clips.back());
    out.planted.emplace_back(out.players.back(), out.clips.back(), out.skeletons.back());
  }
  return out;
}

struct Moment {
  std::size_t player = 0;
  double time_s = 0;
};

// Times spread over all motion, in random order.
std::vector<Moment> random_moments(const Played& played) {
  std::mt19937 generator(1);
  std::vector<double> seconds;
  for (const Player& player : played.players) seconds.push_back(player.duration_s());
  std::discrete_distribution<std::size_t> which(seconds.begin(), seconds.end());
  std::vector<Moment> out(poses);
  for (Moment& m : out) {
    m.player = which(generator);
    m.time_s = std::uniform_real_distribution<double>(0, seconds[m.player])(generator);
  }
  return out;
}

// Microseconds a pose: the least mean of the rounds.
double time_poses(const std::vector<Moment>& moments, std::span<float> rotations,
                  const std::function<float(const Moment&)>& pose) {
  double least = 1e9;
  float sum = 0;
  for (int round = 0; round < rounds; ++round) {
    const auto start = std::chrono::steady_clock::now();
    for (const Moment& m : moments) sum += pose(m) + rotations[0];
    least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return std::isfinite(sum) ? least / static_cast<double>(moments.size()) * 1e6 : -1;
}

// Largest difference from decode() over the frames of some clips: of the root in cm.
double difference_cm(const Played& played, int functions) {
  double largest = 0;
  for (std::size_t i = 0; i < played.clips.size(); i += 5) {
    const EncodedClip& clip = played.clips[i];
    const ClipCurves curves = decode(played.space, clip, functions);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(curves.placement.heading_rad, Eigen::Vector3d::UnitY()));
    std::vector<float> rotations(4 * static_cast<std::size_t>(played.players[i].joints()));
    for (int f = 0; f < clip.frames; ++f) {
      const Eigen::Vector3f root = played.players[i].pose(f / clip.rate_hz, functions, rotations);
      const Eigen::Vector3d wanted =
          curves.placement.start_cm + turn * Eigen::Vector3d(100 * curves.values.row(f).head<3>().transpose());
      largest = std::max(largest, (wanted - root.cast<double>()).norm());
    }
  }
  return largest;
}

// How the feet of a level of detail stand, over the clips whose feet are known.
struct Standing {
  double original = 0;  // cm/s, frames count alike
  double unplanted = 0;
  double planted = 0;
  double most_over_bar = -1e9;  // of a clip's planted slide over 1.3 times the original's + 0.5 cm/s
  double penetration = 0;       // cm, the deepest, planted
};

Standing standing_at(const Played& played, int functions) {
  Standing out;
  double frames = 0;
  for (std::size_t i = 0; i < played.clips.size(); ++i) {
    const EncodedClip& clip = played.clips[i];
    if (!clip.feet) continue;
    Clip decoded = clip_from_curves(decode(played.space, clip, functions), played.skeletons[i]);
    const FeetMeasures before = measure_feet(decoded, *clip.feet, clip.placement);
    plant_feet(decoded, *clip.feet, clip.placement);
    const FeetMeasures after = measure_feet(decoded, *clip.feet, clip.placement);
    frames += clip.frames;
    out.original += clip.frames * clip.feet->slide_cm_s;
    out.unplanted += clip.frames * before.slide_cm_s;
    out.planted += clip.frames * after.slide_cm_s;
    out.most_over_bar = std::max(out.most_over_bar, after.slide_cm_s - 1.3 * clip.feet->slide_cm_s - 0.5);
    out.penetration = std::max(out.penetration, after.floor_penetration_cm);
  }
  for (double* sum : {&out.original, &out.unplanted, &out.planted}) *sum /= frames;
  return out;
}

void add_standing(const std::string& data, const Played& played, BenchReport& report) {
  const auto add = [&](const std::string& name, double value, const std::string& unit,
                       std::optional<double> bar = std::nullopt) {
    report.results.push_back({.name = name, .data = data, .value = value, .unit = unit, .bar = bar});
  };
  for (const int functions : {3, 5, 10, -1}) {
    const Standing seen = standing_at(played, functions);
    const bool judged = functions == 5;
    const std::string at = functions < 0 ? std::string("all") : std::to_string(functions);
    if (functions == 3) add("foot slide, original", seen.original, "cm/s");
    add("foot slide at " + at + " functions", seen.unplanted, "cm/s");
    add("foot slide at " + at + " functions, planted", seen.planted, "cm/s",
        judged ? std::optional(1.3 * seen.original + 0.5) : std::nullopt);
    add("worst clip over 1.3 x original + 0.5 at " + at + " functions, planted", seen.most_over_bar, "cm/s",
        judged ? std::optional(0.0) : std::nullopt);
    add("under the original's floor at " + at + " functions, planted", seen.penetration, "cm",
        judged ? std::optional(0.5) : std::nullopt);
  }
}

}  // namespace

BenchReport bench_playback(const BenchOptions& options) {
  const Played played = load_played(options.data / "cmu");
  const std::vector<Moment> moments = random_moments(played);
  BenchReport report{.bench = "playback", .device = "cpu", .threads = 1, .results = {}};
  const std::string data = fmt::format("cmu, {} rotating joints", played.players.front().joints());
  const auto add = [&](const std::string& name, double value, const std::string& unit,
                       std::optional<double> bar = std::nullopt) {
    report.results.push_back({.name = name, .data = data, .value = value, .unit = unit, .bar = bar});
  };
  std::vector<float> rotations(4 * static_cast<std::size_t>(played.players.front().joints()));
  for (const int functions : {1, 3, 5, 10, -1}) {
    const double cost = time_poses(moments, rotations, [&](const Moment& m) {
      return played.players[m.player].pose(m.time_s, functions, rotations).x();
    });
    // ACL decodes a pose in 0.25 to 0.5 microseconds.
    add(functions < 0 ? fmt::format("a pose at all {} functions", played.space.levels())
                      : fmt::format("a pose at {} functions", functions),
        cost, "us", functions == 5 ? std::optional(0.5) : std::nullopt);
  }
  add("a pose at 5 functions, feet planted",
      time_poses(moments, rotations,
                 [&](const Moment& m) { return played.planted[m.player].pose(m.time_s, 5, rotations).x(); }),
      "us", 1.0);
  // Times of one clip: what the computation takes without the wait for memory.
  std::vector<Moment> of_one = moments;
  for (Moment& m : of_one) m = {.player = 0, .time_s = std::fmod(m.time_s, played.players.front().duration_s())};
  add("a pose at 5 functions, one clip alone",
      time_poses(of_one, rotations,
                 [&](const Moment& m) { return played.players[m.player].pose(m.time_s, 5, rotations).x(); }),
      "us");
  add("a pose at 5 functions, plain loops",
      time_poses(
          moments, rotations,
          [&](const Moment& m) { return reference::pose(played.players[m.player], m.time_s, 5, rotations).x(); }),
      "us");
  for (const int functions : {5, -1}) {
    add(fmt::format("root against decoding, {} functions", functions < 0 ? played.space.levels() : functions),
        difference_cm(played, functions), "cm", 0.01);
  }
  add_standing("cmu", played, report);
  for (const char* folder : {"bandai1", "bandai2"}) {
    if (std::filesystem::is_directory(options.data / folder)) {
      add_standing(folder, load_played(options.data / folder), report);
    }
  }
  return report;
}

}  // namespace kinespace
