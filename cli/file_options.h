// Which options of the subcommands name files, and which way the data go. From this table the command holds to its rule
// that nothing it reads is written over, before any work is done, and the tests try the rule on every subcommand.
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <span>
#include <vector>

#include <CLI/CLI.hpp>

#include "kinespace/base/file_kind.h"

namespace kinespace::cli {

struct FileOption {
  enum class Role : std::uint8_t {
    read,     // never written over
    updated,  // read and changed, by the user's wish; no output may be it
    written,
  };
  CLI::App* command = nullptr;
  CLI::Option* option = nullptr;
  Role role = Role::read;
  std::optional<FileKind> kind;  // of an output that has one whatever its ending
};

class FileOptions {
 public:
  // Said once all options of the subcommand are there, by their names: "LIB", "--picture".
  void reads(CLI::App* command, std::initializer_list<const char*> options);
  void updates(CLI::App* command, std::initializer_list<const char*> options);
  void writes(CLI::App* command, std::initializer_list<const char*> options, std::optional<FileKind> kind = {});

  [[nodiscard]] std::span<const FileOption> all() const { return options_; }

  // Throws Error{usage} when an output of the command is one of its inputs (by whatever path or link, companions such
  // as the .asf of an .amc included), two outputs are one file, or a file of another kind stands where one is to go.
  // Then removes what killed runs left beside the outputs.
  void check(const CLI::App* command) const;

 private:
  void add(CLI::App* command, std::initializer_list<const char*> names, FileOption::Role role,
           std::optional<FileKind> kind);

  std::vector<FileOption> options_;
};

// The kind of file that is written under this name, where its ending tells.
[[nodiscard]] std::optional<FileKind> kind_by_ending(const std::filesystem::path& path);

}  // namespace kinespace::cli
