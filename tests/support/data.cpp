#include "tests/support/data.h"

#include <cstdlib>
#include <string>
#include <system_error>

namespace kinespace::test {
namespace {

std::optional<std::filesystem::path> existing(const char* variable, const std::filesystem::path& standard) {
  const char* named = std::getenv(variable);
  const std::filesystem::path path = named != nullptr && *named != '\0' ? std::filesystem::path(named) : standard;
  if (std::filesystem::is_directory(path)) return path;
  return std::nullopt;
}

}  // namespace

std::optional<std::filesystem::path> data_folder() {
  return existing("KINESPACE_DATA", std::filesystem::path(KINESPACE_SOURCE_DIR) / "build/data");
}

std::optional<std::filesystem::path> golden_folder() {
  return existing("KINESPACE_GOLDEN", std::filesystem::path(KINESPACE_SOURCE_DIR) / "../shared/golden/fpca");
}

bool data_required() {
  return std::getenv("CI") != nullptr;
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "kinespace-test-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::system_error(errno, std::generic_category(), name);
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace kinespace::test
