// The main job as a user runs it: build, info, query, export, each a process of its own.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "examples/sample_files.h"
#include "examples/sample_motions.h"
#include "motion/error_measures.h"
#include "motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

// A library of one take of every sample motion, made once: the tests only read it.
class LibraryCommands : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    std::filesystem::create_directory(clips());
    for (const SampleMotion& motion : sample_library({.takes = 1})) write_sample(clips(), motion);
    build_ = run_command({"build", clips(), "-o", library(), "--json"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  void SetUp() override { ASSERT_EQ(build_.code, 0) << build_.err; }

  static std::string clips() { return (*folder_ / "clips").string(); }
  static std::string library() { return (*folder_ / "all.kspace").string(); }
  static std::string walk() { return clips() + "/walk_normal_001.bvh"; }

  static std::unique_ptr<TemporaryFolder> folder_;
  static CommandResult build_;
};
std::unique_ptr<TemporaryFolder> LibraryCommands::folder_;
CommandResult LibraryCommands::build_;

nlohmann::json parsed(const CommandResult& result) {
  EXPECT_EQ(result.code, 0) << result.err;
  return nlohmann::json::parse(result.out);
}

void expect_one_line(const CommandResult& result, int code, const std::string& start) {
  EXPECT_EQ(result.code, code) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, StartsWith("kinespace: " + start));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST_F(LibraryCommands, build_reports_what_it_made) {
  const nlohmann::json json = parsed(build_);
  EXPECT_EQ(json.at("clips"), 24);
  EXPECT_GT(json.at("sequences"), 24);
  EXPECT_GT(json.at("functions"), 1);
  EXPECT_EQ(json.at("bytes"), std::filesystem::file_size(library()));
}

TEST_F(LibraryCommands, info_describes_the_library_under_the_keys_others_rely_on) {
  const nlohmann::json json = parsed(run_command({"info", library(), "--json"}));
  const nlohmann::json build = parsed(build_);
  EXPECT_EQ(json.at("kind"), "library");
  for (const char* key : {"clips", "sequences", "functions", "frames", "bytes"})
    EXPECT_EQ(json.at(key), build.at(key)) << key;
  EXPECT_NEAR(json.at("variance").get<double>(), build.at("variance").get<double>(), 1e-6);
  EXPECT_EQ(json.at("joints"), 22);
  EXPECT_NEAR(json.at("height_cm").get<double>(), 175, 1);
  EXPECT_NEAR(json.at("rate_hz").get<double>(), 60, 1e-3);
}

TEST_F(LibraryCommands, query_by_file_finds_the_clip_itself_first) {
  const nlohmann::json json = parsed(run_command({"query", library(), walk(), "-k", "3", "--json"}));
  EXPECT_EQ(json.at("query"), walk());
  ASSERT_EQ(json.at("matches").size(), 3U);
  const nlohmann::json& first = json.at("matches").at(0);
  EXPECT_EQ(first.at("clip"), "walk_normal_001");
  EXPECT_LT(first.at("start_s"), first.at("end_s"));
  EXPECT_THAT(first.at("labels").get<std::vector<std::string>>(), testing::Contains("walk"));
  EXPECT_LE(first.at("distance"), json.at("matches").at(1).at("distance"));
}

TEST_F(LibraryCommands, query_by_name_leaves_the_clip_itself_out) {
  const nlohmann::json json = parsed(run_command({"query", library(), "walk_normal_001", "-k", "2", "--json"}));
  ASSERT_EQ(json.at("matches").size(), 2U);
  for (const nlohmann::json& match : json.at("matches")) {
    EXPECT_NE(match.at("clip"), "walk_normal_001");
    EXPECT_THAT(match.at("clip").get<std::string>(), StartsWith("walk_"));
  }
}

TEST_F(LibraryCommands, export_plays_a_clip_better_with_more_functions) {
  double last = 1e9;
  for (const char* functions : {"1", "5", "100"}) {
    const std::string output = (*folder_ / functions).string() + ".bvh";
    const nlohmann::json json =
        parsed(run_command({"export", library(), "walk_normal_001", "-o", output, "--lod", functions, "--json"}));
    EXPECT_EQ(json.at("output"), output);
    const double error = compare(read_clip(walk()), read_clip(output)).mean_joint_error_cm;
    EXPECT_LT(error, last);
    last = error;
  }
  EXPECT_LT(last, 1);
}

TEST_F(LibraryCommands, export_writes_gltf) {
  const std::string output = (*folder_ / "walk.glb").string();
  EXPECT_EQ(run_command({"export", library(), "walk_normal_001", "-o", output}).code, 0);
  EXPECT_THAT(read_text(output), StartsWith("glTF"));
}

TEST_F(LibraryCommands, what_is_not_there_or_not_a_library_is_refused) {
  const std::string missing = (*folder_ / "none.kspace").string();
  expect_one_line(run_command({"query", missing, walk()}), 1, missing);
  expect_one_line(run_command({"query", walk(), walk()}), 1, walk());
  const CommandResult no_clip = run_command({"export", library(), "dance", "-o", (*folder_ / "x.bvh").string()});
  EXPECT_EQ(no_clip.code, 2) << "the call is to be mended, not the library";
  EXPECT_THAT(no_clip.err, HasSubstr("dance"));
  EXPECT_FALSE(std::filesystem::exists(*folder_ / "x.bvh"));
}

TEST_F(LibraryCommands, build_of_nothing_or_of_a_broken_clip_is_1_and_leaves_no_library) {
  const TemporaryFolder folder;
  const std::string output = (folder / "out.kspace").string();
  expect_one_line(run_command({"build", folder.path().string(), "-o", output}), 1, "");
  write_text(folder / "broken.bvh", "HIERARCHY\nROOT\n");
  expect_one_line(run_command({"build", (folder / "broken.bvh").string(), "-o", output}), 1,
                  (folder / "broken.bvh").string());
  EXPECT_FALSE(std::filesystem::exists(output));
}

TEST_F(LibraryCommands, two_joint_trees_in_one_build_name_both_files) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(walk(), folder / "man.bvh");
  write_text(folder / "other.bvh", walking_bvh(200, 1));
  const std::string output = (folder / "out.kspace").string();
  const CommandResult mixed = run_command({"build", folder.path().string(), "-o", output});
  expect_one_line(mixed, 1, "");
  EXPECT_THAT(mixed.err, HasSubstr("man.bvh"));
  EXPECT_THAT(mixed.err, HasSubstr("other.bvh"));
  EXPECT_THAT(mixed.err, HasSubstr("--by-skeleton"));
  EXPECT_EQ(run_command({"build", folder.path().string(), "-o", output, "--by-skeleton"}).code, 0);
}

