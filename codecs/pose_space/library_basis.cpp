#include "kinespace/codecs/pose_space/library_basis.h"

#include <optional>
#include <vector>

#include "kinespace/base/error.h"
#include "kinespace/library/library_view.h"

namespace kinespace {
namespace {

constexpr const char* artifact_kind = "codec basis";
constexpr std::int64_t frames_to_learn_from = 30000;

// Clips of one tree, every so many, until they make up the frames that are wanted.
std::vector<Clip> sample_clips(LibraryView& view, const std::string& tree_hash) {
  std::vector<ClipRow> rows;
  std::int64_t frames = 0;
  for (const ClipRow& row : view.library().clips()) {
    if (view.library().skeleton(row.skeleton_id).tree_hash != tree_hash) continue;
    rows.push_back(row);
    frames += row.frames;
  }
  const std::int64_t every = std::max<std::int64_t>(1, frames / frames_to_learn_from);
  std::vector<Clip> out;
  for (std::size_t i = 0; i < rows.size(); i += static_cast<std::size_t>(every)) out.push_back(view.clip(rows[i]));
  return out;
}

}  // namespace

PoseSpaceBasis library_basis(const std::filesystem::path& library, const std::string& tree_hash,
                             const Progress& progress) {
  LibraryView view(library);
  if (const auto stored = view.library().artifact(artifact_kind, tree_hash)) {
    return PoseSpaceBasis::unpack(*stored, library.string());
  }
  const std::vector<Clip> clips = sample_clips(view, tree_hash);
  if (clips.empty()) {
    throw Error(ErrorKind::usage, {.file = library.string(),
                                   .found = "no clips of the skeleton that is to be encoded",
                                   .expected = "a library of such clips, or no library"});
  }
  PoseSpaceBasis basis = PoseSpaceBasis::learn(clips, progress);
  Library writable = Library::open(library);
  writable.put_artifact(artifact_kind, tree_hash, basis.pack());
  return basis;
}

PoseSpaceBasis library_basis_by_id(const std::filesystem::path& library, const std::string& id) {
  const LibraryView view(library);
  for (const std::string& key : view.library().artifact_keys(artifact_kind)) {
    PoseSpaceBasis basis =
        PoseSpaceBasis::unpack(view.library().artifact(artifact_kind, key).value(), library.string());
    if (basis.id() == id) return basis;
  }
  throw Error(ErrorKind::usage, {.file = library.string(),
                                 .found = "not the basis that the stream was made with",
                                 .expected = "the library that it was encoded with (basis " + id + ")"});
}

}  // namespace kinespace
