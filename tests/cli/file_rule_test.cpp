// The rule of what may be overwritten, tried on every output of every subcommand, as the command's own option table has
// them: no file that was read, and none of another kind.
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>

#include <CLI/CLI.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/commands.h"
#include "examples/sample_motions.h"
#include "kinespace/base/file.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

namespace fs = std::filesystem;

// "mesh encode" for the subcommand of a subcommand.
std::string full_name(const CLI::App* command) {
  std::string name = command->get_name();
  for (const CLI::App* up = command->get_parent(); up->get_parent() != nullptr; up = up->get_parent()) {
    name = up->get_name() + " " + name;
  }
  return name;
}

// How each subcommand with outputs is called. A word @NAME is a file of the folder below; what follows > is an output,
// by the option that names it.
const std::map<std::string, std::vector<std::string>>& calls() {
  static const std::map<std::string, std::vector<std::string>> all{
      {"build", {"@clips", ">--output", "-o"}},
      {"clean", {"@walk.bvh", ">--output", "-o", ">--picture", "--picture"}},
      {"convert", {"@walk.bvh", ">OUT", ""}},
      {"decode", {"@stream.ksm", ">--output", "-o"}},
      {"encode", {"@walk.bvh", ">--output", "-o"}},
      {"export", {"@lib.kspace", "walk", ">--output", "-o"}},
      {"transition", {"@lib.kspace", "walk", "other", ">--output", "-o", ">--picture", "--picture"}},
      {"blend", {"@lib.kspace", "walk", "other", ">--output", "-o", ">--picture", "--picture"}},
      {"fill",
       {"@walk.bvh", "--library", "@lib.kspace", "--from", "0.5", "--to", "0.6", ">--output", "-o", ">--picture",
        "--picture"}},
      {"info", {"@walk.bvh", "--repeats", ">--picture", "--picture"}},
      {"view", {"@lib.kspace", ">--output", "-o"}},
      {"mesh encode", {"@mesh", ">--output", "-o"}},
      {"mesh decode", {"@mesh.ksm", ">--output", "-o"}},
      {"mesh compare", {"@mesh", "@mesh.ksm", ">--picture", "--picture"}},
  };
  return all;
}

class FileRule : public testing::Test {
 protected:
  FileRule() {
    fs::create_directory(folder_ / "clips");
    int number = 0;
    for (const SampleMotion& motion : sample_library({.takes = 1})) {
      if (number == 2) break;
      write_clip(folder_ / "clips" / (number == 0 ? "walk.bvh" : "other.bvh"), motion.clip);
      ++number;
    }
    fs::copy(folder_ / "clips/walk.bvh", folder_ / "walk.bvh");
    make({"convert", at("clips/other.bvh"), at("pair.amc")});
    make({"convert", at("clips/other.bvh"), at("picture.glb")});
    make({"convert", at("clips/other.bvh"), at("picture.gltf")});
    make({"build", at("clips"), "-o", at("lib.kspace")});
    make({"encode", at("walk.bvh"), "-o", at("stream.ksm")});
    make({"info", at("walk.bvh"), "--repeats", "--picture", at("picture.svg")});
    fs::create_directory(folder_ / "frames");
    for (const char* name : {"frames/f1.obj", "frames/f2.obj"}) {
      write_text(folder_ / name, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 1 3 4\n");
    }
    make({"mesh", "encode", at("frames"), "-o", at("mesh.ksm")});
    make({"mesh", "decode", at("mesh.ksm"), "-o", at("mesh")});
    make({"mesh", "compare", at("mesh"), at("mesh.ksm"), "--picture", at("picture.png")});
    write_text(folder_ / "notes.txt", "Nobody should lose this.\n");
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) {
      if (entry.is_regular_file()) files_[entry.path()] = read_text(entry.path());
    }
  }

  std::string at(const char* name) const { return (folder_ / name).string(); }
  static void make(const std::vector<std::string>& arguments) {
    const CommandResult made = run_command(arguments);
    ASSERT_EQ(made.code, 0) << made.err;
  }

