// `kinespace bench yoo2019`: tables 1 to 8 and figures 8 and 9 of the paper on the clips given, its numbers beside ours.
#include <algorithm>
#include <thread>

#include <fmt/format.h>

#include "bench/golden.h"
#include "bench/yoo2019_tables.h"

namespace kinespace {
namespace {

struct PaperInputs {
  std::string name;
  std::vector<std::filesystem::path> files;  // and folders
};

// Without clips of the user's own: both of bandai, and what there is of the paper's own database.
std::vector<PaperInputs> paper_inputs(const BenchOptions& options) {
  if (options.clips.size() == 1) {
    const auto& path = options.clips.front();
    return {{(path.has_filename() ? path : path.parent_path()).filename().string(), options.clips}};
  }
  if (!options.clips.empty()) return {{fmt::format("{} files and folders", options.clips.size()), options.clips}};
  return {{"bandai1+bandai2", {options.data / "bandai1", options.data / "bandai2"}},
          {"cmu 01-03", {options.data / "cmu"}}};
}

}  // namespace

std::string picture_name(const std::string& set) {
  std::string out = set;
  for (char& c : out) {
    const bool keeps = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
                       c == '+' || c == '_' || c == '-';
    if (!keeps) c = '-';
  }
  return out;
}

BenchReport bench_yoo2019(const BenchOptions& options) {
  const Compute compute = Compute::open(options.device);
  BenchReport report{.bench = "yoo2019",
                     .device = compute.describe(),
                     .threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()))};
  const auto golden = find_golden_folder(options.golden);
  for (const PaperInputs& inputs : paper_inputs(options)) {
    const PreparedSet set = load_prepared_set(inputs.name, inputs.files, {.most_cycles = 0});
    add_space_tables(set, compute, report);
    add_smoothing_tables(set, golden, report);
    add_basis_tables(set, options.clips.empty(), report);
    add_vector_tables(set, compute, report);
  }
  return report;
}

}  // namespace kinespace
