// SIGTERM in the middle of the work: every command ends by it, soon, and leaves nothing that was not there.
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "examples/sample_motions.h"
#include "kinespace/motion/read.h"
#include "tests/cli/run_command.h"
#include "tests/support/data.h"

namespace kinespace::test {
namespace {

namespace fs = std::filesystem;

// The clip's frames over and over.
std::string repeated_bvh(const Clip& clip, int frames, const fs::path& scratch) {
  write_clip(scratch, clip);
  const std::string text = read_text(scratch);
  fs::remove(scratch);
  const std::size_t count = text.find("Frames:");
  const std::size_t rate = text.find("Frame Time:");
  const std::size_t data = text.find('\n', rate) + 1;
  std::string out = text.substr(0, count) + fmt::format("Frames: {}\n", frames) + text.substr(rate, data - rate);
  std::size_t at = data;
  for (int f = 0; f < frames; ++f) {
    const std::size_t end = text.find('\n', at) + 1;
    out.append(text, at, end - at);
    at = end < text.size() ? end : data;
  }
  return out;
}

// What a process has read so far, in bytes; -1 when that cannot be told any more.
std::int64_t bytes_read(pid_t process) {
  std::ifstream io(fmt::format("/proc/{}/io", process));
  std::string line;
  std::getline(io, line);  // "rchar: 1234"
  constexpr std::string_view name = "rchar: ";
  std::int64_t value = -1;
  if (line.starts_with(name)) std::from_chars(line.data() + name.size(), line.data() + line.size(), value);
  return value;
}

bool ended(pid_t process, int within_ms) {
  const int handle = static_cast<int>(::syscall(SYS_pidfd_open, process, 0));
  if (handle < 0) throw std::system_error(errno, std::generic_category(), "pidfd_open");
  pollfd wait{.fd = handle, .events = POLLIN, .revents = 0};
  const int got = ::poll(&wait, 1, within_ms);
  ::close(handle);
  return got == 1;
}

struct StoppedWork {
  std::vector<std::string> arguments;
  bool long_work = false;  // takes many times as long as the half second that work has to end by itself
};

class Stop : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    fs::create_directories(*folder_ / "clips");
    fs::create_directories(*folder_ / "out");
    const Clip walk = make_walk().clip;
    write_clip(*folder_ / "clips" / "walk.bvh", walk);
    write_clip(*folder_ / "clips" / "run.bvh", make_run().clip);
    write_text(input(), repeated_bvh(walk, 60'000, *folder_ / "scratch.bvh"));
    const CommandResult built = run_command({"build", path("clips"), "-o", path("l.kspace")});
    ASSERT_EQ(built.code, 0) << built.err;
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string path(const char* name) { return (*folder_ / name).string(); }
  static fs::path input() { return *folder_ / "long.bvh"; }

  static std::vector<StoppedWork> works() {
    const std::string in = input().string();
    std::vector<StoppedWork> out = {
        {{"clean", in, "-o", path("out/a.bvh")}, true},
        {{"info", "--repeats", in}, true},
        {{"build", in, "-o", path("out/a.kspace")}, true},
        {{"encode", in, "-o", path("out/a.ksm"), "--codec", "rma"}, true},
        {{"encode", in, "-o", path("out/a.ksm"), "--codec", "motion-space"}, true},
        {{"info", in}},
        {{"query", path("l.kspace"), in}},
        {{"compare", in, in}},
        {{"contacts", in}},
        {{"convert", in, path("out/a.glb")}},
        {{"convert", in, path("out/a.amc")}},
        {{"fill", in, "--library", path("l.kspace"), "-o", path("out/a.bvh"), "--from", "20", "--to", "20.2"}},
    };
    for (const char* codec : {"raw+zstd", "raw+xz", "qbc", "clip-pca", "dwt", "awt", "fourier", "legendre", "pca"}) {
      out.push_back({{"encode", in, "-o", path("out/a.ksm"), "--codec", codec}});
    }
    return out;
  }

  static std::set<std::string> files() {
    std::set<std::string> out;
    for (const auto& entry : fs::recursive_directory_iterator(folder_->path())) out.insert(entry.path().string());
    return out;
  }

  static std::unique_ptr<TemporaryFolder> folder_;
};
std::unique_ptr<TemporaryFolder> Stop::folder_;

TEST_F(Stop, in_the_middle_of_its_work_every_command_ends_and_leaves_nothing) {
  // Far more than the second it takes, and far less than a machine needs that hangs: a busy one gets its turn.
  constexpr int patience_ms = 60'000;
  const auto size = static_cast<std::int64_t>(fs::file_size(input()));
  const std::set<std::string> before = files();
  for (const StoppedWork& work : works()) {
    SCOPED_TRACE(fmt::format("{}", fmt::join(work.arguments, " ")));
    Command command(work.arguments);
    // Its input lies in memory: from here on it works.
    for (std::int64_t read = 0; read >= 0 && read < size && !ended(command.id(), 1);) read = bytes_read(command.id());
    if (!ended(command.id(), 0)) {
      ASSERT_EQ(::kill(command.id(), SIGTERM), 0);
    }
    ASSERT_TRUE(ended(command.id(), patience_ms)) << "it goes on";
    const CommandResult result = command.finish();
    if (work.long_work || result.code != 0) {
      EXPECT_EQ(result.code, 128 + SIGTERM) << result.err;
      EXPECT_NE(result.err.find("stopped"), std::string::npos) << result.err;
    }
    for (const std::string& file : files()) {
      if (before.contains(file)) continue;
      const bool resumable = work.arguments.front() == "build" && file.find(".kspace.") != std::string::npos;
      EXPECT_TRUE(resumable || result.code == 0) << file << " is left";
      fs::remove_all(file);
    }
  }
}

}  // namespace
}  // namespace kinespace::test
