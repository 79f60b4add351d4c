#include "kinespace/library/library_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/base/nearest_name.h"
#include "kinespace/fpca/level_errors.h"
#include "kinespace/library/detail/space_codec.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

constexpr std::string_view before_animation = " animation ";

bool looks_like_a_file(const std::string& name) {
  const FileFormat* format = find_format(name);
  const bool of_motion = format != nullptr && (format->read != nullptr || !format->instead.empty());
  return name.find('/') != std::string::npos || of_motion;
}

double largest_distance(const JointPositions& a, const JointPositions& b) {
  if (a.values.size() != b.values.size()) return std::numeric_limits<double>::infinity();
  double largest = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) largest = std::max(largest, (a.values[i] - b.values[i]).norm());
  return largest;
}

// `known`: how near all functions come.
[[noreturn]] void refuse_level(const Library& library, const std::string& clip, const std::string& known,
                               double asked_cm) {
  const bool nothing = known == "nothing";
  throw Error(ErrorKind::usage,
              {.file = library.path().string(),
               .found = fmt::format("a largest error of {:.3g} cm asked of the clip \"{}\"", asked_cm, clip),
               .expected = nothing ? "an error that can be promised: the library does not know how near its functions "
                                     "come to the clip as it was read, and the file it came from is not there unchanged"
                                   : fmt::format("at least {}: so near do all its functions come to the clip as it "
                                                 "was read",
                                                 known),
               .remedy = "ask for less with --lod, or build the library with more functions"});
}

// The fewest functions whose largest distance from `target`, and `unseen_cm` on top, is within the limit; nullopt: not
// even all are. `error`: that of the last that was tried.
std::optional<int> first_level_within(const RegisteredSpace& space, const EncodedClip& clip, const Skeleton& bones,
                                      const JointPositions& target, double unseen_cm, double limit_cm, double& error) {
  error = unseen_cm;
  // The error falls with n but for small waves, so the first n that is good enough is looked for one by one.
  for (int n = 0; n <= space.levels() && unseen_cm <= limit_cm; ++n) {
    error = unseen_cm + largest_distance(target, joint_positions(clip_from_curves(decode(space, clip, n), bones)));
    if (error <= limit_cm) return n;
  }
  return std::nullopt;
}

}  // namespace

std::string sequence_space_name(const std::string& tree_hash) {
  return "sequences " + tree_hash;
}
std::string clip_space_name(const std::string& tree_hash) {
  return "clips " + tree_hash;
}

std::string source_hash_of(const std::filesystem::path& file, const std::optional<std::filesystem::path>& asf,
                           const std::string& animation) {
  std::string hash;
  for (const auto& part : files_read(file, asf)) hash += hash_of_file(part);
  return animation.empty() ? hash : hash + std::string(before_animation) + animation;
}

LibraryView::LibraryView(const std::filesystem::path& path) : library_(Library::open_read_only(path)) {}

ClipRow LibraryView::require_clip(const std::string& name) const {
  if (auto row = library_.find_clip(name)) return *std::move(row);
  std::error_code ignored;
  if (std::filesystem::exists(name, ignored)) {
    throw Error(ErrorKind::usage, {.file = name,
                                   .found = "a file or folder",
                                   .expected = "the name of a clip of " + library_.path().string(),
                                   .remedy = "`kinespace build --add` adds clips to a library"});
  }
  std::vector<std::string> names;
  for (const ClipRow& row : library_.clips()) names.push_back(row.name);
  const auto nearest = nearest_name(name, names);
  const bool file = looks_like_a_file(name);
  throw Error(
      file ? ErrorKind::bad_input : ErrorKind::usage,
      {.file = file ? name : library_.path().string(),
       .found = file ? "no such file, and no clip of that name in " + library_.path().string()
                     : fmt::format("no clip \"{}\"", name),
       .remedy = nearest ? fmt::format("the nearest name is \"{}\"; `kinespace info LIB --limit 0` lists all", *nearest)
                         : "the library has no clips"});
}

const RegisteredSpace& LibraryView::space(std::int64_t space_id) {
  const auto found = spaces_.find(space_id);
  if (found != spaces_.end()) return found->second;
  return spaces_.emplace(space_id, unpack_registered_space(library_.space(space_id).blob, library_.path().string()))
      .first->second;
}

const ClipSpace& LibraryView::clip_space(std::int64_t space_id) {
  const auto found = clip_spaces_.find(space_id);
  if (found != clip_spaces_.end()) return found->second;
  const std::string wanted = clip_space_name(library_.space(space_id).tree_hash);
  for (const SpaceRow& row : library_.spaces()) {
    if (row.name != wanted) continue;
    return clip_spaces_.emplace(space_id, ClipSpace::unpack(library_.space(row.id).blob, library_.path().string()))
        .first->second;
  }
  throw Error(ErrorKind::bad_input, {.file = library_.path().string(),
                                     .found = "no index of whole clips",
                                     .expected = "a space of the name " + wanted,
                                     .remedy = "build the library again"});
}

const Skeleton& LibraryView::skeleton(std::int64_t skeleton_id) {
  const auto found = skeletons_.find(skeleton_id);
  if (found != skeletons_.end()) return found->second;
  return skeletons_.emplace(skeleton_id, unpack_skeleton(library_.skeleton(skeleton_id).blob, library_.path().string()))
      .first->second;
}

std::optional<std::int64_t> LibraryView::space_for(const Skeleton& skeleton) const {
  const std::string wanted = sequence_space_name(skeleton.tree_hash());
  for (const SpaceRow& row : library_.spaces()) {
    if (row.name == wanted) return row.id;
  }
  return std::nullopt;
}

