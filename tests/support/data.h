// Where the tests find real data, and temporary places to write to.
#pragma once

#include <filesystem>
#include <optional>
#include <utility>

namespace kinespace::test {

// The folder with cmu/, bandai1/, bandai2/: $KINESPACE_DATA, else build/data of the checkout; nullopt when it is not
// there.
[[nodiscard]] std::optional<std::filesystem::path> data_folder();

// The folder with the golden FPCA cases: $KINESPACE_GOLDEN, else ../shared/golden/fpca beside the checkout.
[[nodiscard]] std::optional<std::filesystem::path> golden_folder();

// True in CI, where missing data is a failure.
[[nodiscard]] bool data_required();

// A folder that is removed with everything in it at the end of the scope.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace kinespace::test

// Gives `variable` the folder, or ends the test: as a failure in CI, as a visible skip elsewhere.
#define KINESPACE_REQUIRE_FOLDER(variable, lookup)                                                \
  auto variable##_found = ::kinespace::test::lookup();                                            \
  if (!variable##_found) {                                                                        \
    if (::kinespace::test::data_required()) FAIL() << "the shared data is missing (" #lookup ")"; \
    GTEST_SKIP() << "the shared data is not beside this checkout (" #lookup ")";                  \
  }                                                                                               \
  const std::filesystem::path variable = std::move(*variable##_found)
