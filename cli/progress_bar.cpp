#include "cli/progress_bar.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <unistd.h>

namespace kinespace::cli {
namespace {

constexpr int bar_width = 30;
constexpr int log_step_percent = 10;
constexpr std::chrono::milliseconds redraw_every{100};

int to_percent(double done) {
  if (!(done > 0)) return 0;  // also NaN
  return static_cast<int>(std::floor(100 * std::min(done, 1.0)));
}

}  // namespace

ProgressBar::ProgressBar(std::FILE* out) : ProgressBar(out, ::isatty(::fileno(out)) == 1) {}

ProgressBar::ProgressBar(std::FILE* out, bool terminal) : out_(out), terminal_(terminal) {}

ProgressBar::~ProgressBar() {
  if (open_line_) std::fputc('\n', out_);
}

void ProgressBar::show(std::string_view stage, double done) {
  const std::scoped_lock lock(mutex_);
  const int percent = to_percent(done);
  const bool new_stage = stage != stage_;
  if (!new_stage && percent <= percent_) return;
  if (terminal_) {
    const auto now = std::chrono::steady_clock::now();
    if (!new_stage && percent < 100 && now - drawn_ < redraw_every) return;
    drawn_ = now;
    draw_bar(stage, percent);
  } else {
    if (!new_stage && percent < 100 && percent / log_step_percent == percent_ / log_step_percent) return;
    draw_line(stage, percent);
  }
  stage_ = stage;
  percent_ = percent;
}

void ProgressBar::draw_bar(std::string_view stage, int percent) {
  if (open_line_ && stage != stage_) fmt::print(out_, "\n");
  const int filled = percent * bar_width / 100;
  fmt::print(out_, "\r{:<24} [{:#<{}}{:.<{}}] {:3} %", stage, "", filled, "", bar_width - filled, percent);
  std::fflush(out_);
  open_line_ = true;
}

void ProgressBar::draw_line(std::string_view stage, int percent) {
  fmt::print(out_, "kinespace: {} {} %\n", stage, percent);
  std::fflush(out_);
}

}  // namespace kinespace::cli