  // The words of a call, its output `option` being `path` and the others new files of the right ending.
  std::vector<std::string> words_of(const std::string& command, const std::string& option, const fs::path& path) const {
    std::vector<std::string> words;
    if (command.starts_with("mesh "))
      words = {"mesh", command.substr(5)};
    else
      words = {command};
    const auto& call = calls().at(command);
    for (std::size_t i = 0; i < call.size(); ++i) {
      if (call[i].starts_with('@')) {
        words.push_back(at(call[i].c_str() + 1));
      } else if (call[i].starts_with('>')) {
        const std::string name = call[i].substr(1);
        if (!call[++i].empty()) words.push_back(call[i]);
        const bool picture = name == "--picture";
        words.push_back(name == option ? path.string() : at(picture ? "new.svg" : "new.bvh"));
      } else {
        words.push_back(call[i]);
      }
    }
    return words;
  }

  bool reads(const std::string& command, const fs::path& file) const {
    return std::ranges::any_of(calls().at(command), [&](const std::string& word) {
      if (!word.starts_with('@')) return false;
      const fs::path input = folder_.path() / word.substr(1);
      return file == input || file.parent_path() == input;
    });
  }

  void expect_all_as_they_were() {
    for (const auto& [file, content] : files_) EXPECT_EQ(read_text(file), content) << file;
  }

  TemporaryFolder folder_;
  std::map<fs::path, std::string> files_;
};

TEST_F(FileRule, no_subcommand_writes_over_what_it_reads_or_over_a_file_of_another_kind) {
  CLI::App app;
  cli::Session session;
  cli::add_all_commands(app, session);
  int tried = 0;
  for (const cli::FileOption& option : session.files.all()) {
    if (option.role != cli::FileOption::Role::written) continue;
    const std::string command = full_name(option.command);
    const std::string name =
        option.option->get_positional() ? option.option->get_name(true) : "--" + option.option->get_lnames().front();
    ASSERT_TRUE(calls().contains(command)) << "how is `" << command << "` called? Add it to calls()";
    ASSERT_THAT(calls().at(command), testing::Contains(">" + name)) << command;
    for (const auto& [file, content] : files_) {
      const FileKind there = file_kind(std::as_bytes(std::span(content)));
      const bool read = reads(command, file);
      // Written in another format by its ending: that kind may be replaced.
      const auto ours = option.kind ? option.kind : cli::kind_by_ending(file);
      if (!read && ours == there) continue;
      const CommandResult result = run_command(words_of(command, name, file));
      ++tried;
      EXPECT_EQ(result.code, 2) << command << " " << name << " " << file << ": " << result.err;
      EXPECT_EQ(read_text(file), content) << command << " " << name << " destroyed " << file;
    }
  }
  EXPECT_GT(tried, 150);
  expect_all_as_they_were();
}

TEST_F(FileRule, two_outputs_are_two_files) {
  const CommandResult result =
      run_command({"clean", at("walk.bvh"), "-o", at("both.bvh"), "--picture", at("both.bvh")});
  EXPECT_EQ(result.code, 2) << result.err;
  EXPECT_FALSE(fs::exists(folder_ / "both.bvh"));
}

TEST_F(FileRule, an_output_that_reaches_an_input_by_a_link_is_that_input) {
  fs::create_symlink(folder_ / "walk.bvh", folder_ / "link.bvh");
  fs::create_hard_link(folder_ / "walk.bvh", folder_ / "hard.bvh");
  for (const char* name : {"link.bvh", "hard.bvh", "clips/../walk.bvh"}) {
    EXPECT_EQ(run_command({"clean", at("walk.bvh"), "-o", at(name)}).code, 2) << name;
  }
  expect_all_as_they_were();
}

TEST_F(FileRule, what_killed_runs_left_goes_and_what_others_make_stays) {
  // No process has this number: it is above the largest there may be.
  write_text(folder_ / ".kinespace-4194305-0", "left");
  fs::create_directory(folder_ / ".kinespace-4194305-1.part");
  write_text(folder_ / ".kinespace-4194305-1.part/positions.npy", "left");
  write_text(folder_ / ".kinespace-1-0", "of a process that lives");
  write_text(folder_ / ".kinespace-notes", "of a user");
  make({"convert", at("walk.bvh"), at("copy.bvh")});
  EXPECT_FALSE(fs::exists(folder_ / ".kinespace-4194305-0"));
  EXPECT_FALSE(fs::exists(folder_ / ".kinespace-4194305-1.part"));
  EXPECT_TRUE(fs::exists(folder_ / ".kinespace-1-0"));
  EXPECT_TRUE(fs::exists(folder_ / ".kinespace-notes"));
}

}  // namespace
}  // namespace kinespace::test
