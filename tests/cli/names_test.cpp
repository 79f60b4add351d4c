// Names of clips and joints may hold anything a file's may: no command lets a terminal obey them, makes a line of its
// own of them or writes where they point to. JSON has them as they are.
#include <filesystem>
#include <memory>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "examples/sample_motions.h"
#include "kinespace/base/printable.h"
#include "kinespace/codecs/registry.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// ESC, CR, LF, BEL, DEL, a C1 control and a mark of direction.
const std::string evil_name =
    "evil\x1b[2J\r\nwalk\x07\x7f\xc2\x9b"
    "31m\xe2\x80\xae"
    "x";

class HostileNames : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    fs::create_directory(clips());
    for (const SampleMotion& motion : sample_library({.takes = 1})) {
      const std::string& name = motion.clip.name;
      if (name.starts_with("walk") || name.starts_with("run")) write_clip(clips() / (name + ".bvh"), motion.clip);
    }
    fs::rename(clips() / "walk_normal_001.bvh", clip());
    const CommandResult built = run_command({"build", clips().string(), "-o", library()});
    ASSERT_EQ(built.code, 0) << built.err;
    ASSERT_EQ(run_command({"encode", clips().string(), "-o", stream()}).code, 0);
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static fs::path clips() { return *folder_ / "clips"; }
  static fs::path clip() { return clips() / (evil_name + ".bvh"); }
  static std::string library() { return (*folder_ / "l.kspace").string(); }
  static std::string stream() { return (*folder_ / "s.ksm").string(); }
  static std::string out(const char* name) { return (*folder_ / name).string(); }

  static std::unique_ptr<TemporaryFolder> folder_;
};
std::unique_ptr<TemporaryFolder> HostileNames::folder_;

TEST_F(HostileNames, no_command_prints_what_a_terminal_would_obey) {
  const std::vector<std::vector<std::string>> commands = {
      {"info", clip().string()},
      {"info", library()},
      {"info", stream()},
      {"info", "--repeats", clip().string()},
      {"info", "no such \x1b[31m file.bvh"},
      {"query", library(), evil_name},
      {"query", library(), clip().string(), "-k", "100"},
      {"query", library(), "evi"},
      {"query", library(), "walk_fast_001", "--windows"},
      {"export", library(), evil_name, "-o", out("e.bvh")},
      {"transition", library(), evil_name, "run_fast_001", "-o", out("t.bvh"), "--clean-feet"},
      {"blend", library(), evil_name, "walk_fast_001", "-o", out("b.bvh")},
      {"clean", clip().string(), "-o", out("c.bvh")},
      {"compare", clip().string(), clip().string()},
      {"convert", clip().string(), out("v.bvh")},
      {"contacts", clip().string()},
      {"contacts", evil_name, "--library", library()},
      {"contacts", "--library", library(), "--next"},
      {"fill", clip().string(), "-o", out("f.bvh"), "--library", library(), "--from", "1", "--to", "1.1"},
      {"encode", clip().string(), "-o", out("again.ksm")},
      {"decode", stream(), "-o", out("one.bvh"), "--clip", evil_name},
      {"decode", stream(), "-o", out("one.bvh"), "--clip", evil_name + "?"},
      {evil_name},
      {"query", "--" + evil_name},
  };
  for (const auto& command : commands) {
    for (const bool as_json : {false, true}) {
      std::vector<std::string> arguments = command;
      if (as_json) arguments.emplace_back("--json");
      const CommandResult result = run_command(arguments);
      EXPECT_EQ(result.signal, 0);
      EXPECT_EQ(printable_lines(result.out), result.out) << command.front();
      EXPECT_EQ(printable_lines(result.err), result.err) << command.front();
      for (const std::string& text : {result.out, result.err}) {
        EXPECT_NE(text.substr(0, 4), "walk") << command.front();
        EXPECT_EQ(text.find("\nwalk\x07"), std::string::npos) << command.front();
        EXPECT_EQ(text.find("\nwalk?"), std::string::npos) << command.front() << " lets a name make a line";
      }
    }
  }
}

