// What `kinespace bench NAME` gives back: one row per measured number, with the bar it should reach.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kinespace {

struct BenchResult {
  std::string name;  // what was measured
  std::string data;  // on what
  double value = 0;
  std::string unit;
  std::optional<double> bar;  // what the value should reach; none: only reported
  bool higher_is_better = false;
  // True without a bar; else value <= bar, or value >= bar where higher is better.
  [[nodiscard]] bool ok() const { return !bar || (higher_is_better ? value >= *bar : value <= *bar); }
};

struct BenchReport {
  std::string bench;
  std::string device;  // what computed
  int threads = 1;
  std::vector<BenchResult> results;
};

struct BenchOptions {
  std::filesystem::path data;                   // folder with cmu/, bandai1/, bandai2/
  std::optional<std::filesystem::path> golden;  // folder of golden FPCA cases
  std::string device = "auto";
};

// The report as one JSON object: bench, device, threads, results: [{name, data, value, unit, bar, ok}], bar null where
// there is none.
[[nodiscard]] std::string to_json(const BenchReport& report);

// The report as a markdown table: a heading, what computed it, one row a result. What docs/results.md is made of.
[[nodiscard]] std::string to_markdown(const BenchReport& report);

// A bench by its name, as the command offers it.
struct Bench {
  std::string_view name;
  BenchReport (*run)(const BenchOptions& options);
};

// All benches that this build has, by name.
[[nodiscard]] std::span<const Bench> all_benches();

// Every bench the command knows; each lives in bench/<name>.cpp. Throws Error{bad_input} when its data is missing.
[[nodiscard]] BenchReport bench_codecs(const BenchOptions& options);
[[nodiscard]] BenchReport bench_dtw(const BenchOptions& options);
[[nodiscard]] BenchReport bench_filling(const BenchOptions& options);
[[nodiscard]] BenchReport bench_feet(const BenchOptions& options);
[[nodiscard]] BenchReport bench_fpca(const BenchOptions& options);
[[nodiscard]] BenchReport bench_io(const BenchOptions& options);
[[nodiscard]] BenchReport bench_kernels(const BenchOptions& options);
[[nodiscard]] BenchReport bench_playback(const BenchOptions& options);
[[nodiscard]] BenchReport bench_retrieval(const BenchOptions& options);
[[nodiscard]] BenchReport bench_search(const BenchOptions& options);
[[nodiscard]] BenchReport bench_transitions(const BenchOptions& options);

}  // namespace kinespace
