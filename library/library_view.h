// A library as motions: its spaces, and its clips decoded at any level of detail.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kinespace/fpca/clip_space.h"
#include "kinespace/fpca/encoding.h"
#include "kinespace/storage/library.h"

namespace kinespace {

// Names of the rows that hold the spaces of one joint tree: "sequences TREE" and "clips TREE".
[[nodiscard]] std::string sequence_space_name(const std::string& tree_hash);
[[nodiscard]] std::string clip_space_name(const std::string& tree_hash);

// What ClipRow::source_hash holds: the content_hash of the file, for AMC with that of its skeleton file behind it, for one
// of several animations of a file with " animation NAME" behind it.
[[nodiscard]] std::string source_hash_of(const std::filesystem::path& file,
                                         const std::optional<std::filesystem::path>& asf = {},
                                         const std::string& animation = {});

class LibraryView {
 public:
  explicit LibraryView(const std::filesystem::path& path);

  [[nodiscard]] const Library& library() const { return library_; }

  // The clip of that name. Throws Error{usage} naming the nearest name when there is none.
  [[nodiscard]] ClipRow require_clip(const std::string& name) const;

  // Loaded on first use and kept.
  [[nodiscard]] const RegisteredSpace& space(std::int64_t space_id);
  [[nodiscard]] const ClipSpace& clip_space(std::int64_t space_id);
  [[nodiscard]] const Skeleton& skeleton(std::int64_t skeleton_id);
  // The space for clips of such a skeleton; nullopt when the library has none.
  [[nodiscard]] std::optional<std::int64_t> space_for(const Skeleton& skeleton) const;

  // At level of detail `functions` (all when < 0).
  [[nodiscard]] EncodedClip encoded(const ClipRow& row, int functions = -1);
  [[nodiscard]] ClipCurves curves(const ClipRow& row, int functions = -1);
  [[nodiscard]] Clip clip(const ClipRow& row, int functions = -1);

  // A clip outside the library, encoded by the functions of its space, without warps, with its detail
  // (fpca/level_errors.h) and feet (footskate/kept_feet.h). Throws Error{bad_input} naming `file` when the library has no space for its skeleton.
  [[nodiscard]] EncodedClip encode(const Clip& clip, const std::filesystem::path& file);
  // The space that it is encoded in. Throws likewise.
  [[nodiscard]] const RegisteredSpace& require_space_for(const Clip& clip, const std::filesystem::path& file);

  // The clip as it was read, where the file that it came from is still there unchanged.
  [[nodiscard]] std::optional<Clip> unchanged_source(const ClipRow& row) const;

  // How far the joints of a clip are from those that were read, of the levels of detail that were measured; its scores are
  // not looked at.
  [[nodiscard]] std::vector<LevelError> level_errors(const ClipRow& row);

  // What the library keeps of the clip's feet; nullopt where nothing is planted, and in libraries of before feet were
  // kept.
  [[nodiscard]] std::optional<KeptFeet> feet(const ClipRow& row);

  // The fewest functions whose decoded clip is, at every joint and frame, within the given distance in cm of the clip
  // as it was read. Where the file it was read from is still there unchanged, that is measured; else the fewest of the
  // levels whose error was measured when the library was built; where these are not known (clips of before, and those
  // that others were added to), the error of all functions plus the distance from what they give, which is never less.
  // Throws Error{usage} when even all functions do not come that near, or nothing is known of how near they come.
  struct LevelOfDetail {
    int functions = 0;
    double max_error_cm = 0;     // of that level: measured, or a bound
    bool from_the_file = false;  // measured against it
  };
  [[nodiscard]] LevelOfDetail level_for_error(const ClipRow& row, double max_error_cm);
  // The same of a clip outside the library, as encode() encoded it.
  [[nodiscard]] LevelOfDetail level_for_error(const EncodedClip& encoded, const Clip& clip, double max_error_cm);

 private:
  Library library_;
  std::map<std::int64_t, RegisteredSpace> spaces_;
  std::map<std::int64_t, ClipSpace> clip_spaces_;
  std::map<std::int64_t, Skeleton> skeletons_;
};

// Writes one clip's rows; used by the builder and by whoever adds to a library.
void store_clip(Library& library, const ClipRow& row, const EncodedClip& clip, const RegisteredSpace& space,
                const std::vector<float>& retrieval, bool replace_blobs);

}  // namespace kinespace
