#include "cli/progress_bar.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <unistd.h>

#include "cli/output.h"

namespace kinespace::cli {
namespace {

constexpr int bar_width = 30;
constexpr std::chrono::milliseconds redraw_every{100};
constexpr std::chrono::seconds log_every{2};

bool is_terminal(std::FILE* stream) {
  return ::isatty(::fileno(stream)) == 1;
}

int to_percent(double done) {
  if (!(done > 0)) return 0;  // also NaN
  return static_cast<int>(std::floor(100 * std::min(done, 1.0)));
}

}  // namespace

ProgressBar::ProgressBar(std::FILE* out)
    : ProgressBar(out, is_terminal(out),
                  is_terminal(out) ? Clock::duration(redraw_every) : Clock::duration(log_every)) {}

ProgressBar::ProgressBar(std::FILE* out, bool terminal, Clock::duration every)
    : out_(out), terminal_(terminal), every_(every) {}

ProgressBar::~ProgressBar() {
  if (open_line_) write_text(out_, "\n");
}

void ProgressBar::show(std::string_view stage, double done) {
  const std::scoped_lock lock(mutex_);
  const int percent = to_percent(done);
  const bool new_stage = stage != stage_;
  if (!new_stage && percent <= percent_) return;
  // A bar shows every stage from its beginning to its end; a log only what takes long.
  const bool always = terminal_ && (new_stage || percent == 100);
  const auto now = Clock::now();
  if (!always && now - shown_ < every_) return;
  terminal_ ? draw_bar(stage, percent) : draw_line(stage, percent);
  shown_ = now;
  stage_ = stage;
  percent_ = percent;
}

void ProgressBar::draw_bar(std::string_view stage, int percent) {
  if (open_line_ && stage != stage_) write_text(out_, "\n");
  const int filled = percent * bar_width / 100;
  write_text(out_, fmt::format("\r{:<24} [{:#<{}}{:.<{}}] {:3} %", stage, "", filled, "", bar_width - filled, percent));
  std::fflush(out_);
  open_line_ = true;
}

void ProgressBar::draw_line(std::string_view stage, int percent) {
  write_text(out_, fmt::format("kinespace: {} {} %\n", stage, percent));
  std::fflush(out_);
}

}  // namespace kinespace::cli
