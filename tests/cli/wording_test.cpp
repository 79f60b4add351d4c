// What the command says when something is wrong with how it was called: in the words of whoever typed it.
#include <filesystem>
#include <memory>
#include <regex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "examples/sample_motions.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using testing::HasSubstr;
using testing::Not;

class Wording : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    std::filesystem::create_directory(at("clips"));
    for (const SampleMotion& motion : sample_library({.takes = 1})) {
      const std::string& name = motion.clip.name;
      if (name.starts_with("walk") || name.starts_with("run")) write_clip(at("clips/" + name + ".bvh"), motion.clip);
    }
    ASSERT_EQ(run_command({"build", at("clips"), "-o", at("l.kspace")}).code, 0);
    std::filesystem::create_directory(at("more"));
    write_clip(at("more/stroll.bvh"), make_walk({.duration_s = 2}).clip);
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string at(const std::string& name) { return (folder_->path() / name).string(); }
  static std::string library() { return at("l.kspace"); }

  // The message of a run that must fail with that code.
  static std::string message(const std::vector<std::string>& arguments, int code) {
    const CommandResult result = run_command(arguments);
    EXPECT_EQ(result.code, code) << arguments.front() << ": " << result.err;
    return result.err;
  }

  static std::unique_ptr<TemporaryFolder> folder_;
};
std::unique_ptr<TemporaryFolder> Wording::folder_;

TEST_F(Wording, a_mistyped_subcommand_is_named_with_the_nearest) {
  EXPECT_THAT(message({"biuld", at("clips")}, 2),
              HasSubstr("no subcommand \"biuld\"; did you mean 'kinespace build'?"));
  EXPECT_THAT(message({"--quiet", "qurey"}, 2), HasSubstr("'kinespace query'"));
  EXPECT_THAT(message({"mesh", "encod", "x"}, 2), HasSubstr("'kinespace mesh encode'"));
  EXPECT_THAT(message({"query"}, 2), Not(HasSubstr("no subcommand")));
}

TEST_F(Wording, a_path_that_is_not_there_is_no_such_file) {
  for (const std::string& name : {at("nothing/walk.bvh"), std::string("gone.bvh"), std::string("gone.glb")}) {
    EXPECT_THAT(message({"query", library(), name}, 1), HasSubstr("no such file"));
    EXPECT_THAT(message({"export", library(), name, "-o", at("o.bvh")}, 1), HasSubstr("no such file"));
    EXPECT_THAT(message({"transition", library(), name, "run_fast_001", "-o", at("o.bvh")}, 1),
                HasSubstr("no such file"));
    EXPECT_THAT(message({"blend", library(), "run_fast_001", name, "-o", at("o.bvh")}, 1), HasSubstr("no such file"));
    EXPECT_THAT(message({"info", name}, 1), HasSubstr("no such file"));
    EXPECT_THAT(message({"clean", name, "-o", at("o.bvh")}, 1), HasSubstr("no such file"));
  }
  const std::string mistyped = message({"query", library(), "walk_fats_001"}, 2);
  EXPECT_THAT(mistyped, HasSubstr("no clip \"walk_fats_001\""));
  EXPECT_THAT(mistyped, HasSubstr("walk_fast_001"));
}

TEST_F(Wording, a_file_where_a_clip_of_the_library_is_asked_for_is_told) {
  const std::string clip = at("clips/walk_fast_001.bvh");
  EXPECT_THAT(message({"export", library(), clip, "-o", at("o.bvh")}, 2), HasSubstr("the name of a clip of"));
  EXPECT_THAT(message({"transition", library(), clip, "run_fast_001", "-o", at("o.bvh")}, 2), HasSubstr("build --add"));
}

TEST_F(Wording, folders_are_called_so) {
  for (const std::string command : {"info", "compare", "convert", "clean"}) {
    std::vector<std::string> arguments{command, at("clips")};
    if (command == "compare") arguments.push_back(at("clips"));
    if (command == "convert") arguments.push_back(at("o.bvh"));
    if (command == "clean") arguments.insert(arguments.end(), {"-o", at("o.bvh")});
    EXPECT_THAT(message(arguments, 1), HasSubstr("a folder, expected a motion file"));
  }
  EXPECT_THAT(message({"query", library(), at("clips")}, 1), HasSubstr("a folder"));
  EXPECT_THAT(message({"query", at("clips"), "x"}, 1), HasSubstr("a folder"));
}

