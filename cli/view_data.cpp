#include "cli/view_data.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "cli/level_table.h"
#include "kinespace/base/bytes.h"
#include "kinespace/base/error.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/storage/varint.h"
#include "kinespace/synthesis/motion_map.h"
#include "kinespace/synthesis/retrieval.h"

namespace kinespace::cli {
namespace {

std::string base64(std::span<const std::byte> bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      three = three << 8 | (i + k < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      out += i + k > bytes.size() ? '=' : digits[three >> (18 - 6 * k) & 63U];
    }
  }
  return out;
}

template <typename Matrix>
std::string floats(const Matrix& values) {
  ByteWriter out;
  for (Eigen::Index i = 0; i < values.size(); ++i) out.put(static_cast<float>(values.data()[i]));
  return base64(out.bytes());
}

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

template <typename Vector>
Json list_of(const Vector& values) {
  Json out = Json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i) out.push_back(values(i));
  return out;
}

Json group_json(const FunctionGroup& group) {
  return {{"mean", floats(group.mean)},
          {"functions", floats(group.functions)},
          {"eigenvalues", list_of(group.eigenvalues)},
          {"variance", group.variance}};
}

Json set_json(const MotionSpace& set) {
  Json out{{"cycles", set.options().cycles},
           {"points", set.points()},
           {"rows", set.rows()},
           {"pace", set.options().pace},
           {"groups", Json::array()}};
  for (const FunctionGroup& group : set.groups()) out["groups"].push_back(group_json(group));
  return out;
}

Json space_json(const RegisteredSpace& space) {
  Json out{{"pinned", space.options().pinned},
           {"curves", space.curves()},
           {"levels", space.levels()},
           {"variance", space.variance_covered()},
           {"movement", space.movement_covered()},
           {"groups", Json::array()},
           {"sets", Json::array()}};
  for (int c = 0; c < space.curves(); ++c) out["groups"].push_back(space.plain().group_of(c));
  for (std::size_t cycles = 0; cycles < space.sets().size(); ++cycles) {
    out["sets"].push_back(space.has(static_cast<int>(cycles)) ? set_json(space.sets()[cycles]) : Json());
  }
  return out;
}

Json skeleton_json(const Skeleton& skeleton) {
  Json joints = Json::array();
  for (const Joint& joint : skeleton.joints) {
    joints.push_back({{"name", joint.name},
                      {"parent", joint.parent},
                      {"offset", list_of(joint.offset)},
                      {"end", joint.end_site ? list_of(*joint.end_site) : Json()}});
  }
  return {{"joints", std::move(joints)}, {"rotating", skeleton.rotating_joints()}, {"height", skeleton.rest_height()}};
}

// How many rows of scores are not all 0 at their end.
Eigen::Index rows_needed(const ScoreMatrix& scores) {
  Eigen::Index rows = scores.rows();
  while (rows > 0 && (scores.row(rows - 1).array() == 0).all()) --rows;
  return rows;
}

// Whole numbers of the steps in which the library keeps them (docs/files.md).
void put_scores(const EncodedSequence& sequence, Eigen::Index from, Eigen::Index rows, double pace, ByteWriter& out) {
  const double steps = 1e4 * std::sqrt(pace);
  for (Eigen::Index row = from; row < rows; ++row) {
    for (Eigen::Index c = 0; c < sequence.scores.cols(); ++c) {
      put_signed_varint(out, std::llround(double{sequence.scores(row, c)} * steps));
    }
  }
}

Json runs_json(const RegisteredSpace& space, const EncodedClip& clip, ByteWriter& scores) {
  Json runs = Json::array();
  for (const EncodedRun& run : clip.runs) {
    Json sequences = Json::array();
    for (const EncodedSequence& s : run.sequences) {
      const MotionSpace& set = space.of(s.cycles);
      // The first end of a sequence is the last of the one before.
      const Eigen::Index from = set.options().pinned && !sequences.empty() ? 1 : 0;
      const Eigen::Index rows = std::max(from, rows_needed(s.scores));
      put_scores(s, from, rows, set.options().pace, scores);
      sequences.push_back({{"first", s.first},
                           {"last", s.last},
                           {"cycles", s.cycles},
                           {"extra", s.extra_detail},
                           {"warp", s.warp.coefficients()},
                           {"travel", list_of(s.travel)},
                           {"rows", rows}});
    }
    runs.push_back({{"start", list_of(run.start)}, {"sequences", std::move(sequences)}});
  }
  return runs;
}

Json side_tracks_json(const std::vector<SideTrack>& tracks) {
  Json out = Json::array();
  for (const SideTrack& track : tracks) {
    out.push_back({{"joint", track.joint},
                   {"dimensions", track.dimensions},
                   {"frames", track.frames},
                   {"values", floats(Eigen::Map<const Eigen::VectorXd>(
                                  track.values.data(), static_cast<Eigen::Index>(track.values.size())))}});
  }
  return out;
}

