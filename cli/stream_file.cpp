#include "cli/stream_file.h"

#include <string>

#include "kinespace/codecs/pose_space/library_basis.h"

namespace kinespace::cli {

StreamFile::StreamFile(const std::filesystem::path& path, const std::optional<std::filesystem::path>& library)
    : file_(path) {
  const std::string id = basis_of(file_.bytes(), path.string());
  std::optional<PoseSpaceBasis> basis;
  if (library && !id.empty()) basis = library_basis_by_id(*library, id);
  reader_ = open_stream(file_.bytes(), path.string(), basis ? &*basis : nullptr);
}

}  // namespace kinespace::cli
