// The files that people have: glTF with several animations, folders with files that cannot be read.
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "examples/sample_motions.h"
#include "kinespace/motion/gltf.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

Clip walk_of(double seconds) {
  return make_walk({.duration_s = seconds}).clip;
}

// A file with two animations of one skeleton: the walk, and the same walk standing on its first frame.
std::string two_animations() {
  json file = json::parse(format_gltf(walk_of(2), GltfForm::text));
  file["animations"][0]["name"] = "walk";
  json still = file["animations"][0];
  still["name"] = "turn";
  std::erase_if(still["channels"].get_ref<json::array_t&>(),
                [](const json& channel) { return channel["target"]["path"] == "translation"; });
  file["animations"].push_back(still);
  return file.dump();
}

CommandResult run(std::vector<std::string> arguments) {
  return run_command(arguments);
}

TEST(ClipFiles, gltf_is_read_wherever_a_clip_is) {
  const TemporaryFolder folder;
  const std::string bvh = (folder / "walk.bvh").string(), glb = (folder / "walk.glb").string();
  write_clip(bvh, walk_of(2));
  ASSERT_EQ(run({"convert", bvh, glb}).code, 0);
  const json compared = json::parse(run({"compare", bvh, glb, "--json"}).out);
  EXPECT_LT(compared["max_joint_error_cm"], 1e-4);
  const CommandResult info = run({"info", glb, "--json"});
  EXPECT_EQ(json::parse(info.out)["frames"], json::parse(run({"info", bvh, "--json"}).out)["frames"]);
  EXPECT_EQ(info.err, "");
}

TEST(ClipFiles, one_of_several_animations_is_chosen_by_name_or_number) {
  const TemporaryFolder folder;
  const std::string file = (folder / "two.gltf").string();
  write_text(file, two_animations());
  const CommandResult first = run({"info", file, "--json"});
  EXPECT_EQ(json::parse(first.out)["name"], "two.walk");
  EXPECT_THAT(first.err, AllOf(HasSubstr("the first of 2 animations"), HasSubstr("walk, turn")));
  for (const char* chosen : {"turn", "2"}) {
    const CommandResult result = run({"info", file, "--json", "--animation", chosen});
    EXPECT_EQ(json::parse(result.out)["name"], "two.turn");
    EXPECT_EQ(result.err, "");
  }
  const CommandResult wrong = run({"info", file, "--animation", "jump"});
  EXPECT_EQ(wrong.code, 1);
  EXPECT_THAT(wrong.err, HasSubstr("no animation \"jump\", expected a number from 1 to 2 or a name: walk, turn"));
  const json same =
      json::parse(run({"compare", file, file, "--animation", "2", "--animation-b", "turn", "--json"}).out);
  EXPECT_EQ(same["max_joint_error_cm"], 0);
  const json other = json::parse(run({"compare", file, file, "--animation-b", "turn", "--json"}).out);
  EXPECT_GT(other["max_joint_error_cm"], 1);
  write_clip(folder / "walk.bvh", walk_of(1));
  EXPECT_EQ(run({"info", (folder / "walk.bvh").string(), "--animation", "turn"}).code, 1);
}

TEST(ClipFiles, all_animations_of_a_file_go_into_libraries_and_streams) {
  const TemporaryFolder folder;
  const std::string file = (folder / "two.gltf").string(), library = (folder / "l.kspace").string();
  write_text(file, two_animations());
  ASSERT_EQ(run({"build", file, "-o", library}).code, 0);
  std::vector<std::string> names;
  const json info = json::parse(run({"info", library, "--json"}).out);
  for (const json& clip : info["clip_list"]) names.push_back(clip["name"]);
  EXPECT_THAT(names, UnorderedElementsAre("two.turn", "two.walk"));
  for (const char* animation : {"walk", "turn"}) {
    const json found = json::parse(run({"query", library, file, "--animation", animation, "-k", "1", "--json"}).out);
    EXPECT_EQ(found["matches"][0]["clip"], std::string("two.") + animation);
  }
  // The file is still there: an export is measured against its own animation.
  const std::string played = (folder / "p.bvh").string();
  const json exported = json::parse(run({"export", library, "two.turn", "-o", played, "--json"}).out);
  EXPECT_EQ(exported["root_errors_against"], "the clip as it was read");
  EXPECT_LT(exported["max_root_height_error_cm"], 0.5);
  EXPECT_EQ(json::parse(run({"build", file, "-o", library, "--add", "--json"}).out)["unchanged"], 2);

  const std::string stream = (folder / "s.ksm").string();
  EXPECT_EQ(json::parse(run({"encode", file, "-o", stream, "--json"}).out)["clips"], 2);
  ASSERT_EQ(run({"decode", stream, "-o", (folder / "out").string()}).code, 0);
  EXPECT_TRUE(fs::exists(folder / "out/two.walk.bvh"));
  EXPECT_TRUE(fs::exists(folder / "out/two.turn.bvh"));
}

class BadFilesInAFolder : public testing::Test {
 protected:
  BadFilesInAFolder() {
    fs::create_directory(clips());
    write_clip(clips() / "good.bvh", walk_of(2));
    write_text(clips() / "cut.bvh", "HIERARCHY\nROOT Hips\n{\n");
    write_text(clips() / "worse.glb", "no glTF at all");
  }
  fs::path clips() const { return folder_ / "clips"; }
  std::string at(const char* name) const { return (folder_ / name).string(); }

  TemporaryFolder folder_;
};

TEST_F(BadFilesInAFolder, are_left_out_and_listed) {
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"build", clips().string(), "-o", at("l.kspace")},
        {"encode", clips().string(), "-o", at("s.ksm")}}) {
    SCOPED_TRACE(command.front());
    std::vector<std::string> arguments = command;
    arguments.emplace_back("--json");
    const CommandResult strict = run(arguments);
    EXPECT_EQ(strict.code, 1);
    EXPECT_THAT(strict.err, AllOf(HasSubstr("cut.bvh:4:"), HasSubstr("worse.glb: "),
                                  HasSubstr("2 files that cannot be read"), HasSubstr("--skip-bad")));
    const json report = json::parse(strict.out);
    EXPECT_EQ(report["clips"], 1);
    ASSERT_EQ(report["bad_files"].size(), 2u);
    for (const json& bad : report["bad_files"]) EXPECT_THAT(bad["reason"], HasSubstr(bad["file"].get<std::string>()));
    EXPECT_TRUE(fs::exists(command.back()));

    arguments.emplace_back("--skip-bad");
    const CommandResult skipping = run(arguments);
    EXPECT_EQ(skipping.code, 0);
    EXPECT_THAT(skipping.err, AllOf(HasSubstr("cut.bvh:4:"), HasSubstr("worse.glb: ")));
  }
}

TEST_F(BadFilesInAFolder, nothing_is_written_where_none_is_good) {
  fs::remove(clips() / "good.bvh");
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"build", clips().string(), "-o", at("l.kspace")},
        {"encode", clips().string(), "-o", at("s.ksm")}}) {
    std::vector<std::string> arguments = command;
    arguments.emplace_back("--skip-bad");
    const CommandResult result = run(arguments);
    EXPECT_EQ(result.code, 1);
    EXPECT_THAT(result.err, HasSubstr("1 more cannot be read"));
    EXPECT_FALSE(fs::exists(command.back()));
  }
}

}  // namespace
}  // namespace kinespace::test
