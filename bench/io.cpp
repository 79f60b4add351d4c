// `kinespace bench io`: how fast motion files are read and written, that reading is linear in the file, how fast joint
// positions come out, and what a clip loses on its way through a file.
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <functional>
#include <limits>
#include <mutex>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "bench/report.h"
#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/base/parallel.h"
#include "kinespace/motion/amc.h"
#include "kinespace/motion/bvh.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/read.h"

namespace kinespace {
namespace {

constexpr int passes = 3;

// Files of one kind in memory, and how to read one.
struct Corpus {
  std::string name;
  std::vector<std::filesystem::path> paths;
  std::vector<FileContent> texts;
  std::vector<Asf> skeletons;  // one a file, or none
  [[nodiscard]] Clip parse(std::size_t i) const {
    const std::string source = paths[i].string();
    return skeletons.empty() ? parse_bvh(texts[i].text(), source) : parse_amc(texts[i].text(), skeletons[i], source);
  }
  [[nodiscard]] double megabytes() const {
    double bytes = 0;
    for (const FileContent& text : texts) bytes += static_cast<double>(text.text().size());
    return bytes / 1e6;
  }
};

void add_files(Corpus& corpus, const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder)) {
    throw Error(ErrorKind::bad_input, {.file = folder.string(),
                                       .found = "no such folder",
                                       .expected = "the clips of this bench",
                                       .remedy = "name the folder that has them with --data"});
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (is_motion_file(entry.path())) corpus.paths.push_back(entry.path());
  }
}

Corpus load_corpus(const std::string& name, const std::vector<std::filesystem::path>& folders) {
  Corpus corpus{.name = name};
  for (const auto& folder : folders) add_files(corpus, folder);
  std::ranges::sort(corpus.paths);
  for (const auto& path : corpus.paths) {
    corpus.texts.emplace_back(path);
    const auto files = files_read(path);
    if (files.size() > 1) corpus.skeletons.push_back(read_asf(files[1]));
  }
  return corpus;
}

// Processor time of this thread, which is what one core needs however busy the machine is.
double now_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double cpu_seconds(const std::function<void()>& work) {
  const double start = now_s();
  work();
  return now_s() - start;
}

// The sum over files of each file's fastest pass: a cold cache and what else the machine does count as little as they
// can.
double fastest(std::size_t files, const std::function<double(std::size_t)>& timed) {
  double sum = 0;
  for (std::size_t i = 0; i < files; ++i) {
    double best = std::numeric_limits<double>::infinity();
    for (int pass = 0; pass < passes; ++pass) best = std::min(best, timed(i));
    sum += best;
  }
  return sum;
}

void measure_speed(const Corpus& corpus, std::vector<BenchResult>& results) {
  const std::string kind = corpus.skeletons.empty() ? "BVH" : "AMC";
  double frames = 0;
  double positions_s = 0;
  double written_mb = 0;
  double write_s = 0;
  const double parse_s = fastest(corpus.paths.size(), [&](std::size_t i) {
    Clip clip;
    return cpu_seconds([&] { clip = corpus.parse(i); });
  });
  for (std::size_t i = 0; i < corpus.paths.size(); ++i) {
    const Clip clip = corpus.parse(i);
    frames += clip.frames;
    positions_s +=
        fastest(1, [&](std::size_t) { return cpu_seconds([&] { static_cast<void>(joint_positions(clip)); }); });
    std::string text;
    write_s += cpu_seconds([&] { text = format_bvh(clip); });
    written_mb += static_cast<double>(text.size()) / 1e6;
  }
  results.push_back({.name = "read " + kind + ", one core",
                     .data = corpus.name,
                     .value = corpus.megabytes() / parse_s,
                     .unit = "MB/s",
                     .bar = 150,
                     .higher_is_better = true});
  results.push_back(
      {.name = "write BVH, one core", .data = corpus.name, .value = written_mb / write_s, .unit = "MB/s"});
  results.push_back(
      {.name = "joint positions, one core", .data = corpus.name, .value = frames / positions_s, .unit = "frames/s"});
}

