#include "cli/session.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include "cli/output.h"
#include "kinespace/motion/plausibility.h"

namespace kinespace::cli {
namespace {

namespace fs = std::filesystem;

// A signal handler can reach nothing but a global. Lock-free, so that the handler may write it.
std::atomic<int> caught_signal{0};
static_assert(std::atomic<int>::is_always_lock_free);

// The ends of a pipe through which it wakes whoever waits for a signal; -1: no one.
std::atomic<int> wake_reader{-1};
std::atomic<int> wake_writer{-1};

void remember(int signal) {
  caught_signal.store(signal, std::memory_order_relaxed);
  const int before = errno;
  const int writer = wake_writer.load(std::memory_order_relaxed);
  if (writer >= 0) static_cast<void>(::write(writer, "s", 1) == 1);
  errno = before;
}

// The session that is to be ended with its work; null once it has ended by itself.
std::mutex watched_mutex;
const Session* watched_session = nullptr;

// What this process was about to put in its place, at or below where an output is to go.
void remove_own_temporaries(const FileOption& output) {
  const std::string prefix = fmt::format(".kinespace-{}-", ::getpid());
  std::error_code ignored;
  const auto remove_from = [&](auto&& folder) {
    for (const fs::directory_entry& entry : folder) {
      if (entry.path().filename().string().starts_with(prefix)) fs::remove_all(entry.path(), ignored);
    }
  };
  for (const std::string& name : output.option->results()) {
    const fs::path path = fs::weakly_canonical(name, ignored);
    if (fs::is_directory(path, ignored)) {
      remove_from(fs::recursive_directory_iterator(path, fs::directory_options::skip_permission_denied, ignored));
    }
    remove_from(fs::directory_iterator(path.parent_path(), ignored));
  }
}

void end_process(const Session& session) noexcept {
  try {
    const std::string told = session.when_stopped();
    for (const FileOption& file : session.files.all()) {
      if (file.role != FileOption::Role::read && file.command->parsed()) remove_own_temporaries(file);
    }
    tell(told);
  } catch (const std::exception&) {  // no memory: then without a word
  }
  ::_exit(128 + stop_signal());
}

// The work of the thread that waits for a signal.
void* watch(void* /*unused*/) {
  constexpr auto time_to_end_by_itself = std::chrono::milliseconds(500);
  char mark = 0;
  while (::read(wake_reader, &mark, 1) < 0 && errno == EINTR) {
  }
  std::this_thread::sleep_for(time_to_end_by_itself);
  const std::scoped_lock lock(watched_mutex);
  if (watched_session != nullptr) end_process(*watched_session);
  return nullptr;
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

void end_when_stopped(const Session& session) {
  {
    const std::scoped_lock lock(watched_mutex);
    watched_session = &session;
  }
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return;  // then what polls ends, as it does
  wake_reader = ends[0];
  // It has little to do: a usual stack would be too much where address space is short.
  pthread_attr_t attributes;
  pthread_t thread{};
  if (::pthread_attr_init(&attributes) != 0) return;
  ::pthread_attr_setstacksize(&attributes, std::size_t{256} << 10);
  ::pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
  if (::pthread_create(&thread, &attributes, watch, nullptr) == 0) wake_writer = ends[1];
  ::pthread_attr_destroy(&attributes);
  if (stop_signal() != 0) remember(stop_signal());  // it came in between
}

Session::~Session() {
  const std::scoped_lock lock(watched_mutex);
  if (watched_session != this) return;
  watched_session = nullptr;
  stop_at_once();  // what is left to do is leave
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

Progress Session::stops() {
  Progress progress;
  progress.stop_requested = [] { return stop_signal() != 0; };
  return progress;
}

Progress Session::progress() {
  Progress progress = stops();
  if (!quiet) {
    bar_ = std::make_unique<ProgressBar>(stderr);
    progress.report = [this](std::string_view stage, double done) {
      if (bar_) bar_->show(stage, done);
    };
  }
  return progress;
}

void Session::warn(std::string_view text) {
  finish_progress();
  tell(text);
}

void Session::doubt_result(const std::vector<std::string>& doubts, bool strict) {
  for (const std::string& doubt : doubts) {
    if (strict) {
      throw Error(ErrorKind::bad_input,
                  {.found = doubt, .expected = "a result no worse than its input", .remedy = "leave --strict out"});
    }
    warn(doubt);
  }
}

void Session::note(std::string_view text) {
  if (!quiet) warn(text);
}

void Session::detail(std::string_view text) {
  if (verbose) note(text);
}

void Session::note_doubts(const Clip& clip) {
  for (const Doubt& doubt : doubts_about(clip)) note(clip.name + ": " + doubt.text);
}

void Session::check_stop() {
  if (stop_signal() != 0) throw Interrupted{};
}

}  // namespace kinespace::cli
