#include "cli/user_words.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "kinespace/base/nearest_name.h"

namespace kinespace::cli {
namespace {

// The option that sets a field. Where subcommands differ, the first row of the one at work counts.
struct OptionOfField {
  std::string_view subcommand;  // empty: any
  std::string_view field;
  std::string_view option;
};
constexpr std::array options_of_fields = {
    OptionOfField{"build", "variance_share", "--variance"},
    OptionOfField{"build", "functions", "--functions"},
    OptionOfField{"build", "count", "--functions"},
    OptionOfField{"build", "points", "--points"},
    OptionOfField{"query", "k", "-k"},
    OptionOfField{"query", "candidates", "--candidates"},
    OptionOfField{"transition", "window_s", "--window"},
    OptionOfField{"transition", "shortest_s", "--overlap"},
    OptionOfField{"transition", "largest_cost_cm", "--max-cost"},
    OptionOfField{"blend", "at", "--at"},
    OptionOfField{"blend", "neighbours", "--neighbours"},
    OptionOfField{"blend", "functions", "--lod"},
    OptionOfField{"blend", "weights", "--weights"},
    OptionOfField{"fill", "max_gap_s", "--max-gap"},
    OptionOfField{"clean", "floor_cm", "--floor"},
    OptionOfField{"encode", "mean_error_cm", "--error"},
    OptionOfField{"encode", "max_error_cm", "--max-error"},
    OptionOfField{"encode", "bytes", "--bytes"},
    OptionOfField{"encode", "variance", "--variance"},
    OptionOfField{"mesh encode", "kg", "--kg"},
    OptionOfField{"mesh encode", "bytes", "--bytes"},
    OptionOfField{"mesh encode", "bases", "--bases"},
    OptionOfField{"mesh encode", "clusters", "--clusters"},
    OptionOfField{"mesh encode", "coarse_vertices", "--multi-resolution"},
    OptionOfField{"mesh encode", "rate_hz", "--rate"},
};

std::optional<std::string_view> option_of(std::string_view subcommand, std::string_view field) {
  const auto found = std::ranges::find_if(
      options_of_fields, [&](const auto& row) { return row.subcommand == subcommand && row.field == field; });
  if (found == options_of_fields.end()) return std::nullopt;
  return found->option;
}

std::string subcommand_of(const CLI::App& app) {
  std::string out;
  for (auto chosen = app.get_subcommands(); !chosen.empty(); chosen = chosen.front()->get_subcommands()) {
    out += (out.empty() ? "" : " ") + chosen.front()->get_name();
  }
  return out;
}

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}
bool is_upper(char c) {
  return c >= 'A' && c <= 'Z';
}

// One name in a message as the code has it.
struct NameInText {
  std::size_t end = 0;     // in the text
  std::string_view field;  // without what it belongs to
  bool qualified = false;  // "CodecTarget::mean_error_cm", "FillOptions.max_gap_s"
};

NameInText name_at(std::string_view text, std::size_t at) {
  const auto end_of_word = [&](std::size_t from) {
    while (from < text.size() && is_word(text[from])) ++from;
    return from;
  };
  const std::size_t end = end_of_word(at);
  const std::size_t separator = text.substr(end).starts_with("::") ? 2 : text.substr(end).starts_with(".") ? 1 : 0;
  const std::size_t next = end_of_word(end + separator);
  if (separator > 0 && is_upper(text[at]) && next > end + separator) {
    return {next, text.substr(end + separator, next - end - separator), true};
  }
  return {end, text.substr(at, end - at), false};
}

// Fields become options: those that are named with what they belong to, those that are set ("window_s = 30") and those
// that no sentence has ("shortest_s"). Quoted text is a user's or a file's own.
std::string translated(const std::string& subcommand, std::string_view text) {
  std::string out;
  bool quoted = false;
  for (std::size_t at = 0; at < text.size();) {
    if (text[at] == '"') quoted = !quoted;
    if (quoted || !is_word(text[at])) {
      out += text[at++];
      continue;
    }
    const NameInText name = name_at(text, at);
    const std::string_view rest = text.substr(name.end);
    const bool set = at == 0 && rest.starts_with(" = ");
    const bool is_field = name.qualified || set || name.field.find('_') != std::string_view::npos;
    const auto option = is_field ? option_of(subcommand, name.field) : std::nullopt;
    if (option) {
      out.append(*option).append(set ? " " : "");
    } else {
      out += name.qualified ? name.field : text.substr(at, name.end - at);
    }
    at = name.end + (option && set ? std::string_view(" = ").size() : 0);
  }
  return out;
}

std::vector<std::string> names_of(const CLI::App& app) {
  std::vector<std::string> out;
  for (const CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; })) {
    out.push_back(subcommand->get_name());
  }
  return out;
}

}  // namespace

std::string in_users_words(const CLI::App& app, const Error& error) {
  if (error.kind() != ErrorKind::usage) return error.what();
  const std::string subcommand = subcommand_of(app);
  ErrorDetails details = error.details();
  details.found = translated(subcommand, details.found);
  details.expected = translated(subcommand, details.expected);
  details.remedy = translated(subcommand, details.remedy);
  return format_error(details);
}

std::optional<std::string> mistyped_subcommand(const CLI::App& app, int argc, const char* const* argv) {
  const CLI::App* level = &app;
  std::string line = "kinespace";
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word.starts_with("-")) continue;  // an option of the whole command; none of them takes a value
    const std::vector<std::string> names = names_of(*level);
    if (names.empty()) return std::nullopt;
    if (std::ranges::find(names, word) == names.end()) {
      return fmt::format("no subcommand \"{}\"; did you mean '{} {}'? '{} --help' lists them", word, line,
                         nearest_name(word, names).value_or(""), line);
    }
    level = level->get_subcommand(std::string(word));
    line += " " + std::string(word);
  }
  return std::nullopt;
}

}  // namespace kinespace::cli
