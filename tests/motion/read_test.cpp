#include "kinespace/motion/read.h"

#include <clocale>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kinespace/base/file.h"
#include "kinespace/motion/amc.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/gltf.h"
#include "tests/motion/sample_clips.h"
#include "tests/support/data.h"

#if defined(__SANITIZE_ADDRESS__)
// glibc keeps the parts of LOCPATH for good.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:__argz_add_sep\n";
}
#endif

namespace kinespace::test {
namespace {

using testing::HasSubstr;

TEST(ReadClip, the_ending_says_what_a_file_is_in_any_case) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "a.BVH", small_bvh);
  EXPECT_EQ(read_clip(folder / "a.BVH").skeleton.joint_count(), 4);
  write_file_atomically(folder / "t.Asf", small_asf);
  write_file_atomically(folder / "t.Amc", small_amc);
  EXPECT_EQ(read_clip(folder / "t.Amc").frames, 2);
  for (const char* name : {"a.bvh", "A.BVH", "x/y.z.amc", "a.glb", "a.GLTF"}) EXPECT_TRUE(is_motion_file(name)) << name;
  for (const char* name : {"a.asf", "a", "bvh", "a.bvh.gz", ".bvh", "a.glb.gz", ""})
    EXPECT_FALSE(is_motion_file(name)) << name;
}

TEST(ReadClip, an_amc_finds_its_skeleton_beside_it) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "01_02.amc", small_amc);
  write_file_atomically(folder / "other.asf", small_asf);
  EXPECT_EQ(read_clip(folder / "01_02.amc").frames, 2) << "the only one in the folder";
  write_file_atomically(folder / "more.asf", small_asf);
  const ErrorDetails two = error_of([&] { static_cast<void>(read_clip(folder / "01_02.amc")); });
  EXPECT_THAT(two.found, HasSubstr("2 .asf files"));
  write_file_atomically(folder / "01.asf", replaced(small_asf, "length 7.5", "length 8.5"));
  EXPECT_NEAR(read_clip(folder / "01_02.amc").skeleton.joints[3].end_site->norm(), 8.5 * 2.54 / 0.45, 1e-9)
      << "the one of its name";
  write_file_atomically(folder / "01_02.asf", replaced(small_asf, "length 7.5", "length 9.5"));
  EXPECT_NEAR(read_clip(folder / "01_02.amc").skeleton.joints[3].end_site->norm(), 9.5 * 2.54 / 0.45, 1e-9)
      << "the nearest name";
  EXPECT_NEAR(read_clip(folder / "01_02.amc", folder / "01.asf").skeleton.joints[3].end_site->norm(), 8.5 * 2.54 / 0.45,
              1e-9)
      << "the given one";
}

TEST(ReadClip, what_it_cannot_read_is_a_clear_error) {
  const TemporaryFolder folder;
  const auto error = [&](const char* name) { return error_of([&] { static_cast<void>(read_clip(folder / name)); }); };
  EXPECT_THAT(error("a.fbx").found, HasSubstr("no such file"));
  EXPECT_THAT(error("none.amc").found, HasSubstr("no .asf file"));
  for (const char* name : {"a.fbx", "a", "a.asf", "a.glb"}) std::ofstream(folder / name) << "x";
  std::filesystem::create_directory(folder / "folder");
  EXPECT_THAT(error("a.fbx").found, HasSubstr("FBX"));
  EXPECT_THAT(error("a.glb").expected, HasSubstr("glTF"));
  EXPECT_THAT(error("folder").found, HasSubstr("a folder"));
  EXPECT_THAT(error("a").found, HasSubstr("no ending"));
  EXPECT_THAT(error("a.asf").remedy, HasSubstr(".amc"));
  EXPECT_THAT(error("none.bvh").found, HasSubstr("no such file"));
}

TEST(WriteClip, an_ending_it_cannot_write_is_an_error_of_the_call) {
  const TemporaryFolder folder;
  try {
    write_clip(folder / "a.fbx", random_clip(1, 1));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_THAT(error.details().expected, HasSubstr(".glb"));
  }
}

