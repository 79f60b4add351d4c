#include "fpca/library_view.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "fpca/space_codec.h"
#include "motion/kinematics.h"

namespace kinespace {
namespace {

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j < row.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({row[j - 1] + 1, above + 1, diagonal + (a[i - 1] == b[j - 1] ? 0U : 1U)});
      diagonal = above;
    }
  }
  return row.back();
}

double largest_distance(const JointPositions& a, const JointPositions& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) largest = std::max(largest, (a.values[i] - b.values[i]).norm());
  return largest;
}

}  // namespace

std::string sequence_space_name(const std::string& tree_hash) {
  return "sequences " + tree_hash;
}
std::string clip_space_name(const std::string& tree_hash) {
  return "clips " + tree_hash;
}

LibraryView::LibraryView(const std::filesystem::path& path) : library_(Library::open_read_only(path)) {}

ClipRow LibraryView::require_clip(const std::string& name) const {
  if (auto row = library_.find_clip(name)) return *std::move(row);
  std::string nearest;
  std::size_t least = std::numeric_limits<std::size_t>::max();
  for (const ClipRow& row : library_.clips()) {
    const std::size_t d = edit_distance(name, row.name);
    if (d < least) {
      least = d;
      nearest = row.name;
    }
  }
  throw Error(
      ErrorKind::usage,
      {.file = library_.path().string(),
       .found = fmt::format("no clip \"{}\"", name),
       .remedy = nearest.empty() ? "the library has no clips"
                                 : fmt::format("the nearest name is \"{}\"; kinespace info lists all", nearest)});
}

const MotionSpace& LibraryView::space(std::int64_t space_id) {
  const auto found = spaces_.find(space_id);
  if (found != spaces_.end()) return found->second;
  return spaces_.emplace(space_id, unpack_space(library_.space(space_id).blob, library_.path().string())).first->second;
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

ClipCurves LibraryView::curves(const ClipRow& row, int functions) {
  return decode(space(row.space_id), encoded(row, functions), functions);
}

Clip LibraryView::clip(const ClipRow& row, int functions) {
  return clip_from_curves(curves(row, functions), skeleton(row.skeleton_id));
}

int LibraryView::functions_for_error(const ClipRow& row, double max_error_cm) {
  const MotionSpace& s = space(row.space_id);
  const Skeleton& bones = skeleton(row.skeleton_id);
  const EncodedClip whole = encoded(row);
  const JointPositions best = joint_positions(clip_from_curves(decode(s, whole), bones));
  // The error falls with n but for small waves, so the first n that is good enough is looked for one by one.
  for (int n = 0; n < s.functions(); ++n) {
    if (largest_distance(best, joint_positions(clip_from_curves(decode(s, whole, n), bones))) <= max_error_cm) return n;
  }
  return s.functions();
}

void store_clip(Library& library, const ClipRow& row, const EncodedClip& clip, const MotionSpace& space,
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
