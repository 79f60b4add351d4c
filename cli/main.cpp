// The `kinespace` command: turns what the library throws into one line on standard error and an exit code.
//
//   0 done   1 the input is bad   2 usage   3 the machine could not   128 + N stopped by signal N (Ctrl-C: 130)
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/error.h"
#include "base/progress.h"
#include "cli/commands.h"
#include "cli/session.h"

namespace {

using kinespace::ErrorKind;

constexpr const char* description =
    "Motion capture in function space: build a motion space from clips, find the nearest motions, play any clip at "
    "any\n"
    "level of detail, convert and compare clips.";

int report(ErrorKind kind, const std::string& message) {
  fmt::print(stderr, "kinespace: {}\n", message);
  return static_cast<int>(kind);
}

// The command line up to the subcommand, for "try ... --help".
std::string help_command(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return chosen.empty() ? "kinespace --help" : fmt::format("kinespace {} --help", chosen.front()->get_name());
}

int run(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return EXIT_SUCCESS;
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    return report(ErrorKind::usage, fmt::format("{}; try '{}'", error.what(), help_command(app)));
  } catch (const kinespace::Error& error) {
    return report(error.kind(), error.what());
  } catch (const kinespace::Interrupted&) {
    const int signal = kinespace::cli::stop_signal();
    fmt::print(stderr, "kinespace: stopped; nothing half-written is left\n");
    return 128 + signal;
  } catch (const std::bad_alloc&) {
    return report(ErrorKind::machine, "out of memory; close other programs or work on fewer clips at once");
  } catch (const std::exception& error) {
    return report(ErrorKind::machine, fmt::format("unexpected error, please report it: {}", error.what()));
  }
}

// A result that did not reach its reader is no result: a full disk behind `> file` must not pass as success.
int flush_results(int code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  return report(ErrorKind::machine, "cannot write to standard output; is the disk full?");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    kinespace::cli::Session session;
    kinespace::cli::catch_stop_signals();
    CLI::App app{description, "kinespace"};
    app.set_version_flag("--version", "kinespace " KINESPACE_VERSION);
    app.add_flag("-q,--quiet", session.quiet, "No progress and no notes, only results and errors");
    app.add_flag("-v,--verbose", session.verbose, "More notes on what is done");
    app.require_subcommand(1);
    app.fallthrough();  // global options may also stand after the subcommand
    kinespace::cli::add_all_commands(app, session);
    const int code = run(app, argc, argv);
    session.finish_progress();
    return flush_results(code);
  } catch (const std::exception& error) {
    return report(ErrorKind::machine, fmt::format("unexpected error, please report it: {}", error.what()));
  }
}