Json contacts_json(const KeptFeet& feet) {
  const std::array<int, 4> joints = {feet.legs[0].ankle, feet.legs[0].toe, feet.legs[1].ankle, feet.legs[1].toe};
  Json out{{"joints", joints}, {"contacts", Json::array()}};
  for (const FootContact& contact : feet.frames()) {
    out["contacts"].push_back({contact.slot, contact.first_frame, contact.last_frame});
  }
  return out;
}

// Where joints were, in steps of 0.1 mm: of each joint and axis the second differences over the frames.
std::string original_positions(const Clip& clip) {
  constexpr double steps_per_cm = 100;
  const JointPositions positions = joint_positions(clip);
  ByteWriter out;
  for (int joint = 0; joint < positions.joints; ++joint) {
    for (int axis = 0; axis < 3; ++axis) {
      std::int64_t last = 0;
      std::int64_t slope = 0;
      for (int f = 0; f < positions.frames; ++f) {
        const std::int64_t here = std::llround(positions.at(f, joint)(axis) * steps_per_cm);
        put_signed_varint(out, here - last - slope);
        slope = f == 0 ? 0 : here - last;
        last = here;
      }
    }
  }
  return base64(out.bytes());
}

// The list of all clips: 0 2 1 3, that is its places with their bits turned round, so that however far one comes the
// clips are spread evenly.
std::vector<std::size_t> evenly_spread(std::size_t count) {
  unsigned bits = 0;
  while ((std::size_t{1} << bits) < count) ++bits;
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < std::size_t{1} << bits; ++i) {
    std::size_t turned = 0;
    for (unsigned b = 0; b < bits; ++b) turned |= (i >> b & 1U) << (bits - 1 - b);
    if (turned < count) out.push_back(turned);
  }
  return out;
}

class ViewBuilder {
 public:
  ViewBuilder(LibraryView& library, const ViewOptions& options, const Compute& compute, const Progress& progress)
      : library_(library), options_(options), compute_(compute), progress_(progress), rows_(library.library().clips()) {
    for (std::size_t i = 0; i < rows_.size(); ++i) place_[rows_[i].name] = i;
    out_.clips = rows_.size();
  }

  ViewData build() {
    if (rows_.empty()) {
      throw Error(ErrorKind::bad_input, {.file = library_.library().path().string(),
                                         .found = "a library without clips",
                                         .expected = "one with something to show"});
    }
    out_.overview = text_of(overview());
    require_room();
    if (options_.clips.empty()) {
      take_evenly();
    } else {
      take_named();
    }
    std::ranges::sort(out_.motions, {}, &ViewData::Motion::clip);
    return std::move(out_);
  }

 private:
  Json overview() {
    Json out{{"library", library_.library().path().filename().string()},
             {"first",
              options_.clips.empty() ? Json() : Json(place_.at(library_.require_clip(options_.clips.front()).name))},
             {"spaces", Json::array()},
             {"skeletons", Json::array()}};
    LevelTable levels;
    Json clips = Json::array();
    std::map<std::int64_t, MapPoint> places;
    for (const ClipRow& row : rows_) {
      progress_.check_stop();
      add_space(row.space_id, out["spaces"], places);
      add_skeleton(row.skeleton_id, out["skeletons"]);
      levels.add(row, library_.level_errors(row));
      const MapPoint& place = places[row.id];
      clips.push_back({{"name", row.name},
                       {"labels", row.labels},
                       {"space", space_place_.at(row.space_id)},
                       {"skeleton", skeleton_place_.at(row.skeleton_id)},
                       {"frames", row.frames},
                       {"rate", row.rate_hz},
                       {"x", std::round(place.x * 1e5) / 1e5},
                       {"y", std::round(place.y * 1e5) / 1e5}});
    }
    out["levels"] = levels.rows();
    out["clips"] = std::move(clips);
    return out;
  }

  void add_space(std::int64_t id, Json& spaces, std::map<std::int64_t, MapPoint>& places) {
    if (!space_place_.try_emplace(id, spaces.size()).second) return;
    Json space = space_json(library_.space(id));
    const MotionMap map = motion_map(library_.library().retrieval_matrix(id));
    for (const MapPoint& point : map.points) places[point.clip_id] = point;
    space["map_shares"] = map.shares;
    spaces.push_back(std::move(space));
  }

  void add_skeleton(std::int64_t id, Json& skeletons) {
    if (!skeleton_place_.try_emplace(id, skeletons.size()).second) return;
    skeletons.push_back(skeleton_json(library_.skeleton(id)));
  }

  [[nodiscard]] std::size_t room() const {
    const std::size_t taken = out_.bytes();
    return taken < options_.most_bytes ? options_.most_bytes - taken : 0;
  }

  // What does not fit is told with the size that would do.
  [[noreturn]] void refuse_size(const std::string& what, std::size_t needed) const {
    throw Error(ErrorKind::usage,
                {.file = library_.library().path().string(),
                 .found = fmt::format("{}, {:.4g} MB in all", what, static_cast<double>(needed) / 1e6),
                 .expected = fmt::format("a page of at most {:.6g} MB", static_cast<double>(options_.most_bytes) / 1e6),
                 .remedy = "give more with --max-size"});
  }

