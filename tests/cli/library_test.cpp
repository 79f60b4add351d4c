// build, query, export and info as a user runs them, on the sample clips.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "examples/sample_motions.h"
#include "kinespace/base/file.h"
#include "kinespace/library/library_view.h"
#include "kinespace/motion/read.h"
#include "kinespace/storage/library_build.h"
#include "tests/cli/run_command.h"
#include "tests/cli/sample_clips.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using nlohmann::json;

class LibraryCommands : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    write_sample_clips(clips());
    // A name that a shell, an SQL statement or a path splitter could trip over.
    std::filesystem::copy_file(clips() / "walk_normal_001.bvh", clips() / "it's a \"walk\": 1.bvh");
    built_ = run_command({"build", clips().string(), "-o", library().string(), "--json"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::filesystem::path clips() { return *folder_ / "some clips"; }
  static std::filesystem::path library() { return *folder_ / "a library.kspace"; }
  static std::filesystem::path out(const char* name) { return *folder_ / name; }

  static std::unique_ptr<TemporaryFolder> folder_;
  static CommandResult built_;
};
std::unique_ptr<TemporaryFolder> LibraryCommands::folder_;
CommandResult LibraryCommands::built_;

TEST_F(LibraryCommands, build_reports_what_it_made) {
  ASSERT_EQ(built_.code, 0) << built_.err;
  const json report = json::parse(built_.out);
  for (const char* key : {"clips", "sequences", "functions", "all_functions", "variance", "bytes"})
    EXPECT_TRUE(report.contains(key)) << key;
  EXPECT_LT(report["mean_joint_error_cm"], 0.1);
  EXPECT_FALSE(std::filesystem::exists(library().string() + ".partial"));
}

TEST_F(LibraryCommands, build_counts_functions_over_all_groups_and_sets) {
  const std::string grouped = out("grouped.kspace").string();
  const CommandResult built =
      run_command({"build", clips().string(), "-o", grouped, "--grouping", "component", "--json"});
  ASSERT_EQ(built.code, 0) << built.err;
  const json report = json::parse(built.out);
  const json info = json::parse(run_command({"info", grouped, "--json"}).out);
  int counted = 0;
  int most = 0;
  for (const json& set : info["spaces"][0]["sets"]) {
    counted += set["functions"].get<int>();
    most = std::max(most, set["functions_of_a_curve"].get<int>());
  }
  EXPECT_EQ(report["all_functions"], counted);
  EXPECT_EQ(report["functions"], most);
  EXPECT_GT(counted, 2 * most) << "seven groups";
}

TEST_F(LibraryCommands, info_describes_the_library_in_the_promised_keys) {
  const CommandResult result = run_command({"info", library().string(), "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json info = json::parse(result.out);
  EXPECT_EQ(info["kind"], "library");
  for (const char* key :
       {"frames", "rate_hz", "joints", "height_cm", "clips", "sequences", "functions", "variance", "bytes"}) {
    EXPECT_TRUE(info.contains(key) && info[key].is_number()) << key;
  }
}

TEST_F(LibraryCommands, info_draws_the_cycles_of_a_clip) {
  const auto picture_of = [](const std::vector<std::string>& what) {
    std::vector<std::string> words{"info"};
    words.insert(words.end(), what.begin(), what.end());
    words.insert(words.end(), {"--picture", out("registration.svg").string()});
    const CommandResult result = run_command(words);
    EXPECT_EQ(result.code, 0) << result.err;
    std::ifstream file(out("registration.svg"));
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string of_library = picture_of({library().string(), "--clip", "walk_normal_001"});
  EXPECT_NE(of_library.find("walk_normal_001: "), std::string::npos);
  EXPECT_NE(of_library.find("whole cycles, time linear in each"), std::string::npos);
  EXPECT_NE(picture_of({library().string()}).find("whole cycles, time linear in each"), std::string::npos);
  EXPECT_NE(picture_of({(clips() / "walk_normal_001.bvh").string()}).find("before: "), std::string::npos);
  EXPECT_NE(picture_of({(clips() / "stand_calm_001.bvh").string()}).find("no whole cycles found"), std::string::npos);
  const CommandResult unknown =
      run_command({"info", library().string(), "--picture", out("x.svg").string(), "--clip", "walk_normal_002"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_NE(unknown.err.find("walk_normal_001"), std::string::npos) << "the nearest name";
  EXPECT_FALSE(std::filesystem::exists(out("x.svg")));
}

TEST_F(LibraryCommands, query_lists_the_nearest_first) {
  const CommandResult result = run_command({"query", library().string(), "walk_normal_001", "-k", "3", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json answer = json::parse(result.out);
  EXPECT_EQ(answer["query"], "walk_normal_001");
  ASSERT_EQ(answer["matches"].size(), 3U);
  EXPECT_EQ(answer["matches"][0]["clip"], "it's a \"walk\": 1");
  for (const char* key : {"clip", "distance", "start_s", "end_s", "labels"})
    EXPECT_TRUE(answer["matches"][0].contains(key)) << key;
  EXPECT_LE(answer["matches"][0]["distance"], answer["matches"][1]["distance"]);
}

TEST_F(LibraryCommands, query_takes_a_file_and_a_name_with_quotes_and_colons) {
  const CommandResult file =
      run_command({"query", library().string(), (clips() / "run_fast_001.bvh").string(), "-k", "1", "--json"});
  ASSERT_EQ(file.code, 0) << file.err;
  EXPECT_EQ(json::parse(file.out)["matches"][0]["clip"], "run_fast_001");
  EXPECT_EQ(run_command({"query", library().string(), "it's a \"walk\": 1"}).code, 0);
}

TEST_F(LibraryCommands, query_finds_stretches_inside_clips) {
  const CommandResult result = run_command({"query", library().string(), "walk_normal_001", "--windows", "--from",
                                            "0.2", "--to", "0.9", "-k", "3", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json answer = json::parse(result.out);
  ASSERT_EQ(answer["matches"].size(), 3U);
  EXPECT_EQ(answer["matches"][0]["clip"], "it's a \"walk\": 1");
  EXPECT_NEAR(answer["matches"][0]["start_s"].get<double>(), 0.2, 1e-6);
  EXPECT_NEAR(answer["matches"][0]["end_s"].get<double>(), 0.9, 1e-6);
  const auto fails = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"query", library().string(), "walk_normal_001"});
    return run_command(arguments).code;
  };
  EXPECT_EQ(fails({"--windows", "--from", "1000"}), 2);
  EXPECT_EQ(fails({"--from", "0.2"}), 2);
}

TEST_F(LibraryCommands, export_plays_at_a_level_of_detail) {
  double before = 1e9;
  for (const char* lod : {"2", "5", "100"}) {
    const CommandResult result =
        run_command({"export", library().string(), "walk_fast_001", "-o", out("played.bvh").string(), "--lod", lod});
    ASSERT_EQ(result.code, 0) << result.err;
    const CommandResult compared =
        run_command({"compare", (clips() / "walk_fast_001.bvh").string(), out("played.bvh").string(), "--json"});
    const double error = json::parse(compared.out)["mean_joint_error_cm"];
    EXPECT_LT(error, before);
    before = error;
  }
  EXPECT_EQ(run_command({"export", library().string(), "walk_fast_001", "-o", out("played.glb").string()}).code, 0);
}

TEST_F(LibraryCommands, export_keeps_to_an_error) {
  const CommandResult result = run_command(
      {"export", library().string(), "run_fast_001", "-o", out("near.bvh").string(), "--max-error", "2", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json report = json::parse(result.out);
  EXPECT_LT(report["functions"], report["of_functions"]);
  const CommandResult compared =
      run_command({"compare", (clips() / "run_fast_001.bvh").string(), out("near.bvh").string(), "--json"});
  EXPECT_LT(json::parse(compared.out)["max_joint_error_cm"], 3);
}

TEST_F(LibraryCommands, export_of_few_functions_keeps_the_feet) {
  const auto exported = [&](std::vector<std::string> more) {
    more.insert(more.begin(),
                {"export", library().string(), "walk_fast_001", "-o", out("feet.bvh").string(), "--json"});
    const CommandResult result = run_command(more);
    EXPECT_EQ(result.code, 0) << result.err;
    return json::parse(result.out);
  };
  const json few = exported({"--lod", "5"});
  EXPECT_EQ(few["feet_planted"], true);
  EXPECT_LE(few["foot_slide_cm_s"].get<double>(), 1.3 * few["foot_slide_original_cm_s"].get<double>() + 0.5);
  EXPECT_GT(few["foot_slide_unplanted_cm_s"].get<double>(), few["foot_slide_cm_s"].get<double>());
  EXPECT_LE(few["floor_penetration_cm"].get<double>(), 0.5);
  EXPECT_EQ(few["root_errors_against"], "the clip as it was read");
  EXPECT_LT(std::abs(few["root_height_drift_cm"].get<double>()), 0.1);
  EXPECT_LT(std::abs(few["heading_drift_deg"].get<double>()), 0.1);
  // What is said is so of the file.
  const json compared = json::parse(
      run_command({"compare", (clips() / "walk_fast_001.bvh").string(), out("feet.bvh").string(), "--json"}).out);
  EXPECT_NEAR(compared["mean_joint_error_cm"].get<double>(), few["mean_joint_error_cm"].get<double>(), 1e-3);
  EXPECT_NEAR(compared["foot_slide_cm_s"].get<double>(), few["foot_slide_cm_s"].get<double>(), 1e-2);
  const json bare = exported({"--lod", "5", "--no-plant-feet"});
  EXPECT_EQ(bare["feet_planted"], false);
  EXPECT_EQ(bare["foot_slide_cm_s"], few["foot_slide_unplanted_cm_s"]);
  EXPECT_EQ(exported({"--lod", "10"})["feet_planted"], false);
  EXPECT_EQ(exported({"--lod", "10", "--plant-feet"})["feet_planted"], true);
  EXPECT_EQ(exported({"--max-error", "20"})["feet_planted"], false);
}

TEST_F(LibraryCommands, export_plays_a_clip_that_is_not_in_the_library) {
  write_clip(out("stranger.bvh"), make_walk({.speed_m_s = 1.1, .take = {.seed = 99}}).clip);
  const auto before = hash_of_file(library());
  const auto exported = [&](const std::vector<std::string>& more) {
    std::vector<std::string> line = {"export", library().string(),         "--clip", out("stranger.bvh").string(),
                                     "-o",     out("played.bvh").string(), "--json"};
    line.insert(line.end(), more.begin(), more.end());
    return run_command(line);
  };
  const CommandResult result = exported({"--lod", "8"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json report = json::parse(result.out);
  EXPECT_EQ(report["clip"], "stranger");
  EXPECT_EQ(report["functions"], 8);
  const json compared =
      json::parse(run_command({"compare", out("stranger.bvh").string(), out("played.bvh").string(), "--json"}).out);
  EXPECT_NEAR(compared["mean_joint_error_cm"].get<double>(), report["mean_joint_error_cm"].get<double>(), 1e-3);
  EXPECT_NEAR(compared["max_joint_error_cm"].get<double>(), report["max_joint_error_cm"].get<double>(), 1e-2);
  EXPECT_LT(report["mean_joint_error_cm"].get<double>(), 3);
  EXPECT_LE(report["foot_slide_cm_s"].get<double>(), 1.3 * report["foot_slide_original_cm_s"].get<double>() + 0.5);
  EXPECT_EQ(hash_of_file(library()), before);
  const CommandResult near = exported({"--max-error", "5"});
  ASSERT_EQ(near.code, 0) << near.err;
  EXPECT_LE(json::parse(near.out)["max_joint_error_cm"].get<double>(), 5);

  EXPECT_EQ(run_command({"export", library().string(), "-o", out("played.bvh").string()}).code, 2);
  EXPECT_EQ(run_command({"export", library().string(), "walk_fast_001", "--clip", out("stranger.bvh").string(), "-o",
                         out("played.bvh").string()})
                .code,
            2);
  Clip other = make_clip("other", sample_skeleton(), 60, 30);
  other.skeleton.joints.back().name = "other";
  write_clip(out("other.bvh"), other);
  const CommandResult refused = run_command(
      {"export", library().string(), "--clip", out("other.bvh").string(), "-o", out("played.bvh").string()});
  EXPECT_EQ(refused.code, 1);
  EXPECT_NE(refused.err.find("other.bvh"), std::string::npos) << refused.err;
}

// What libraries were before feet were kept.
void forget_feet(const std::filesystem::path& path) {
  LibraryBuild build(path, {.fingerprint = "without feet", .extend = true});
  LibraryView view(path);
  for (const ClipRow& row : view.library().clips()) {
    EncodedClip clip = view.encoded(row);
    clip.feet.reset();
    store_clip(build.library(), row, clip, view.space(row.space_id), view.library().retrieval_vector(row.id), true);
  }
  build.finish();
}

TEST_F(LibraryCommands, a_library_of_before_feet_were_kept_plays_without_planting) {
  const std::filesystem::path old = out("of before.kspace");
  std::filesystem::copy_file(library(), old);
  forget_feet(old);
  const CommandResult result =
      run_command({"export", old.string(), "walk_fast_001", "-o", out("old.bvh").string(), "--lod", "5", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json report = json::parse(result.out);
  EXPECT_EQ(report["feet_planted"], false);
  EXPECT_TRUE(report["foot_slide_cm_s"].is_null());
  EXPECT_NE(result.err.find("build it again"), std::string::npos) << result.err;
  const json info = json::parse(run_command({"info", old.string(), "--json"}).out);
  EXPECT_EQ(info["clips_with_feet"], 0);
  const json now = json::parse(run_command({"info", library().string(), "--json"}).out);
  EXPECT_GT(now["clips_with_feet"], 10);
  EXPECT_GT(now["foot_contacts"], now["clips_with_feet"]);
}

TEST_F(LibraryCommands, wrong_input_is_told_in_one_line) {
  const auto expect = [](const CommandResult& result, int code, const std::string& part) {
    EXPECT_EQ(result.code, code) << result.err;
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
  };
  expect(run_command({"query", library().string(), "walk_normal_01"}), 2, "walk_normal_001");
  expect(run_command({"query", (clips() / "run_fast_001.bvh").string(), "x"}), 1, "run_fast_001.bvh");
  expect(run_command({"build", "/nowhere", "-o", out("x.kspace").string(), "--quiet"}), 1, "/nowhere");
  expect(run_command({"build", clips().string(), "-o", "/proc/x.kspace", "--quiet"}), 3, "/proc");
  expect(run_command({"export", library().string(), "run_fast_001", "-o", library().string()}), 2, "library");
  std::filesystem::create_directory(out("empty"));
  expect(run_command({"build", out("empty").string(), "-o", out("x.kspace").string(), "--quiet"}), 1,
         "no motion files");
}

TEST_F(LibraryCommands, a_damaged_clip_is_left_out_and_told) {
  std::filesystem::create_directory(out("mixed"));
  std::filesystem::copy_file(clips() / "run_fast_001.bvh", out("mixed") / "a.bvh");
  write_text(out("mixed") / "b.bvh", "HIERARCHY\nROOT hip\n{\n");
  const CommandResult result =
      run_command({"build", out("mixed").string(), "-o", out("mixed.kspace").string(), "--quiet"});
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("b.bvh"), std::string::npos) << result.err;
  EXPECT_EQ(json::parse(run_command({"info", out("mixed.kspace").string(), "--json"}).out)["clips"], 1);
}

}  // namespace
}  // namespace kinespace::test
