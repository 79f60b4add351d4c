#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "bench/report.h"
#include "cli/commands.h"
#include "cli/output.h"
#include "cli/session.h"
#include "kinespace/base/file.h"
#include "kinespace/motion/file_formats.h"

namespace kinespace::cli {
namespace {

struct BenchCommandOptions {
  std::string name;
  std::string data;
  std::string golden;
  std::vector<std::filesystem::path> clips;
  std::filesystem::path pictures;
  std::string device = "auto";
  bool json = false;
  bool markdown = false;
  bool list = false;
};

void print_rows(const BenchReport& report) {
  print("{}: {}; threads: {}\n", report.bench, report.device, report.threads);
  for (const BenchResult& result : report.results) {
    std::string verdict;
    if (result.bar) {
      verdict = fmt::format("  {} ({} {:.4g})", result.ok() ? "ok" : "MISSED",
                            result.higher_is_better ? ">=" : "<=", *result.bar);
    }
    print("  {}, {}: {:.4g} {}{}\n", result.name, result.data, result.value, result.unit, verdict);
  }
  for (const BenchTable& table : report.tables) print("\n{}", to_text(table));
}

void write_pictures(const BenchReport& report, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const BenchPicture& picture : report.pictures) {
    write_file_atomically(folder / (picture.name + ".svg"), picture.svg);
  }
}

void run_bench(const BenchCommandOptions& options) {
  if (options.list) {
    for (const Bench& bench : all_benches()) print("{}\n", bench.name);
    return;
  }
  if (options.name.empty()) throw CLI::RequiredError("NAME");
  stop_at_once();
  BenchOptions bench_options{.data = options.data, .device = options.device};
  if (!options.golden.empty()) bench_options.golden = options.golden;
  bench_options.clips = options.clips;
  for (const Bench& bench : all_benches()) {
    if (bench.name != options.name) continue;
    const BenchReport report = bench.run(bench_options);
    if (!options.pictures.empty()) write_pictures(report, options.pictures);
    if (options.json) {
      print("{}", to_json(report));
    } else if (options.markdown) {
      print("{}", to_markdown(report));
    } else {
      print_rows(report);
    }
  }
}

}  // namespace

void add_bench(CLI::App& app, Session& /*session*/) {
  std::vector<std::string> names;
  for (const Bench& bench : all_benches()) names.emplace_back(bench.name);
  CLI::App* command =
      app.add_subcommand("bench", "Measure this build on your data, each number beside the bar it should reach");
  const auto options = std::make_shared<BenchCommandOptions>();
  options->data = "build/data";
  command->add_option("NAME", options->name, "Which bench")->check(CLI::IsMember(names));
  command->add_flag("--list", options->list, "Print the names of the benches");
  command->add_option("--data", options->data, "Folder with cmu/, bandai1/, bandai2/")
      ->envname("KINESPACE_DATA")
      ->capture_default_str();
  command->add_option("--golden", options->golden, "Folder of golden FPCA cases")->envname("KINESPACE_GOLDEN");
  command->add_option("--device", options->device, "auto, cpu or opencl[:N]")->capture_default_str();
  command->add_option("--clips", options->clips,
                      fmt::format("Of these clips ({}) instead: bench codecs and yoo2019, that also of folders",
                                  listed(clip_endings_read())));
  command->add_option("--pictures", options->pictures, "Folder for the bench's figures, as SVG");
  auto* json = command->add_flag("--json", options->json, "Print one JSON object");
  command->add_flag("--markdown", options->markdown, "Print a markdown table")->excludes(json);
  command->callback([options] { run_bench(*options); });
}

}  // namespace kinespace::cli
