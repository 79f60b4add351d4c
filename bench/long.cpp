// `kinespace bench long`: what recordings of ten thousand, a hundred thousand and a million frames take, command by
// command: processor time against that of a tenth of the frames, and the most memory. Each is a run of this very
// program, as a user would start it. A million frames take a quarter of an hour in all.
#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bench/report.h"
#include "bench/scratch_folder.h"
#include "kinespace/base/error.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

constexpr std::array frame_counts = {10'000, 100'000, 1'000'000};

// The clip forth and back, for so many frames: nothing jumps.
Clip for_frames(const Clip& clip, int frames) {
  Clip out = make_clip(clip.name, clip.skeleton, clip.rate_hz, frames);
  const int turn = std::max(1, 2 * (clip.frames - 1));
  const auto source = [&](int f) {
    const int at = f % turn;
    return at < clip.frames ? at : turn - at;
  };
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    for (int f = 0; f < frames; ++f) out.set_rotation(j, f, clip.rotation(j, source(f)));
  }
  for (const auto& track : clip.translations) {
    auto& values = out.require_translation_track(track.joint).values;
    for (int f = 0; f < frames; ++f) {
      values[static_cast<std::size_t>(f)] = track.values[static_cast<std::size_t>(source(f))];
    }
  }
  return out;
}

struct Taken {
  double cpu_s = 0;
  double peak_mb = 0;
};

// Runs this program. Its output goes nowhere; that it fails is an error.
Taken run(const std::vector<std::string>& arguments) {
  std::vector<char*> words = {const_cast<char*>("kinespace")};  // NOLINT(cppcoreguidelines-pro-type-const-cast): exec
  for (const std::string& a : arguments) words.push_back(const_cast<char*>(a.c_str()));  // NOLINT: the same
  words.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, 1);
    ::dup2(nowhere, 2);
    ::execv("/proc/self/exe", words.data());
    ::_exit(127);
  }
  int status = 0;
  rusage usage{};
  if (child < 0 || ::wait4(child, &status, 0, &usage) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw Error(ErrorKind::machine, {.found = "`kinespace " + arguments[0] + "` did not end well",
                                     .expected = "a run to measure",
                                     .remedy = "see whether memory and disk are enough for a million frames"});
  }
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime),
          .peak_mb = static_cast<double>(usage.ru_maxrss) * 1024 / 1e6};
}

// What is measured: a name, and the words of the command line for a clip.
std::vector<std::pair<std::string, std::vector<std::string>>> command_lines(const ScratchFolder& folder,
                                                                            const std::string& clip) {
  const std::string library = folder.file("one.kspace").string();
  return {{"info", {"info", clip}},
          {"info --repeats", {"info", "--repeats", clip}},
          {"query", {"query", library, clip}},
          {"build", {"build", clip, "-o", folder.file("long.kspace").string()}},
          {"clean", {"clean", clip, "-o", folder.file("clean.bvh").string()}},
          {"encode, motion-space", {"encode", clip, "-o", folder.file("a.ksm").string()}},
          {"encode, rma", {"encode", clip, "--codec", "rma", "-o", folder.file("b.ksm").string()}}};
}

void add_results(const std::string& name, int frames, const Taken* tenth, const Taken& now, const Clip& clip,
                 BenchReport& report) {
  const std::string data = fmt::format("{} frames, {} joints", frames, clip.skeleton.joint_count());
  const bool bounded = frames == 100'000;
  const bool largest = frames == 1'000'000 && name != "info --repeats" && name != "encode, rma";
  std::optional<double> bar;
  if (bounded) bar = 400;
  if (largest) bar = 1500;
  report.results.push_back({.name = name + ": memory", .data = data, .value = now.peak_mb, .unit = "MB", .bar = bar});
  report.results.push_back({.name = name + ": processor time", .data = data, .value = now.cpu_s, .unit = "s"});
  if (tenth == nullptr) return;
  report.results.push_back({.name = name + ": time over that of a tenth",
                            .data = data,
                            .value = now.cpu_s / tenth->cpu_s,
                            .unit = "x",
                            .bar = bounded ? std::optional(14.0) : std::nullopt});
}

// The first clip of a folder whose name begins so.
std::filesystem::path find_clip(const std::filesystem::path& folder, std::string_view start) {
  std::vector<std::filesystem::path> found;
  if (std::filesystem::is_directory(folder)) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      const bool wanted = entry.path().filename().string().starts_with(start);
      if (wanted && is_motion_file(entry.path())) found.push_back(entry.path());
    }
  }
  if (found.empty()) {
    throw Error(ErrorKind::bad_input, {.file = folder.string(),
                                       .found = fmt::format("no clip whose name begins with \"{}\"", start),
                                       .expected = "the clips of this bench",
                                       .remedy = "name the folder that has them with --data"});
  }
  return *std::ranges::min_element(found);
}

}  // namespace

BenchReport bench_long(const BenchOptions& options) {
  const Clip clip = read_clip(find_clip(options.data / "bandai1", "walk"));
  const ScratchFolder folder;
  const std::string short_clip = folder.file("one.bvh").string();
  write_bvh(short_clip, clip);
  static_cast<void>(run({"build", short_clip, "-o", folder.file("one.kspace").string()}));
  BenchReport report{
      .bench = "long", .device = "cpu", .threads = static_cast<int>(std::thread::hardware_concurrency())};
  std::vector<Taken> before;
  for (const int frames : frame_counts) {
    const std::string path = folder.file("long.bvh").string();
    write_bvh(path, for_frames(clip, frames));
    std::vector<Taken> now;
    for (const auto& [name, words] : command_lines(folder, path)) {
      now.push_back(run(words));
      add_results(name, frames, before.empty() ? nullptr : &before[now.size() - 1], now.back(), clip, report);
    }
    before = std::move(now);
  }
  return report;
}

}  // namespace kinespace