  void require_room() const {
    if (out_.bytes() > options_.most_bytes) {
      refuse_size(fmt::format("{} clips on the map and their functions", rows_.size()), out_.bytes());
    }
  }

  // nullopt where they are not looked for.
  std::optional<std::vector<Match>> nearest_of(const ClipRow& row) {
    if (options_.nearest < 1 || out_.with_nearest >= most_clips_with_nearest) return std::nullopt;
    const Progress silent{.report = {}, .stop_requested = progress_.stop_requested};
    return nearest_motions(library_, library_.curves(row), library_.skeleton(row.skeleton_id), {.k = options_.nearest},
                           row.name, compute_, silent);
  }

  Json nearest_json(const std::vector<Match>& matches) const {
    Json out = Json::array();
    for (const Match& match : matches) {
      out.push_back({place_.at(match.clip), match.distance, match.vector_distance});
    }
    return out;
  }

  std::string motion_text(const ClipRow& row, const std::optional<std::vector<Match>>& nearest,
                          const std::optional<Clip>& original) {
    const RegisteredSpace& space = library_.space(row.space_id);
    const EncodedClip clip = library_.encoded(row);
    ByteWriter scores;
    Json out{{"start", list_of(clip.placement.start_cm)},
             {"heading", clip.placement.heading_rad},
             {"runs", runs_json(space, clip, scores)},
             {"side_tracks", side_tracks_json(clip.side_tracks)}};
    out["scores"] = base64(scores.bytes());
    out["levels"] = Json::array();
    for (const LevelError& l : clip.levels) {
      out["levels"].push_back({l.level, l.error.mean_joint_error_cm, l.error.max_joint_error_cm});
    }
    out["feet"] = clip.feet ? contacts_json(*clip.feet) : Json();
    out["nearest"] = nearest ? nearest_json(*nearest) : Json();
    out["original"] = original ? Json(original_positions(*original)) : Json();
    return text_of(out);
  }

  // Returns the bytes that are lacking: 0 when it was taken. `matches`: the nearest, where they were found.
  std::size_t take(std::size_t at, std::vector<Match>* matches = nullptr) {
    progress_.check_stop();
    if (taken_.contains(at)) return 0;
    const ClipRow& row = rows_[at];
    const std::optional<std::vector<Match>> nearest = nearest_of(row);
    const std::optional<Clip> original = options_.originals ? library_.unchanged_source(row) : std::nullopt;
    std::string json = motion_text(row, nearest, original);
    if (json.size() > room()) return json.size() - room();
    taken_.insert(at);
    out_.motions.push_back({at, std::move(json)});
    if (original) ++out_.with_original;
    if (nearest) ++out_.with_nearest;
    if (nearest && matches) *matches = *nearest;
    return 0;
  }

  void take_evenly() {
    constexpr int most_refused = 20;  // clips that are too long are passed over, but not a whole library
    int refused = 0;
    std::size_t done = 0;
    std::size_t least_lacking = 0;
    for (const std::size_t at : evenly_spread(rows_.size())) {
      progress_.at("clips", static_cast<double>(done++) / static_cast<double>(rows_.size()));
      const std::size_t lacking = take(at);
      if (lacking == 0) continue;
      least_lacking = refused == 0 ? lacking : std::min(least_lacking, lacking);
      if (++refused >= most_refused) break;
    }
    if (out_.motions.empty()) refuse_size("the map with a single clip", options_.most_bytes + least_lacking);
  }

  void take_named() {
    std::vector<Match> neighbours;
    for (const std::string& name : options_.clips) {
      const ClipRow row = library_.require_clip(name);
      std::vector<Match> matches;
      const std::size_t lacking = take(place_.at(row.name), &matches);
      if (lacking > 0) refuse_size(fmt::format("the clip \"{}\"", name), options_.most_bytes + lacking);
      neighbours.insert(neighbours.end(), matches.begin(), matches.end());
    }
    for (const Match& match : neighbours) static_cast<void>(take(place_.at(match.clip)));
  }

  LibraryView& library_;
  const ViewOptions& options_;
  const Compute& compute_;
  const Progress& progress_;
  std::vector<ClipRow> rows_;
  std::map<std::string, std::size_t> place_;
  std::map<std::int64_t, std::size_t> space_place_;
  std::map<std::int64_t, std::size_t> skeleton_place_;
  std::set<std::size_t> taken_;
  ViewData out_;
};

}  // namespace

std::size_t ViewData::bytes() const {
  std::size_t sum = overview.size();
  for (const Motion& motion : motions) sum += motion.json.size();
  return sum;
}

ViewData view_data(LibraryView& library, const ViewOptions& options, const Compute& compute, const Progress& progress) {
  return ViewBuilder(library, options, compute, progress).build();
}

}  // namespace kinespace::cli