TEST_F(HostileNames, json_has_the_true_name) {
  const CommandResult result = run_command({"query", library(), clip().string(), "-k", "100", "--json"});
  ASSERT_EQ(result.code, 0) << result.err;
  std::set<std::string> names;
  const json printed = json::parse(result.out);
  for (const json& match : printed["matches"]) names.insert(match["clip"]);
  EXPECT_TRUE(names.contains(evil_name));
}

TEST_F(HostileNames, decoded_files_have_plain_names) {
  const CommandResult result = run_command({"decode", stream(), "-o", out("decoded")});
  ASSERT_EQ(result.code, 0) << result.err;
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(out("decoded"))) {
    const std::string name = entry.path().string();
    EXPECT_EQ(printable(name), name);
    ++files;
  }
  EXPECT_EQ(files, static_cast<std::size_t>(std::distance(fs::directory_iterator(clips()), {})));
}

TEST(ClipNames, folders_of_clips_are_kept_apart_through_a_stream) {
  const TemporaryFolder folder;
  for (const char* name : {"a", "b"}) fs::create_directory(folder / name);
  write_text(folder / "a/walk.bvh", walking_bvh(60, 1));
  write_text(folder / "b/walk.bvh", walking_bvh(80, 2));
  write_text(folder / "b/run.bvh", walking_bvh(90, 3));
  const std::string stream = (folder / "s.ksm").string();
  ASSERT_EQ(run_command({"encode", (folder / "a").string(), (folder / "b").string(), "-o", stream}).code, 0);
  const CommandResult info = run_command({"info", stream, "--json"});
  std::set<std::string> names;
  const json printed = json::parse(info.out);
  for (const json& clip : printed["clip_list"]) names.insert(clip["name"]);
  EXPECT_EQ(names, (std::set<std::string>{"a/walk", "b/walk", "run"})) << "as build names them";

  const CommandResult decoded = run_command({"decode", stream, "-o", (folder / "d").string()});
  ASSERT_EQ(decoded.code, 0) << decoded.err;
  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder / "d")) {
    if (entry.is_regular_file()) files.insert(fs::relative(entry.path(), folder / "d").string());
  }
  EXPECT_EQ(files, (std::set<std::string>{"a/walk.bvh", "b/walk.bvh", "run.bvh"}));
  EXPECT_EQ(read_clip(folder / "d/b/walk.bvh").frames, 80);
}

TEST(ClipNames, a_stream_writes_nothing_outside_the_folder_it_is_decoded_into) {
  const TemporaryFolder folder;
  const fs::path outside = folder / "outside";
  std::vector<Clip> clips;
  for (const std::string& name :
       {std::string("../outside/x"), outside.string() + "/y", std::string("../../../../../outside/z"),
        std::string("C:/w"), std::string("..\\..\\v"), std::string("."), std::string(".."), std::string(),
        std::string("a"), std::string("a.bvh/b"), std::string("a.bvh"), std::string("A/../../up"),
        std::string(5000, 'n')}) {
    write_text(folder / "in.bvh", walking_bvh(40, 1));
    clips.push_back(read_clip(folder / "in.bvh"));
    clips.back().name = name;
  }
  const Bytes stream = encode("motion-space", clips, {});
  write_text(folder / "s.ksm", {reinterpret_cast<const char*>(stream.data()), stream.size()});
  const CommandResult decoded = run_command({"decode", (folder / "s.ksm").string(), "-o", (folder / "d").string()});
  ASSERT_EQ(decoded.code, 0) << decoded.err;
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder / "d")) files += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(files, clips.size());
  std::set<std::string> beside;
  for (const auto& entry : fs::directory_iterator(folder.path())) beside.insert(entry.path().filename());
  EXPECT_EQ(beside, (std::set<std::string>{"d", "in.bvh", "s.ksm"}));
}

}  // namespace
}  // namespace kinespace::test
