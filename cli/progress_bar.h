// How far the work is, for whoever watches: a bar that redraws itself on a terminal, a plain line per stage and tenth
// in a log file. Both go to standard error, so that results on standard output stay clean.
#pragma once

#include <chrono>
#include <cstdio>
#include <mutex>
#include <string>
#include <string_view>

namespace kinespace::cli {

class ProgressBar {
 public:
  // `terminal` decides between the two forms; the default asks the stream.
  explicit ProgressBar(std::FILE* out);
  ProgressBar(std::FILE* out, bool terminal);
  // Ends the bar's line, so that what is printed next starts on a line of its own.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // `done` in [0, 1]; values outside are clamped. Safe to call from several threads.
  void show(std::string_view stage, double done);

 private:
  void draw_bar(std::string_view stage, int percent);
  void draw_line(std::string_view stage, int percent);

  std::FILE* out_;
  bool terminal_;
  std::mutex mutex_;
  std::string stage_;
  int percent_ = -1;
  bool open_line_ = false;
  std::chrono::steady_clock::time_point drawn_;
};

}  // namespace kinespace::cli
