// Writes the fixtures that are missing: run it for a new version of a format (fixtures/README.md).
#include <filesystem>
#include <span>

#include "kinespace/base/file.h"
#include "tests/storage/sample_library.h"
#include "tests/storage/sample_stream.h"

int main() {
  using namespace kinespace;
  const std::filesystem::path folder = KINESPACE_FIXTURES;
  if (!std::filesystem::exists(folder / "bitstream_v1.ksm")) {
    write_file_atomically(folder / "bitstream_v1.ksm", std::span<const std::byte>(test::sample_stream()));
  }
  if (!std::filesystem::exists(folder / "library_v1.kspace")) {
    Library library = Library::create(folder / "library_v1.kspace");
    test::fill_sample(library, 3, 40);
  }
}