EncodedClip LibraryView::encoded(const ClipRow& row, int functions) {
  const PackedClip packed{library_.clip_blob(row.id, ClipBlob::vectors), library_.clip_blob(row.id, ClipBlob::warps),
                          library_.clip_blob(row.id, ClipBlob::side)};
  const EncodedClip header{.name = row.name, .rate_hz = row.rate_hz, .frames = static_cast<int>(row.frames)};
  const std::string source = fmt::format("{} (clip {})", library_.path().string(), row.name);
  return unpack_clip(packed, space(row.space_id), skeleton(row.skeleton_id), header, source, functions);
}

const RegisteredSpace& LibraryView::require_space_for(const Clip& clip, const std::filesystem::path& file) {
  if (const std::optional<std::int64_t> id = space_for(clip.skeleton)) return space(*id);
  throw Error(ErrorKind::bad_input, {.file = file.string(),
                                     .found = "a skeleton that no clip of " + library_.path().string() + " has",
                                     .expected = "the joint names, parents and channels of the library's clips",
                                     .remedy = "`kinespace build --add --by-skeleton` gives it a space of its own"});
}

EncodedClip LibraryView::encode(const Clip& clip, const std::filesystem::path& file) {
  const RegisteredSpace& of = require_space_for(clip, file);
  EncodedClip out = encode_clip(of, clip);
  round_to_stored(out, of);
  ClipCurves curves = clip_curves(clip);
  of.apply_references(curves.values);
  measure_levels(ClipDecoder(of), curves, clip.skeleton, of.levels(), out);
  out.feet = keep_feet(clip, out.placement);
  return out;
}

std::vector<LevelError> LibraryView::level_errors(const ClipRow& row) {
  return unpack_level_errors(library_.clip_blob(row.id, ClipBlob::side), space(row.space_id),
                             fmt::format("{} (clip {})", library_.path().string(), row.name));
}

std::optional<KeptFeet> LibraryView::feet(const ClipRow& row) {
  return unpack_clip_feet(library_.clip_blob(row.id, ClipBlob::side), static_cast<int>(row.frames),
                          skeleton(row.skeleton_id), fmt::format("{} (clip {})", library_.path().string(), row.name));
}

ClipCurves LibraryView::curves(const ClipRow& row, int functions) {
  return decode(space(row.space_id), encoded(row), functions);
}

Clip LibraryView::clip(const ClipRow& row, int functions) {
  return clip_from_curves(curves(row, functions), skeleton(row.skeleton_id));
}

std::optional<Clip> LibraryView::unchanged_source(const ClipRow& row) const {
  const std::filesystem::path file = row.source;
  std::error_code ignored;
  if (!is_motion_file(file) || !std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  try {
    const std::size_t named = row.source_hash.find(before_animation);
    const std::string animation =
        named == std::string::npos ? "" : row.source_hash.substr(named + before_animation.size());
    if (source_hash_of(file, {}, animation) != row.source_hash) return std::nullopt;
    Clip clip = read_clip(file, {.animation = animation});
    if (clip.frames != row.frames) return std::nullopt;
    return clip;
  } catch (const Error&) {
    return std::nullopt;  // a skeleton that is not beside it any more, say: then the file is not what it was
  }
}

LibraryView::LevelOfDetail LibraryView::level_for_error(const ClipRow& row, double max_error_cm) {
  const RegisteredSpace& s = space(row.space_id);
  const Skeleton& bones = skeleton(row.skeleton_id);
  const EncodedClip whole = encoded(row);
  const std::optional<Clip> source = unchanged_source(row);
  if (!source && !whole.levels.empty()) {
    for (const LevelError& l : whole.levels) {
      if (l.error.max_joint_error_cm <= max_error_cm) return {l.level, l.error.max_joint_error_cm, false};
    }
    refuse_level(library_, row.name, fmt::format("{:.3g} cm", whole.levels.back().error.max_joint_error_cm),
                 max_error_cm);
  }
  const JointPositions target = joint_positions(source ? *source : clip_from_curves(decode(s, whole), bones));
  // The library keeps errors as 32-bit floats.
  const double unseen_cm = source ? 0 : whole.error.max_joint_error_cm * (1 + 1e-6);
  if (!std::isfinite(unseen_cm)) refuse_level(library_, row.name, "nothing", max_error_cm);
  double error = unseen_cm;
  if (const auto n = first_level_within(s, whole, bones, target, unseen_cm, max_error_cm, error)) {
    return {*n, error, source.has_value()};
  }
  refuse_level(library_, row.name, fmt::format("{:.3g} cm", error), max_error_cm);
}

LibraryView::LevelOfDetail LibraryView::level_for_error(const EncodedClip& encoded, const Clip& clip,
                                                        double max_error_cm) {
  double error = 0;
  const RegisteredSpace& s = require_space_for(clip, clip.name);
  if (const auto n = first_level_within(s, encoded, clip.skeleton, joint_positions(clip), 0, max_error_cm, error)) {
    return {*n, error, true};
  }
  refuse_level(library_, clip.name, fmt::format("{:.3g} cm", error), max_error_cm);
}

void store_clip(Library& library, const ClipRow& row, const EncodedClip& clip, const RegisteredSpace& space,
                const std::vector<float>& retrieval, bool replace_blobs) {
  PackedClip packed = pack_clip(clip, space);
  const ClipBlobs blobs{std::move(packed.vectors), std::move(packed.warps), std::move(packed.side), retrieval};
  if (replace_blobs) {
    library.replace_clip_blobs(row.id, blobs);
  } else {
    library.add_clip(row, blobs);
  }
}

}  // namespace kinespace
