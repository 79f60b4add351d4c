// The `kinespace` command: turns what the library throws into one line on standard error and an exit code.
//
//   0 done   1 the input is bad   2 usage   3 the machine could not   128 + N stopped by signal N (Ctrl-C: 130)
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <string_view>
#include <system_error>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/session.h"
#include "cli/user_words.h"
#include "kinespace/base/error.h"
#include "kinespace/base/progress.h"

namespace {

using kinespace::ErrorKind;

constexpr const char* description =
    "Motion capture in function space: build a motion space from clips, find the nearest motions, play any clip at "
    "any\n"
    "level of detail, convert and compare clips.";

constexpr std::string_view no_memory = "out of memory; close other programs or work on fewer clips at once";

int report(ErrorKind kind, std::string_view message) {
  kinespace::cli::tell(message);
  return static_cast<int>(kind);
}

// Memory that runs out ends the process where it does: some of the libraries below do not survive an exception there
// (functions that promised not to throw, objects left half-made). Nothing is half-written: outputs are put in place
// whole, and their temporaries go with the next run.
[[noreturn]] void end_without_memory() {
  ::_exit(report(ErrorKind::machine, no_memory));
}

// The command line up to the subcommand, for "try ... --help".
std::string help_command(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return chosen.empty() ? "kinespace --help" : fmt::format("kinespace {} --help", chosen.front()->get_name());
}

// What the file system refused, by who can mend it: a path that leads nowhere is the user's.
int report_system_error(const std::system_error& error, const std::string& path) {
  constexpr std::array paths_fault = {ENOENT, ENOTDIR, ELOOP, ENAMETOOLONG, EACCES, EPERM, EISDIR, EEXIST};
  const bool users = !path.empty() && std::ranges::find(paths_fault, error.code().value()) != paths_fault.end();
  const std::string where = path.empty() ? "the machine, or the working folder" : path;
  return report(users ? ErrorKind::bad_input : ErrorKind::machine,
                kinespace::format_error({.file = where, .found = error.code().message()}));
}

int run(CLI::App& app, const kinespace::cli::Session& session, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return EXIT_SUCCESS;
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    if (const auto mistyped = kinespace::cli::mistyped_subcommand(app, argc, argv)) {
      return report(ErrorKind::usage, *mistyped);
    }
    return report(ErrorKind::usage, fmt::format("{}; try '{}'", error.what(), help_command(app)));
  } catch (const kinespace::Error& error) {
    return report(error.kind(), kinespace::cli::in_users_words(app, error));
  } catch (const kinespace::Interrupted&) {
    kinespace::cli::tell(session.when_stopped());
    return 128 + kinespace::cli::stop_signal();
  } catch (const std::bad_alloc&) {
    return report(ErrorKind::machine, no_memory);
  } catch (const std::filesystem::filesystem_error& error) {
    return report_system_error(error, error.path1().string());
  } catch (const std::system_error& error) {  // no more threads, say
    return report_system_error(error, {});
  } catch (const std::exception& error) {
    return report(ErrorKind::machine, fmt::format("unexpected error, please report it: {}", error.what()));
  }
}

// OpenBLAS starts its threads, which we never use, when it is loaded; each takes 128 MiB of address space and where a
// limit leaves none asks again without end, so that even exit waits for ever. Under a limit the command starts again
// with the one thing that OpenBLAS listens to. What cannot be started again goes on as it is.
void start_again_with_one_blas_thread(char** argv) {
  constexpr const char* variable = "OPENBLAS_NUM_THREADS";
  struct rlimit limit {};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY || std::getenv(variable) != nullptr)
    return;
  if (::setenv(variable, "1", 1) == 0) ::execv("/proc/self/exe", argv);
}

// A result that did not reach its reader is no result: a full disk behind `> file` must not pass as success.
int flush_results(int code) {
  if (kinespace::cli::finish_output()) return code;
  return report(ErrorKind::machine, "cannot write to standard output; is the disk full?");
}

}  // namespace

int main(int argc, char** argv) {
  start_again_with_one_blas_thread(argv);
  std::set_new_handler(end_without_memory);
  try {
    kinespace::cli::open_standard_descriptors();
    kinespace::cli::Session session;
    kinespace::cli::catch_stop_signals();
    CLI::App app{description, "kinespace"};
    app.set_version_flag("--version", "kinespace " KINESPACE_VERSION);
    app.add_flag("-q,--quiet", session.quiet, "No progress and no notes, only results, warnings and errors");
    app.add_flag("-v,--verbose", session.verbose, "More notes on what is done");
    app.require_subcommand(1);
    app.fallthrough();  // global options may also stand after the subcommand
    kinespace::cli::add_all_commands(app, session);
    kinespace::cli::end_when_stopped(session);
    const int code = run(app, session, argc, argv);
    session.finish_progress();
    return flush_results(code);
  } catch (const std::bad_alloc&) {
    return report(ErrorKind::machine, no_memory);
  } catch (const std::exception& error) {
    return report(ErrorKind::machine, fmt::format("unexpected error, please report it: {}", error.what()));
  }
}
