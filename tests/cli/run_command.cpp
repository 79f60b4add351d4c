#include "tests/cli/run_command.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/data.h"

extern char** environ;

namespace kinespace::test {
namespace {

void require(int code, const char* what) {
  if (code != 0) throw std::system_error(code, std::generic_category(), what);
}

std::vector<char*> pointers(std::vector<std::string>& strings) {
  std::vector<char*> out;
  out.reserve(strings.size() + 1);
  for (std::string& s : strings) out.push_back(s.data());
  out.push_back(nullptr);
  return out;
}

// Not the user's: what was measured on this machine would decide where kernels run.
const std::string& own_cache() {
  static const TemporaryFolder folder;
  static const std::string variable = "XDG_CACHE_HOME=" + folder.path().string();
  return variable;
}

std::vector<std::string> environment_with(std::vector<std::string> extra) {
  const auto sets_cache = [](const std::string& entry) { return entry.starts_with("XDG_CACHE_HOME="); };
  if (std::none_of(extra.begin(), extra.end(), sets_cache)) extra.push_back(own_cache());
  std::vector<std::string> out = extra;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    const std::string name = text.substr(0, text.find('=') + 1);
    const bool replaced = std::any_of(extra.begin(), extra.end(), [&](const auto& e) { return e.starts_with(name); });
    if (!replaced) out.push_back(text);
  }
  return out;
}

// True when the process has a handler for the signal: bit signal - 1 of SigCgt.
bool catches(pid_t child, int signal) {
  std::ifstream status(fmt::format("/proc/{}/status", child));
  std::string line;
  while (std::getline(status, line)) {
    if (!line.starts_with("SigCgt:")) continue;
    const std::size_t digits = std::min(line.find_first_not_of(" \t", 7), line.size());
    std::uint64_t caught = 0;
    std::from_chars(line.data() + digits, line.data() + line.size(), caught, 16);
    return ((caught >> (signal - 1)) & 1U) != 0;
  }
  return false;
}

// Left to be waited for all the same.
bool has_ended(pid_t child) {
  siginfo_t info{};
  return ::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOHANG | WNOWAIT) != 0 || info.si_pid == child;
}

}  // namespace

Command::Command(const std::vector<std::string>& arguments, const CommandOptions& options) {
  std::string name = (std::filesystem::temp_directory_path() / "kinespace-run-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::system_error(errno, std::generic_category(), name);
  folder_ = name;
  std::vector<std::string> words;
  if (!options.shell.empty()) words = {"/bin/sh", "-c", options.shell, "sh"};
  words.emplace_back(KINESPACE_COMMAND_PATH);
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<std::string> environment = environment_with(options.environment);
  const std::string out = options.output_to.empty() ? (folder_ / "out").string() : options.output_to;
  const std::string err = (folder_ / "err").string();

  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  sigset_t defaults;
  sigemptyset(&defaults);
  sigaddset(&defaults, SIGINT);
  sigaddset(&defaults, SIGTERM);
  posix_spawn_file_actions_init(&files);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  const int code =
      posix_spawn(&child_, words[0].c_str(), &files, &attributes, pointers(words).data(), pointers(environment).data());
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  require(code, words[0].c_str());
}

Command::~Command() {
  if (child_ > 0) {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

void Command::send(int signal) const {
  while (!catches(child_, signal)) {
    if (has_ended(child_)) throw std::runtime_error("the command ended before it caught the signal");
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  require(::kill(child_, signal) == 0 ? 0 : errno, "kill");
}

CommandResult Command::finish() {
  int status = 0;
  rusage usage{};
  if (::wait4(child_, &status, 0, &usage) != child_) throw std::system_error(errno, std::generic_category(), "wait4");
  child_ = -1;
  CommandResult result;
  result.peak_bytes = static_cast<std::size_t>(usage.ru_maxrss) * 1024;
  if (WIFEXITED(status)) result.code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  if (std::filesystem::exists(folder_ / "out")) result.out = read_text(folder_ / "out");
  result.err = read_text(folder_ / "err");
  return result;
}

CommandResult run_command(const std::vector<std::string>& arguments, const CommandOptions& options) {
  return Command(arguments, options).finish();
}

std::string walking_bvh(int frames, double step_cm) {
  std::string text =
      "HIERARCHY\n"
      "ROOT Hips\n{\n  OFFSET 0 90 0\n"
      "  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
      "  JOINT Head\n  {\n    OFFSET 0 60 0\n    CHANNELS 3 Zrotation Xrotation Yrotation\n"
      "    End Site\n    {\n      OFFSET 0 20 0\n    }\n  }\n}\n";
  text += fmt::format("MOTION\nFrames: {}\nFrame Time: 0.01\n", frames);
  for (int f = 0; f < frames; ++f) {
    text +=
        fmt::format("{:.6f} 90.0 0.0 0.0 0.0 0.0 {:.6f} {:.6f} 0.0\n", step_cm * f, 0.5 * (f % 40), -0.25 * (f % 30));
  }
  return text;
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path.string());
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

const std::string& comma_locale_folder() {
  static const TemporaryFolder folder;
  static const std::string path = [] {
    const std::string locale = (folder / "de_DE.UTF-8").string();
    const std::string make = fmt::format("localedef -i de_DE -f UTF-8 '{}'", locale);
    if (std::system(make.c_str()) != 0) throw std::runtime_error(make + " failed; is the package locales installed?");
    return folder.path().string();
  }();
  return path;
}

}  // namespace kinespace::test
