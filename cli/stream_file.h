// A stream as a user names it: the file, and the library whose basis it may need.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "kinespace/base/file.h"
#include "kinespace/codecs/registry.h"

namespace kinespace::cli {

class StreamFile {
 public:
  // `library`: looked at only when the stream was made with a basis. Throws Error.
  StreamFile(const std::filesystem::path& path, const std::optional<std::filesystem::path>& library);

  [[nodiscard]] const StreamReader& reader() const { return *reader_; }
  [[nodiscard]] std::size_t bytes() const { return file_.bytes().size(); }

 private:
  FileContent file_;
  std::unique_ptr<StreamReader> reader_;
};

}  // namespace kinespace::cli
