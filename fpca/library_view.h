// A library as motions: its spaces, and its clips decoded at any level of detail.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fpca/clip_space.h"
#include "fpca/encoding.h"
#include "storage/library.h"

namespace kinespace {

// Names of the rows that hold the spaces of one joint tree: "sequences TREE" and "clips TREE".
[[nodiscard]] std::string sequence_space_name(const std::string& tree_hash);
[[nodiscard]] std::string clip_space_name(const std::string& tree_hash);

class LibraryView {
 public:
  explicit LibraryView(const std::filesystem::path& path);

  [[nodiscard]] const Library& library() const { return library_; }

  // The clip of that name. Throws Error{usage} naming the nearest name when there is none.
  [[nodiscard]] ClipRow require_clip(const std::string& name) const;

  // Loaded on first use and kept.
  [[nodiscard]] const MotionSpace& space(std::int64_t space_id);
  [[nodiscard]] const ClipSpace& clip_space(std::int64_t space_id);
  [[nodiscard]] const Skeleton& skeleton(std::int64_t skeleton_id);
  // The space for clips of such a skeleton; nullopt when the library has none.
  [[nodiscard]] std::optional<std::int64_t> space_for(const Skeleton& skeleton) const;

  // With at most `functions` functions (all when < 0).
  [[nodiscard]] EncodedClip encoded(const ClipRow& row, int functions = -1);
  [[nodiscard]] ClipCurves curves(const ClipRow& row, int functions = -1);
  [[nodiscard]] Clip clip(const ClipRow& row, int functions = -1);

  // The fewest functions whose decoded clip is, at every joint and frame, within the given distance in cm of what all
  // functions give.
  [[nodiscard]] int functions_for_error(const ClipRow& row, double max_error_cm);

 private:
  Library library_;
  std::map<std::int64_t, MotionSpace> spaces_;
  std::map<std::int64_t, ClipSpace> clip_spaces_;
  std::map<std::int64_t, Skeleton> skeletons_;
};

// Writes one clip's rows; used by the builder and by whoever adds to a library.
void store_clip(Library& library, const ClipRow& row, const EncodedClip& clip, const MotionSpace& space,
                const std::vector<float>& retrieval, bool replace_blobs);

}  // namespace kinespace