TEST(WriteClip, an_acclaim_motion_is_two_files) {
  using Paths = std::vector<std::filesystem::path>;
  EXPECT_EQ(files_written("x/a.amc"), (Paths{"x/a.amc", "x/a.asf"}));
  EXPECT_EQ(files_written("x/a.glb"), Paths{"x/a.glb"});
  EXPECT_THROW(static_cast<void>(files_written("a.fbx")), Error);
  EXPECT_EQ(files_read("a.bvh"), Paths{"a.bvh"});
  EXPECT_EQ(files_read("a.amc", "b.asf"), (Paths{"a.amc", "b.asf"}));
}

TEST(WriteClip, every_format_it_writes_and_reads_keeps_the_motion) {
  const TemporaryFolder folder;
  Clip clip = random_clip(1, 40);
  for (auto& joint : clip.skeleton.joints) std::ranges::replace(joint.name, ' ', '_');
  for (const char* name : {"a.bvh", "a.amc"}) {
    write_clip(folder / name, clip);
    EXPECT_LT(largest_distance_by_name(clip, read_clip(folder / name)), 1e-5) << name;
  }
  for (const char* name : {"a.glb", "a.gltf"}) {
    write_clip(folder / name, clip);
    EXPECT_GT(std::filesystem::file_size(folder / name), 1000u);
  }
}

TEST(WriteClip, a_failed_write_leaves_the_old_file_and_nothing_else) {
  const TemporaryFolder folder;
  EXPECT_THROW(write_clip(folder / "none" / "a.bvh", random_clip(1, 2)), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

// A locale whose decimal point is a comma, made in a folder of its own, in force for one scope.
class CommaLocale {
 public:
  CommaLocale() : in_force_(enforce(folder_.path())) {}
  ~CommaLocale() {
    std::locale::global(std::locale::classic());
    std::setlocale(LC_ALL, "C");
    unsetenv("LOCPATH");
  }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;
  [[nodiscard]] bool in_force() const { return in_force_; }

 private:
  static bool enforce(const std::filesystem::path& folder) {
    const std::string make = "localedef -i de_DE -f UTF-8 '" + (folder / "de_DE.UTF-8").string() + "' 2>/dev/null";
    static_cast<void>(std::system(make.c_str()));
    setenv("LOCPATH", folder.c_str(), 1);
    if (std::setlocale(LC_ALL, "de_DE.UTF-8") == nullptr) return false;
    std::locale::global(std::locale("de_DE.UTF-8"));
    return true;
  }

  TemporaryFolder folder_;
  bool in_force_;
};

TEST(Locale, a_comma_locale_changes_nothing_that_is_read_or_written) {
  const Clip clip = random_clip(1, 30);
  const std::string bvh = format_bvh(clip);
  const AcclaimText acclaim = format_amc(clip);
  const std::string gltf = format_gltf(clip, GltfForm::text);
  const CommaLocale comma;
  if (!comma.in_force()) {
    if (data_required()) FAIL() << "localedef cannot make de_DE.UTF-8; is the package locales installed?";
    GTEST_SKIP() << "localedef cannot make de_DE.UTF-8; is the package locales installed?";
  }
  char shown[8];
  std::snprintf(shown, sizeof shown, "%.1f", 0.5);
  ASSERT_STREQ(shown, "0,5");
  EXPECT_EQ(format_bvh(clip), bvh);
  EXPECT_EQ(format_amc(clip).asf, acclaim.asf);
  EXPECT_EQ(format_amc(clip).amc, acclaim.amc);
  EXPECT_EQ(format_gltf(clip, GltfForm::text), gltf);
  EXPECT_LT(largest_distance(clip, parse_bvh(bvh, "t.bvh")), 1e-5);
  EXPECT_EQ(parse_amc(small_amc, parse_asf(small_asf, "t.asf"), "t.amc").frames, 2);
}

}  // namespace
}  // namespace kinespace::test
