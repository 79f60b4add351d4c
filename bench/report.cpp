#include "bench/report.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace kinespace {
namespace {

// A bar inside a markdown cell would end it.
std::string cell(const std::string& text) {
  std::string out;
  out.reserve(text.size());
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

std::string words(const BenchCell& value) {
  return value.number ? fmt::format("{:.4g}", *value.number) : value.text;
}

nlohmann::ordered_json json(const BenchTable& table) {
  using Json = nlohmann::ordered_json;
  Json rows = Json::array();
  for (const auto& row : table.rows) {
    Json cells = Json::array();
    for (const BenchCell& value : row) {
      cells.push_back(value.number ? Json(*value.number) : value.text.empty() ? Json() : Json(value.text));
    }
    rows.push_back(std::move(cells));
  }
  return {{"title", table.title}, {"columns", table.columns}, {"rows", std::move(rows)}, {"notes", table.notes}};
}

nlohmann::ordered_json json(const KernelUses& uses) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (std::size_t f = 0; f < uses.size(); ++f) {
    out.push_back({{"kernel", name_of(kernel_families[f])},
                   {"launches", uses[f].launches},
                   {"processor_calls", uses[f].processor_calls}});
  }
  return out;
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
  Json tables = Json::array();
  for (const BenchTable& table : report.tables) tables.push_back(json(table));
  const Json object{{"bench", report.bench},     {"device", report.device},
                    {"threads", report.threads}, {"results", results},
                    {"tables", tables},          {"kernels", report.kernels ? json(*report.kernels) : Json()}};
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
  for (const BenchTable& table : report.tables) out.append("\n").append(to_markdown(table));
  return out;
}

std::string to_markdown(const BenchTable& table) {
  std::string out = fmt::format("### {}\n\n|", table.title);
  for (const std::string& column : table.columns) out += fmt::format(" {} |", cell(column));
  out += "\n|";
  for (std::size_t c = 0; c < table.columns.size(); ++c) out += c == 0 ? "---|" : "---:|";
  for (const auto& row : table.rows) {
    out += "\n|";
    for (const BenchCell& value : row) out += fmt::format(" {} |", cell(words(value)));
  }
  out += '\n';
  for (const std::string& note : table.notes) out += fmt::format("\n{}\n", cell(note));
  return out;
}

std::string to_text(const BenchTable& table) {
  std::vector<std::size_t> widths;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    widths.push_back(table.columns[c].size());
    for (const auto& row : table.rows) widths[c] = std::max(widths[c], words(row[c]).size());
  }
  std::string out = fmt::format("{}\n", table.title);
  const auto add = [&](std::size_t c, const std::string& text) {
    const std::size_t gap = widths[c] - text.size();
    out.append(c == 0 ? 2 : gap + 2, ' ');
    out += text;
    if (c == 0) out.append(gap, ' ');
  };
  for (std::size_t c = 0; c < widths.size(); ++c) add(c, table.columns[c]);
  for (const auto& row : table.rows) {
    out += "\n";
    for (std::size_t c = 0; c < widths.size(); ++c) add(c, words(row[c]));
  }
  out += '\n';
  for (const std::string& note : table.notes) out += fmt::format("  {}\n", note);
  return out;
}

}  // namespace kinespace
