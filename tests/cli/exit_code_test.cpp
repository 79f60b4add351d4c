// What the command says and returns when something is wrong: one line on standard error, and 1, 2 or 3 by who can mend
// it.
#include <algorithm>
#include <csignal>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

class ExitCode : public testing::Test {
 protected:
  std::string path(const char* name) const { return (folder_ / name).string(); }
  std::string walk() const {
    write_text(folder_ / "walk.bvh", walking_bvh(20, 1));
    return path("walk.bvh");
  }
  TemporaryFolder folder_;
};

void expect_one_line(const CommandResult& result, int code, const std::string& start) {
  EXPECT_EQ(result.code, code) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, StartsWith("kinespace: " + start));
  EXPECT_THAT(result.err, EndsWith("\n"));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST_F(ExitCode, help_and_version_are_results) {
  const CommandResult help = run_command({"--help"});
  EXPECT_EQ(help.code, 0);
  for (const char* name : {"bench", "compare", "convert", "devices", "info"}) EXPECT_THAT(help.out, HasSubstr(name));
  EXPECT_EQ(run_command({"compare", "--help"}).code, 0);
  const CommandResult version = run_command({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_THAT(version.out, StartsWith("kinespace 0."));
}

TEST_F(ExitCode, usage_errors_are_2_and_name_the_help_that_answers_them) {
  expect_one_line(run_command({}), 2, "");
  expect_one_line(run_command({"dance"}), 2, "");
  const CommandResult one_clip = run_command({"compare", walk()});
  expect_one_line(one_clip, 2, "");
  EXPECT_THAT(one_clip.err, HasSubstr("try 'kinespace compare --help'"));
  const CommandResult unknown = run_command({"info", walk(), "--jsn"});
  expect_one_line(unknown, 2, "");
  EXPECT_THAT(unknown.err, HasSubstr("--jsn"));
  expect_one_line(run_command({"convert", walk(), path("out.xyz")}), 2, path("out.xyz") + ": ");
  const CommandResult bench = run_command({"bench", "nothing"});
  expect_one_line(bench, 2, "");
}

TEST_F(ExitCode, missing_input_is_1_and_named) {
  expect_one_line(run_command({"info", path("none.bvh")}), 1, path("none.bvh") + ": ");
  expect_one_line(run_command({"compare", walk(), path("none.bvh")}), 1, path("none.bvh") + ": ");
  expect_one_line(run_command({"convert", path("none.bvh"), path("out.bvh")}), 1, path("none.bvh") + ": ");
  EXPECT_FALSE(std::filesystem::exists(path("out.bvh")));
}

TEST_F(ExitCode, wrong_input_is_1_with_the_line) {
  std::string text = walking_bvh(20, 1);
  const auto at = text.find("Frame Time: 0.01\n") + 17;
  text[at] = 'x';
  write_text(folder_ / "bad.bvh", text);
  const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1;
  const std::string start = path("bad.bvh") + ":" + std::to_string(line) + ": ";
  expect_one_line(run_command({"info", path("bad.bvh")}), 1, start);
  expect_one_line(run_command({"convert", path("bad.bvh"), path("out.bvh")}), 1, start);
  EXPECT_FALSE(std::filesystem::exists(path("out.bvh")));
}

TEST_F(ExitCode, a_folder_or_an_unknown_kind_of_file_is_1) {
  expect_one_line(run_command({"info", folder_.path().string()}), 1, folder_.path().string());
  write_text(folder_ / "notes.txt", "hello\n");
  expect_one_line(run_command({"info", path("notes.txt")}), 1, path("notes.txt"));
}

TEST_F(ExitCode, clips_that_cannot_be_compared_are_1) {
  write_text(folder_ / "short.bvh", walking_bvh(10, 1));
  const CommandResult result = run_command({"compare", walk(), path("short.bvh")});
  expect_one_line(result, 1, "");
  EXPECT_THAT(result.err, HasSubstr("10"));
}

TEST_F(ExitCode, unwritable_output_is_3) {
  const std::string input = walk();
  expect_one_line(run_command({"convert", input, path("no/such/folder/out.bvh")}), 3,
                  path("no/such/folder/out.bvh") + ": ");
  expect_one_line(run_command({"convert", input, input + "/out.bvh"}), 3, input + "/out.bvh: ");
  std::filesystem::create_directory(folder_ / "taken.bvh");
  expect_one_line(run_command({"convert", input, path("taken.bvh")}), 3, path("taken.bvh") + ": ");
}

TEST_F(ExitCode, results_that_do_not_reach_their_reader_are_3) {
  const CommandResult result = run_command({"info", walk(), "--json"}, {.output_to = "/dev/full"});
  expect_one_line(result, 3, "cannot write to standard output");
}

TEST_F(ExitCode, output_equal_to_the_input_is_refused_by_whatever_name) {
  const std::string input = walk();
  const std::string before = read_text(input);
  std::filesystem::create_hard_link(input, path("linked.bvh"));
  std::filesystem::create_symlink(input, path("pointing.bvh"));
  for (const std::string& output : {input, path("../") + folder_.path().filename().string() + "/walk.bvh",
                                    path("linked.bvh"), path("pointing.bvh")}) {
    expect_one_line(run_command({"convert", input, output}), 2, output + ": the output is the input");
    EXPECT_EQ(read_text(input), before);
  }
}

TEST_F(ExitCode, conversion_does_not_overwrite_the_skeleton_it_reads) {
  ASSERT_EQ(run_command({"convert", walk(), path("one.amc")}).code, 0);
  const std::string skeleton = read_text(path("one.asf"));
  const CommandResult result = run_command({"convert", path("one.amc"), path("two.amc"), "--asf", path("one.asf")});
  EXPECT_EQ(result.code, 0) << result.err;
  std::filesystem::rename(path("one.amc"), path("one_1.amc"));
  expect_one_line(run_command({"convert", path("one_1.amc"), path("one.amc")}), 2, path("one.asf") + ": ");
  EXPECT_EQ(read_text(path("one.asf")), skeleton);
}

TEST_F(ExitCode, ctrl_c_ends_with_130_and_leaves_no_output) {
  write_text(folder_ / "long.bvh", walking_bvh(1'000'000, 0.001));
  for (const auto& [signal, code] : {std::pair{SIGINT, 130}, std::pair{SIGTERM, 143}}) {
    Command command({"convert", path("long.bvh"), path("out.bvh")});
    command.send(signal);
    const CommandResult result = command.finish();
    expect_one_line(result, code, "stopped");
    const auto files = std::distance(std::filesystem::directory_iterator(folder_.path()), {});
    EXPECT_EQ(files, 1) << "only the input is there";
  }
}

}  // namespace
}  // namespace kinespace::test
