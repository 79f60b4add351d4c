#include "bench/report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kinespace {
namespace {

// A bar inside a markdown cell would end it.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out;
}

std::string bar(const BenchResult& result) {
  if (!result.bar) return "";
  return fmt::format("{} {:.4g}", result.higher_is_better ? ">=" : "<=", *result.bar);
}

std::string verdict(const BenchResult& result) {
  if (!result.bar) return "";
  return result.ok() ? "yes" : "**no**";
}

}  // namespace

#define KINESPACE_BENCH(name) Bench{#name, bench_##name},
std::span<const Bench> all_benches() {
  static const std::vector<Bench> benches{
#include "bench/bench_list.inc"
  };
  return benches;
}
#undef KINESPACE_BENCH

std::string to_json(const BenchReport& report) {
  using Json = nlohmann::ordered_json;
  Json results = Json::array();
  for (const BenchResult& result : report.results) {
    results.push_back({{"name", result.name},
                       {"data", result.data},
                       {"value", result.value},
                       {"unit", result.unit},
                       {"bar", result.bar ? Json(*result.bar) : Json()},
                       {"ok", result.ok()}});
  }
  const Json object{
      {"bench", report.bench}, {"device", report.device}, {"threads", report.threads}, {"results", results}};
  return object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string to_markdown(const BenchReport& report) {
  std::string out = fmt::format("## {}\n\n{}; {} thread{}.\n\n", report.bench, report.device, report.threads,
                                report.threads == 1 ? "" : "s");
  out += "| what | data | value | unit | bar | reached |\n|---|---|---:|---|---|---|\n";
  for (const BenchResult& result : report.results) {
    out += fmt::format("| {} | {} | {:.4g} | {} | {} | {} |\n", cell(result.name), cell(result.data), result.value,
                       cell(result.unit), bar(result), verdict(result));
  }
  return out;
}

}  // namespace kinespace
