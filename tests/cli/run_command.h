// Runs the real `kinespace` as a child process, as a user's shell would, and keeps what it said.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace kinespace::test {

struct CommandResult {
  int code = -1;               // the exit code; -1 when a signal ended it
  int signal = 0;              // the signal that ended it, 0 for none
  std::string out;             // standard output
  std::string err;             // standard error
  std::size_t peak_bytes = 0;  // the most that it had in memory
};

struct CommandOptions {
  std::vector<std::string> environment;  // "NAME=value", beside the test's own
  std::string output_to = {};            // a file or device for standard output; empty: captured
  std::string shell = {};                // a line of shell that runs it, as "$@"; empty: none
};

// A started command; finish() waits for it.
class Command {
 public:
  explicit Command(const std::vector<std::string>& arguments, const CommandOptions& options = {});
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  // Waits until the command has its own handler for the signal, then sends it.
  void send(int signal) const;
  [[nodiscard]] CommandResult finish();
  [[nodiscard]] pid_t id() const { return child_; }

 private:
  std::filesystem::path folder_;
  pid_t child_ = -1;
};

[[nodiscard]] CommandResult run_command(const std::vector<std::string>& arguments, const CommandOptions& options = {});

// The text of a BVH file: a hip that walks along X by `step_cm` a frame and a head that nods, 100 frames/s.
[[nodiscard]] std::string walking_bvh(int frames, double step_cm);

void write_text(const std::filesystem::path& path, const std::string& text);
[[nodiscard]] std::string read_text(const std::filesystem::path& path);

// The value of LOCPATH under which "de_DE.UTF-8", whose decimal point is a comma, exists; made on first use.
[[nodiscard]] const std::string& comma_locale_folder();

}  // namespace kinespace::test
