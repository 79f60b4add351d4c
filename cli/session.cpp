#include "cli/session.h"

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <system_error>

#include <unistd.h>

#include "cli/output.h"

namespace kinespace::cli {
namespace {

// A signal handler can reach nothing but a global. Lock-free, so that the handler may write it.
std::atomic<int> caught_signal{0};
static_assert(std::atomic<int>::is_always_lock_free);

void remember(int signal) {
  caught_signal.store(signal, std::memory_order_relaxed);
}

// Only what a signal handler may call.
void leave(int signal) {
  constexpr std::string_view text = "kinespace: stopped; nothing half-written is left\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text.data(), text.size());
  ::_exit(128 + signal);
}

}  // namespace

void catch_stop_signals() {
  ::signal(SIGXFSZ, SIG_IGN);  // a limit on file sizes is then an error like a full disk
  struct sigaction action {};
  action.sa_handler = remember;
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction inherited {};
    const bool known = ::sigaction(signal, nullptr, &inherited) == 0;
    if (known && inherited.sa_handler == SIG_IGN) continue;  // whoever started us (nohup, a shell's &) wants it ignored
    if (!known || ::sigaction(signal, &action, nullptr) != 0) {
      throw std::system_error(errno, std::generic_category(), "sigaction");
    }
  }
}

void stop_at_once() {
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction present {};
    if (::sigaction(signal, nullptr, &present) == 0 && present.sa_handler == remember) ::signal(signal, leave);
  }
}

int stop_signal() noexcept {
  return caught_signal.load(std::memory_order_relaxed);
}

Progress Session::progress() {
  Progress progress;
  progress.stop_requested = [] { return stop_signal() != 0; };
  if (!quiet) {
    bar_ = std::make_unique<ProgressBar>(stderr);
    progress.report = [this](std::string_view stage, double done) {
      if (bar_) bar_->show(stage, done);
    };
  }
  return progress;
}

void Session::note(std::string_view text) {
  finish_progress();
  if (!quiet) tell(text);
}

void Session::detail(std::string_view text) {
  if (verbose) note(text);
}

void Session::check_stop() {
  if (stop_signal() != 0) throw Interrupted{};
}

}  // namespace kinespace::cli
