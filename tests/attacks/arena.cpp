#include "tests/attacks/arena.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <set>
#include <stdexcept>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "examples/sample_motions.h"
#include "kinespace/motion/read.h"

namespace kinespace::test {
namespace {

namespace fs = std::filesystem;

// What a killed run may leave: the next one of the same work clears it away.
bool is_leftover(const std::string& file) {
  const std::string name = fs::path(file).filename().string();
  return name.starts_with(".kinespace-") || name.find(".kspace.") != std::string::npos ||
         name.find(".kspace-") != std::string::npos || file.find("/.kinespace-") != std::string::npos;
}

std::map<std::string, std::string> files_below(const fs::path& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) out[fs::relative(entry.path(), folder).string()] = read_text(entry.path());
  }
  return out;
}

}  // namespace

Arena::Arena() {
  fs::create_directories(before() / "clips");
  fs::create_directories(before() / "more");
  int number = 0;
  for (const SampleMotion& motion : sample_library({.takes = 1})) {
    if (number == 5) break;
    const char* place = number < 3 ? "clips" : "more";
    write_clip(before() / place / (motion.clip.name + ".bvh"), slice(motion.clip, 0, std::min(motion.clip.frames, 60)));
    ++number;
  }
  const std::string clip = fs::directory_iterator(before() / "clips")->path().string();
  const std::string other = fs::directory_iterator(before() / "more")->path().string();
  const auto make = [&](const std::vector<std::string>& arguments) {
    const CommandResult made = run_command(arguments);
    if (made.code != 0) throw std::runtime_error(made.err);
  };
  const auto in_it = [&](const char* name) { return (before() / name).string(); };
  make({"build", in_it("clips"), "-o", in_it("lib.kspace")});
  make({"encode", in_it("clips"), "-o", in_it("stream.ksm")});
  make({"encode", in_it("more"), "-o", in_it("out.ksm")});
  make({"convert", other, in_it("out.amc")});
  make({"convert", other, in_it("out.glb")});
  make({"decode", in_it("out.ksm"), "-o", in_it("decoded")});
  const std::string relative = fs::relative(clip, before()).string();
  works_ = {{"build", {"build", "more", "-o", "lib.kspace"}},   {"add", {"build", "more", "-o", "lib.kspace", "--add"}},
            {"encode", {"encode", "clips", "-o", "out.ksm"}},   {"decode", {"decode", "stream.ksm", "-o", "decoded"}},
            {"convert_pair", {"convert", relative, "out.amc"}}, {"convert_gltf", {"convert", relative, "out.glb"}}};
  before_ = files_below(before());
  for (const Work& work : works_) {
    const Outcome undisturbed = run(work, "exec \"$@\"");
    if (undisturbed.result.code != 0) throw std::runtime_error(work.name + ": " + undisturbed.result.err);
    after_[work.name] = undisturbed.files;
  }
}

void Arena::fresh_copy() const {
  fs::remove_all(folder_ / "now");
  fs::copy(before(), folder_ / "now", fs::copy_options::recursive);
}

Arena::Outcome Arena::run(const Work& work, const std::string& shell, const std::vector<std::string>& environment) {
  fresh_copy();
  const std::string line = fmt::format("cd '{}' && {}", (folder_ / "now").string(), shell);
  CommandResult result = run_command(work.arguments, {.environment = environment, .output_to = {}, .shell = line});
  return {std::move(result), files_below(folder_ / "now")};
}

void Arena::expect_whole(const Work& work, const Outcome& outcome, bool killed) {
  const CommandResult& result = outcome.result;
  const auto& after = after_.at(work.name);
  if (!(killed && result.signal == SIGKILL)) {
    const std::set<int> codes = {0, 1, 3};
    EXPECT_TRUE(result.signal == 0 && codes.contains(result.code))
        << work.name << ": code " << result.code << ", signal " << result.signal << "\n"
        << result.err;
  }
  std::set<std::string> names;
  const std::array<const std::map<std::string, std::string>*, 3> folders = {&before_, &after, &outcome.files};
  for (const auto* files : folders) {
    for (const auto& [name, content] : *files) names.insert(name);
  }
  bool left = false;
  for (const std::string& name : names) {
    const auto now = outcome.files.find(name);
    if (is_leftover(name)) {
      left = left || now != outcome.files.end();
      EXPECT_TRUE(now == outcome.files.end() || result.code != 0) << work.name << " is done and leaves " << name;
      continue;
    }
    const auto same_as = [&](const std::map<std::string, std::string>& files) {
      const auto there = files.find(name);
      return (now == outcome.files.end()) == (there == files.end()) &&
             (there == files.end() || now->second == there->second);
    };
    EXPECT_TRUE(same_as(after) || (result.code != 0 && same_as(before_)))
        << work.name << ": " << name << " is not whole\n"
        << result.err;
  }
  if (!left) return;
  const std::string line = fmt::format("cd '{}' && exec \"$@\"", (folder_ / "now").string());
  const CommandResult again = run_command(work.arguments, {.environment = {}, .output_to = {}, .shell = line});
  EXPECT_EQ(again.code, 0) << work.name << " after a stop: " << again.err;
  for (const auto& [name, content] : files_below(folder_ / "now"))
    EXPECT_FALSE(is_leftover(name)) << work.name << " leaves " << name;
}

void Arena::expect_done(const Work& work, const Outcome& outcome) const {
  const auto& after = after_.at(work.name);
  EXPECT_EQ(outcome.files.size(), after.size());
  for (const auto& [name, content] : after) {
    const auto now = outcome.files.find(name);
    EXPECT_TRUE(now != outcome.files.end() && now->second == content) << work.name << ": " << name;
  }
}

Arena::Counts Arena::counts(const Work& work) {
  const std::string file = (folder_ / "counts").string();
  const Outcome counted = run(work, "exec env LD_PRELOAD=\"$FAILPOINT\" \"$@\"",
                              {"FAILPOINT=" KINESPACE_FAILPOINT, "KINESPACE_FAILPOINT_COUNT=" + file});
  EXPECT_EQ(counted.result.code, 0) << counted.result.err;
  Counts out;
  std::ifstream(file) >> out.allocations >> out.changes;
  return out;
}

std::vector<long> points_of(long last, int count) {
  std::set<long> out;
  const bool all = std::getenv("KINESPACE_ATTACK_ALL") != nullptr;
  for (long n = 1; n <= last; ++n) {
    const bool end = n <= 2 || n > last - 3;
    if (all || end) out.insert(n);
  }
  for (int i = 0; i < count && last > 0; ++i) out.insert(1 + (last - 1) * i / std::max(count - 1, 1));
  return {out.begin(), out.end()};
}

}  // namespace kinespace::test