TEST_F(LibraryCommands, output_that_is_an_input_or_cannot_be_written_is_refused) {
  const TemporaryFolder folder;
  const std::string clip = (folder / "walk.bvh").string();
  std::filesystem::copy_file(walk(), clip);
  const std::string before = read_text(clip);
  expect_one_line(run_command({"build", clip, "-o", clip}), 2, clip);
  EXPECT_EQ(read_text(clip), before);
  const std::string nowhere = (folder / "no/such/folder/out.kspace").string();
  EXPECT_EQ(run_command({"build", clip, "-o", nowhere}).code, 3);
  expect_one_line(run_command({"export", library(), "walk_normal_001", "-o", library()}), 2, library());
  expect_one_line(run_command({"export", library(), "walk_normal_001", "-o", nowhere + ".bvh"}), 3, nowhere + ".bvh");
  EXPECT_EQ(run_command({"info", library()}).code, 0) << "the library is as it was";
}

TEST_F(LibraryCommands, ctrl_c_during_a_build_leaves_the_old_library) {
  const TemporaryFolder folder;
  const std::string output = (folder / "out.kspace").string();
  std::filesystem::copy_file(library(), output);
  const std::string before = read_text(output);
  for (const SampleMotion& motion : sample_library({.seed = 5, .takes = 8})) write_sample(folder.path(), motion);
  Command command({"build", folder.path().string(), "-o", output, "--quiet"});
  command.send(SIGINT);
  const CommandResult result = command.finish();
  EXPECT_EQ(result.code, 130) << result.err;
  EXPECT_EQ(read_text(output), before);
  EXPECT_EQ(run_command({"build", folder.path().string(), "-o", output, "--quiet"}).code, 0)
      << "and it can be built later";
}

}  // namespace
}  // namespace kinespace::test