// Every option that takes a number, out of range: no message has a name of the code in it.
TEST_F(Wording, numbers_out_of_range_are_told_by_their_options) {
  const std::string clip = at("clips/walk_fast_001.bvh");
  struct Call {
    std::vector<std::string> command;
    std::vector<std::string> options;
  };
  const std::vector<Call> calls = {
      {{"build", at("clips"), "-o", at("o.kspace")}, {"--variance", "--functions", "--points"}},
      {{"query", library(), "walk_fast_001"}, {"-k", "--candidates"}},
      {{"query", library(), "walk_fast_001", "--windows"}, {"--from", "--to"}},
      {{"export", library(), "walk_fast_001", "-o", at("o.bvh")}, {"--lod", "--max-error"}},
      {{"transition", library(), "walk_fast_001", "run_fast_001", "-o", at("o.bvh")},
       {"--max-cost", "--window", "--overlap"}},
      {{"blend", library(), "walk_fast_001", "run_fast_001", "-o", at("o.bvh")},
       {"--weights", "--at", "--neighbours", "--lod"}},
      {{"fill", clip, "--library", library(), "-o", at("o.bvh"), "--from", "1", "--to", "1.1"}, {"--max-gap"}},
      {{"clean", clip, "-o", at("o.bvh")}, {"--floor"}},
      {{"encode", clip, "-o", at("o.ksm")}, {"--error", "--max-error", "--bytes", "--variance"}},
      {{"decode", at("none.ksm"), "-o", at("o")}, {"--level", "--from", "--to"}},
  };
  const std::regex of_the_code("[A-Za-z]+::[a-z_]+|[A-Z][A-Za-z]+\\.[a-z_]+|[a-z]+_[a-z]+ = ");
  int told = 0;
  for (const Call& call : calls) {
    for (const std::string& option : call.options) {
      for (const char* value : {"0", "-1", "1e12", "nan"}) {
        std::vector<std::string> arguments = call.command;
        arguments.push_back(option + (option.starts_with("--") ? "=" : "") + value);
        const CommandResult result = run_command(arguments);
        if (result.code == 0) continue;
        EXPECT_FALSE(std::regex_search(result.err, of_the_code)) << result.err;
        EXPECT_EQ(result.err.find("unexpected error"), std::string::npos) << result.err;
        told += result.err.find(option) != std::string::npos ? 1 : 0;
      }
    }
  }
  EXPECT_GT(told, 30);
  EXPECT_THAT(message({"encode", clip, "-o", at("o.ksm"), "--error", "0"}, 2),
              HasSubstr("kinespace: --error 0, expected"));
}

TEST_F(Wording, numbers_that_are_none_and_options_that_would_do_nothing_are_refused) {
  for (const std::string& number : {std::string("nan"), std::string("inf"), std::string("-1"), std::string("1cm")}) {
    EXPECT_THAT(message({"export", library(), "run_fast_001", "-o", at("o.bvh"), "--max-error=" + number}, 2),
                HasSubstr("--max-error: " + number + ", expected a number, 0 or more"));
  }
  EXPECT_THAT(message({"build", at("clips"), "-o", at("n.kspace"), "--functions", "0"}, 2),
              HasSubstr("--functions: 0, expected a number above 0"));
  for (const std::vector<std::string>& choice : std::vector<std::vector<std::string>>{
           {"--smooth"}, {"--grouping", "joint"}, {"--variance", "0.9"}, {"--functions", "5"}, {"--points", "40"}}) {
    std::vector<std::string> arguments = {"build", at("more"), "-o", library(), "--add"};
    arguments.insert(arguments.end(), choice.begin(), choice.end());
    EXPECT_THAT(message(arguments, 2),
                HasSubstr("\"" + choice.front().substr(2) + "\" than the library was made with"));
  }
  // The same choices as before are its own.
  const auto build = [](const std::string& clips, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"build",      clips,   "-o",         at("c.kspace"),
                                          "--grouping", "joint", "--variance", "0.99"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_command(arguments).code;
  };
  EXPECT_EQ(build(at("clips"), {}), 0);
  EXPECT_EQ(build(at("more"), {"--add"}), 0);
}

