#include "cli/file_options.h"

#include <algorithm>
#include <string>
#include <utility>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/motion/file_formats.h"
#include "kinespace/motion/read.h"

namespace kinespace::cli {
namespace {

namespace fs = std::filesystem;

// With what is read along with it.
std::vector<fs::path> files_behind(const fs::path& input) {
  const FileFormat* format = find_format(input);
  if (format != nullptr && format->holds_meshes && !format->companion.empty()) {
    return {input, input.parent_path() / format->companion};
  }
  try {
    return files_read(input);
  } catch (const Error&) {
    return {input};  // no skeleton beside an .amc: its reader says so
  }
}

// With what is written along with it.
std::vector<fs::path> files_made(const fs::path& output) {
  const FileFormat* format = find_format(output);
  return format != nullptr && format->write != nullptr ? files_written(output) : std::vector<fs::path>{output};
}

bool same_place(const fs::path& a, const fs::path& b) {
  std::error_code code;
  if (fs::equivalent(a, b, code)) return true;
  const fs::path first = fs::absolute(a, code), second = fs::absolute(b, code);
  return !code && first.lexically_normal() == second.lexically_normal();
}

[[noreturn]] void refuse(const fs::path& output, std::string found, std::string expected) {
  throw Error(ErrorKind::usage, {.file = output.string(),
                                 .found = std::move(found),
                                 .expected = std::move(expected),
                                 .remedy = "give another output name"});
}

// Before the work, not after it.
void require_place_for(const fs::path& output, std::optional<FileKind> kind) {
  std::error_code ignored;
  if (fs::is_directory(output, ignored)) return;
  if (!kind) kind = kind_by_ending(output);
  if (kind) return require_replaceable(output, *kind);
  if (fs::is_regular_file(output, ignored)) {
    refuse(output, "a file", "a folder, or a name with the ending of what is to be written");
  }
}

}  // namespace

std::optional<FileKind> kind_by_ending(const fs::path& path) {
  const FileFormat* format = find_format(path);
  const bool in_folders_only =
      format != nullptr && format->holds_meshes && format->write == nullptr && format->companion.empty();
  if (format == nullptr || format->kind == FileKind::other || in_folders_only) return std::nullopt;
  return format->kind;
}

void FileOptions::add(CLI::App* command, std::initializer_list<const char*> names, FileOption::Role role,
                      std::optional<FileKind> kind) {
  // Once for each subcommand: when its options have been read, and before its work begins.
  command->parse_complete_callback([this, command] { check(command); });
  for (const char* name : names) {
    options_.push_back({.command = command, .option = command->get_option(name), .role = role, .kind = kind});
  }
}

void FileOptions::reads(CLI::App* command, std::initializer_list<const char*> options) {
  add(command, options, FileOption::Role::read, {});
}

void FileOptions::updates(CLI::App* command, std::initializer_list<const char*> options) {
  add(command, options, FileOption::Role::updated, {});
}

void FileOptions::writes(CLI::App* command, std::initializer_list<const char*> options, std::optional<FileKind> kind) {
  add(command, options, FileOption::Role::written, kind);
}

void FileOptions::check(const CLI::App* command) const {
  std::vector<fs::path> read;
  std::vector<fs::path> written;
  for (const FileOption& option : options_) {
    if (option.command != command) continue;
    const bool output = option.role == FileOption::Role::written;
    for (const std::string& value : option.option->results()) {
      const auto files = output ? files_made(value) : files_behind(value);
      (output ? written : read).insert((output ? written : read).end(), files.begin(), files.end());
      for (const fs::path& file : files) {
        if (output) require_place_for(file, option.kind);
      }
    }
  }
  for (std::size_t i = 0; i < written.size(); ++i) {
    for (const fs::path& path : read) {
      if (same_place(path, written[i])) refuse(written[i], "the output is the input", "two different files");
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (same_place(written[j], written[i])) refuse(written[i], "two outputs of one name", "two names");
    }
  }
  for (const fs::path& path : written) {
    const fs::path folder = path.parent_path();
    remove_leftovers(folder.empty() ? fs::path(".") : folder);
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) remove_leftovers(path);
  }
}

}  // namespace kinespace::cli
