// How far the work is, for whoever watches: a bar that redraws itself on a terminal; in a log file a plain line every
// few seconds, so that short work leaves none. Both go to standard error, so that results on standard output stay
// clean.
#pragma once

#include <chrono>
#include <cstdio>
#include <mutex>
#include <string>
#include <string_view>

namespace kinespace::cli {

class ProgressBar {
 public:
  using Clock = std::chrono::steady_clock;

  // The bar if the stream is a terminal, redrawn at most every 0.1 s; else lines, one every 2 s at most.
  explicit ProgressBar(std::FILE* out);
  // The form and the least time between two showings.
  ProgressBar(std::FILE* out, bool terminal, Clock::duration every);
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
  Clock::duration every_;
  std::mutex mutex_;
  std::string stage_;
  int percent_ = -1;
  bool open_line_ = false;
  Clock::time_point shown_ = Clock::now();
};

}  // namespace kinespace::cli
