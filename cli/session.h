// What every subcommand shares: the global options, the progress display, the wish to stop, and notes to the user.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "cli/file_options.h"
#include "cli/progress_bar.h"
#include "kinespace/base/progress.h"
#include "kinespace/motion/clip.h"

namespace kinespace::cli {

// From here on Ctrl-C (SIGINT) and SIGTERM only leave a mark, which the work polls; the second one ends the process at
// once.
void catch_stop_signals();
class Session;
// And work that does not poll in time is ended: half a second after a signal, wherever it is, the files that it was
// about to put in their places are removed and the process ends as if it had polled. Until the session ends.
void end_when_stopped(const Session& session);
// For work that has nothing half-written to take back: from here on a signal ends the program at once, with the exit
// code and message that the work itself would end with.
void stop_at_once();
// The signal that came, 0 while none did.
[[nodiscard]] int stop_signal() noexcept;

class Session {
 public:
  bool quiet = false;    // no progress and no notes, only results, warnings and errors
  bool verbose = false;  // more notes

  FileOptions files;  // which options name files
  // What is told when a signal has stopped the work. May be asked by another thread while the work goes on.
  std::function<std::string()> when_stopped = [] { return "stopped; nothing half-written is left"; };

  Session() = default;
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // For the library's long calls: reports to the bar (unless quiet) and stops on a signal. It must not outlive the
  // session.
  [[nodiscard]] Progress progress();
  // The same without a bar, for work that is over soon as a rule.
  [[nodiscard]] static Progress stops();
  // Ends the bar, before results are printed.
  void finish_progress() { bar_.reset(); }

  // A line "kinespace: TEXT" on standard error: `warn` always, for a result that is not what it seems; `note` unless
  // quiet; `detail` only when verbose.
  void warn(std::string_view text);
  void note(std::string_view text);
  void detail(std::string_view text);

  // What a user should know before believing a result: warned of, or, when `strict`, an error before anything is written.
  void doubt_result(const std::vector<std::string>& doubts, bool strict);

  // Notes what in a clip that was read looks wrong (motion/plausibility.h): its unit, which way is up, its floor.
  void note_doubts(const Clip& clip);

  // Throws Interrupted when a stop was asked for. For between two calls that have no Progress of their own.
  static void check_stop();

 private:
  std::unique_ptr<ProgressBar> bar_;
};

}  // namespace kinespace::cli
