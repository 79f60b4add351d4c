#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bench/report.h"
#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/json_output.h"

namespace kinespace::cli {
namespace {

struct BenchCommandOptions {
  std::string name;
  std::string data;
  std::string golden;
  std::string device = "auto";
  bool json = false;
  bool markdown = false;
};

Json to_json(const BenchReport& report) {
  Json results = Json::array();
  for (const BenchResult& result : report.results) {
    results.push_back({{"name", result.name},
                       {"data", result.data},
                       {"value", result.value},
                       {"unit", result.unit},
                       {"bar", result.bar ? Json(*result.bar) : Json()},
                       {"ok", result.ok()}});
  }
  return {{"bench", report.bench}, {"device", report.device}, {"threads", report.threads}, {"results", results}};
}

void print_rows(const BenchReport& report) {
  fmt::print("{}: {}; threads: {}\n", report.bench, report.device, report.threads);
  for (const BenchResult& result : report.results) {
    std::string verdict;
    if (result.bar) {
      verdict = fmt::format("  {} ({} {:.4g})", result.ok() ? "ok" : "MISSED",
                            result.higher_is_better ? ">=" : "<=", *result.bar);
    }
    fmt::print("  {}, {}: {:.4g} {}{}\n", result.name, result.data, result.value, result.unit, verdict);
  }
}

void run_bench(const BenchCommandOptions& options) {
  BenchOptions bench_options{.data = options.data, .device = options.device};
  if (!options.golden.empty()) bench_options.golden = options.golden;
  for (const Bench& bench : all_benches()) {
    if (bench.name != options.name) continue;
    const BenchReport report = bench.run(bench_options);
    if (options.json) {
      print_json(to_json(report));
    } else if (options.markdown) {
      fmt::print("{}", to_markdown(report));
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
  command->add_option("NAME", options->name, "Which bench")->required()->check(CLI::IsMember(names));
  command->add_option("--data", options->data, "Folder with cmu/, bandai1/, bandai2/")
      ->envname("KINESPACE_DATA")
      ->capture_default_str();
  command->add_option("--golden", options->golden, "Folder of golden FPCA cases")->envname("KINESPACE_GOLDEN");
  command->add_option("--device", options->device, "auto, cpu or opencl[:N]")->capture_default_str();
  auto* json = command->add_flag("--json", options->json, "Print one JSON object");
  command->add_flag("--markdown", options->markdown, "Print a markdown table")->excludes(json);
  command->callback([options] { run_bench(*options); });
}

}  // namespace kinespace::cli