// The text of a clip that plays `times` times over.
std::string repeated(const FileContent& file, int frames, int times) {
  const std::string_view text = file.text();
  const auto data = text.find('\n', text.find("Frame Time")) + 1;
  std::string out(text.substr(0, text.find("Frames:")));
  out += fmt::format("Frames: {}\nFrame Time: 0.0333333\n", static_cast<std::int64_t>(frames) * times);
  for (int i = 0; i < times; ++i) out.append(text.substr(data)).append("\n");
  return out;
}

// Time of a file of 2n frames over that of one of n frames.
BenchResult linearity(const Corpus& corpus) {
  const Clip clip = corpus.parse(0);
  const int times = std::max(1, 30000 / clip.frames);
  const std::string once = repeated(corpus.texts[0], clip.frames, times);
  const std::string twice = repeated(corpus.texts[0], clip.frames, 2 * times);
  const auto time = [](const std::string& text) {
    double best = std::numeric_limits<double>::infinity();
    for (int pass = 0; pass < 2 * passes; ++pass) {
      best = std::min(best, cpu_seconds([&] { static_cast<void>(parse_bvh(text, "repeated.bvh")); }));
    }
    return best;
  };
  const double ratio = time(twice) / time(once);
  return {.name = "time to read 2n frames over n",
          .data = fmt::format("n = {}", clip.frames * times),
          .value = ratio,
          .unit = "",
          .bar = 2.5};
}

Clip through_bvh(const Clip& clip) {
  return parse_bvh(format_bvh(clip), "again.bvh");
}

Clip through_acclaim(const Clip& clip) {
  const AcclaimText text = format_amc(clip);
  return parse_amc(text.amc, parse_asf(text.asf, "again.asf"), "again.amc");
}

// The largest distance of a joint from where it was; joints by name, joint 0 with joint 0.
double largest_distance(const Clip& a, const Clip& b) {
  const JointPositions pa = joint_positions(a);
  const JointPositions pb = joint_positions(b);
  double largest = 0;
  for (int j = 0; j < pa.joints; ++j) {
    const int other = j == 0 ? 0 : b.skeleton.find(a.skeleton.joints[static_cast<std::size_t>(j)].name);
    if (other < 0 || pa.frames != pb.frames) return std::numeric_limits<double>::infinity();
    for (int f = 0; f < pa.frames; ++f) largest = std::max(largest, (pa.at(f, j) - pb.at(f, other)).norm());
  }
  return largest;
}

void measure_loss(const Corpus& corpus, std::vector<BenchResult>& results) {
  std::mutex mutex;
  double bvh = 0;
  double acclaim = 0;
  parallel_for(std::size_t{0}, corpus.paths.size(), [&](std::size_t i) {
    const Clip clip = corpus.parse(i);
    const double by_bvh = largest_distance(clip, through_bvh(clip));
    const double by_acclaim = largest_distance(clip, through_acclaim(clip));
    const std::lock_guard lock(mutex);
    bvh = std::max(bvh, by_bvh);
    acclaim = std::max(acclaim, by_acclaim);
  });
  results.push_back(
      {.name = "largest joint error, to BVH and back", .data = corpus.name, .value = bvh, .unit = "cm", .bar = 1e-4});
  results.push_back({.name = "largest joint error, to ASF/AMC and back",
                     .data = corpus.name,
                     .value = acclaim,
                     .unit = "cm",
                     .bar = 1e-4});
}

}  // namespace

BenchReport bench_io(const BenchOptions& options) {
  BenchReport report{.bench = "io", .device = "cpu", .threads = 1, .results = {}};
  const Corpus bandai = load_corpus("bandai1+bandai2", {options.data / "bandai1", options.data / "bandai2"});
  const Corpus cmu = load_corpus("cmu", {options.data / "cmu/01", options.data / "cmu/02", options.data / "cmu/03"});
  for (const Corpus* corpus : {&bandai, &cmu}) {
    if (corpus->paths.empty()) {
      throw Error(ErrorKind::bad_input, {.file = options.data.string(),
                                         .found = "no clips of " + corpus->name,
                                         .expected = "the clips of this bench"});
    }
    measure_speed(*corpus, report.results);
  }
  report.results.push_back(linearity(bandai));
  for (const Corpus* corpus : {&bandai, &cmu}) measure_loss(*corpus, report.results);
  return report;
}

}  // namespace kinespace
