// What `kinespace bench NAME` gives back: one row per measured number, with the bar it should reach.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kinespace/kernels/device.h"

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

// A cell of a table: words, a number, or nothing.
struct BenchCell {
  BenchCell() = default;
  BenchCell(double value) : number(value) {}                 // NOLINT(google-explicit-constructor): rows read as lists
  BenchCell(std::string words) : text(std::move(words)) {}   // NOLINT(google-explicit-constructor)
  BenchCell(std::string_view words) : text(words) {}         // NOLINT(google-explicit-constructor)
  BenchCell(const char* words) : text(words) {}              // NOLINT(google-explicit-constructor)
  BenchCell(std::optional<double> value) : number(value) {}  // NOLINT(google-explicit-constructor)

  std::string text;
  std::optional<double> number;
};

// A table of a paper, remade from the data given: what has no bar, or is read side by side.
struct BenchTable {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<BenchCell>> rows;  // each as long as `columns`
  std::vector<std::string> notes{};          // what a reader must know, and why a cell is empty
};

// A figure of a paper, remade: SVG.
struct BenchPicture {
  std::string name;  // of the file, without its ending
  std::string svg;
};

struct BenchReport {
  std::string bench;
  std::string device;  // what computed
  int threads = 1;
  std::vector<BenchResult> results;
  std::vector<BenchTable> tables;
  std::vector<BenchPicture> pictures;
  std::optional<KernelUses> kernels = {};  // what ran where, of benches that take a device
};

struct BenchOptions {
  // Instead of what the bench takes from `data`, where it can: codecs (clips), yoo2019 (clips and folders).
  std::vector<std::filesystem::path> clips;
  std::filesystem::path data;                   // folder with cmu/, bandai1/, bandai2/, mesh/
  std::optional<std::filesystem::path> golden;  // folder of golden FPCA cases
  std::string device = "auto";
};

// The report as one JSON object: bench, device, threads, results: [{name, data, value, unit, bar, ok}], bar null where
// there is none; tables: [{title, columns, rows, notes}], an empty cell null; kernels: [{kernel, launches,
// processor_calls}] or null.
[[nodiscard]] std::string to_json(const BenchReport& report);

// The report as a markdown table: a heading, what computed it, one row a result. What docs/results.md is made of.
[[nodiscard]] std::string to_markdown(const BenchReport& report);

// The same for one table, and as lines of columns for a terminal.
[[nodiscard]] std::string to_markdown(const BenchTable& table);
[[nodiscard]] std::string to_text(const BenchTable& table);

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
[[nodiscard]] BenchReport bench_long(const BenchOptions& options);
[[nodiscard]] BenchReport bench_mesh(const BenchOptions& options);
[[nodiscard]] BenchReport bench_playback(const BenchOptions& options);
[[nodiscard]] BenchReport bench_retrieval(const BenchOptions& options);
[[nodiscard]] BenchReport bench_rma(const BenchOptions& options);
[[nodiscard]] BenchReport bench_search(const BenchOptions& options);
[[nodiscard]] BenchReport bench_transitions(const BenchOptions& options);
[[nodiscard]] BenchReport bench_yoo2019(const BenchOptions& options);

}  // namespace kinespace
