#include "kinespace/synthesis/detail/library_clips.h"

#include <algorithm>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace {

std::vector<ClipRow> clips_of_one_tree(const LibraryView& library, std::span<const std::string> names) {
  std::vector<ClipRow> rows;
  for (const std::string& name : names) rows.push_back(library.require_clip(name));
  for (const ClipRow& row : rows) {
    if (row.space_id == rows.front().space_id) continue;
    throw Error(ErrorKind::bad_input,
                {.file = library.library().path().string(),
                 .found = fmt::format("{} and {} of different skeletons", rows.front().name, row.name),
                 .expected = "clips of one joint tree",
                 .remedy = "`kinespace info LIB --limit 0` lists which clip has which skeleton"});
  }
  return rows;
}

bool has_labels(const ClipRow& row, std::span<const std::string> wanted) {
  return std::ranges::all_of(
      wanted, [&](const std::string& label) { return std::ranges::find(row.labels, label) != row.labels.end(); });
}

}  // namespace kinespace