TEST_F(Wording, info_lists_what_messages_say_it_lists) {
  const CommandResult result = run_command({"info", library()});
  ASSERT_EQ(result.code, 0) << result.err;
  for (const auto& entry : std::filesystem::directory_iterator(at("clips"))) {
    EXPECT_THAT(result.out, HasSubstr("  " + entry.path().stem().string()));
  }
  EXPECT_THAT(result.out, HasSubstr("skeleton  joints"));
  const CommandResult few = run_command({"info", library(), "--limit", "2"});
  EXPECT_THAT(few.out, HasSubstr("more; --limit 0 lists all"));
  EXPECT_LT(few.out.size(), result.out.size());
}

TEST_F(Wording, doubts_about_a_clip_are_told_and_change_nothing) {
  Clip small = make_walk({.duration_s = 1}).clip;
  for (Joint& joint : small.skeleton.joints) {
    joint.offset *= 0.01;
    if (joint.end_site) *joint.end_site *= 0.01;
  }
  for (auto& track : small.translations) {
    for (Eigen::Vector3d& p : track.values) p *= 0.01;
  }
  small.name = "small";
  write_clip(at("small.bvh"), small);
  const std::vector<std::vector<std::string>> commands = {
      {"info", at("small.bvh")},
      {"convert", at("small.bvh"), at("o.bvh")},
      {"clean", at("small.bvh"), "-o", at("o.bvh")},
      {"query", library(), at("small.bvh")},
      {"build", at("small.bvh"), "-o", at("small.kspace")},
  };
  for (const auto& command : commands) {
    const CommandResult result = run_command(command);
    EXPECT_EQ(result.code, 0) << command.front() << result.err;
    EXPECT_THAT(result.err, HasSubstr("are they in m?")) << command.front();
  }
  EXPECT_THAT(run_command({"info", at("clips/walk_fast_001.bvh")}).err, testing::IsEmpty());
}

TEST_F(Wording, the_largest_error_is_that_from_the_clip_as_it_was_read) {
  const std::string clip = at("clips/walk_fast_001.bvh");
  const auto largest = [&] {
    return nlohmann::json::parse(run_command({"compare", clip, at("o.bvh"), "--json"}).out)["max_joint_error_cm"]
        .get<double>();
  };
  for (const double bound : {8.0, 2.0, 0.5}) {
    ASSERT_EQ(
        run_command({"export", library(), "walk_fast_001", "-o", at("o.bvh"), "--max-error", std::to_string(bound)})
            .code,
        0);
    EXPECT_LE(largest(), bound + 1e-4);
  }
  EXPECT_THAT(message({"export", library(), "walk_fast_001", "-o", at("o.bvh"), "--max-error", "0.00001"}, 2),
              HasSubstr("as it was read"));
  // Without the file it is the stored error and what is left out.
  std::filesystem::rename(clip, at("moved.bvh"));
  const CommandResult bounded =
      run_command({"export", library(), "walk_fast_001", "-o", at("o.bvh"), "--max-error", "2", "--json"});
  EXPECT_THAT(message({"export", library(), "walk_fast_001", "-o", at("p.bvh"), "--max-error", "0.00001"}, 2),
              HasSubstr("as it was read"));
  std::filesystem::rename(at("moved.bvh"), clip);
  ASSERT_EQ(bounded.code, 0) << bounded.err;
  EXPECT_THAT(bounded.err, HasSubstr("not there unchanged"));
  EXPECT_LE(largest(), 2 + 1e-4);
  EXPECT_LE(nlohmann::json::parse(bounded.out)["max_joint_error_cm"].get<double>(), 2);
}

TEST_F(Wording, what_is_not_known_is_null) {
  Clip flying = make_stand({.duration_s = 1}).clip;
  auto& track = flying.require_translation_track(0).values;
  for (int f = 0; f < flying.frames; ++f) track[static_cast<std::size_t>(f)] += Eigen::Vector3d(3 * f, 100 + 4 * f, 0);
  write_clip(at("flying.bvh"), flying);
  const CommandResult result = run_command({"clean", at("flying.bvh"), "-o", at("o.bvh"), "--json", "--quiet"});
  ASSERT_EQ(result.code, 0) << result.err;
  const auto report = nlohmann::json::parse(result.out);
  EXPECT_EQ(report["plants"], 0);
  EXPECT_TRUE(report["foot_slide_before_cm_s"].is_null());
  EXPECT_TRUE(report["foot_slide_after_cm_s"].is_null());
  EXPECT_THAT(result.err, HasSubstr("no foot was found to stand"));
}

}  // namespace
}  // namespace kinespace::test
