#include "kinespace/repeats/repeat_picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "kinespace/motion/strip_svg.h"
#include "kinespace/repeats/detail/option_range.h"
#include "kinespace/repeats/detail/table_image.h"
#include "kinespace/repeats/detail/table_parts.h"

namespace kinespace {
namespace {

using Point = Svg::Point;

constexpr double margin = 70, bar = 14, gap = 4, head = 66, foot = 30;
constexpr Colour path_colour{240, 140, 30}, reference_colour{20, 160, 70}, diagonal_colour{255, 255, 255};

const char* colour_of(RepeatClip::Kind kind) {
  switch (kind) {
    case RepeatClip::Kind::primary:
      return "#2b62c4";
    case RepeatClip::Kind::repeated:
      return "#2aa55a";
    case RepeatClip::Kind::unique:
      break;
  }
  return "#e58bb1";
}

int largest_group(const FrameTable& table, const RepeatAnalysis& analysis) {
  int best = 0;
  std::int64_t most = -1;
  for (int group = 0; group < analysis.grouping.groups; ++group) {
    std::int64_t frames = 0;
    for (const FrameSpan& range : analysis.grouping.ranges(group, table)) frames += range.frames();
    if (frames > most) best = group;
    most = std::max(most, frames);
  }
  return best;
}

// The picture of one table; pixels of the table stand for frames.
class RepeatPicture {
 public:
  RepeatPicture(const FrameTable& table, const RepeatAnalysis& analysis, const RepeatOptions& options, int group,
                const TablePart& part, int size)
      : rate_hz_(table.rate_hz),
        group_(group),
        analysis_(analysis),
        distances_(analysis.spaces[static_cast<std::size_t>(group)], table, part.ranges, part.stride),
        image_(distances_, size),
        svg_(margin + image_.size() + foot, head + margin + image_.size() + foot) {
    draw_marks(find_posture_paths(distances_, options.paths));
    svg_.image(corner(), Point(image_.size(), image_.size()), image_.png());
    draw_bars();
    draw_axis();
    draw_head();
  }
  std::string finish() && { return std::move(svg_).finish(); }

 private:
  [[nodiscard]] static Point corner() { return {margin, head + margin}; }

  // The pixel of a frame, between pixels too; negative when the table has not got it.
  [[nodiscard]] double pixel_of(std::int64_t frame) const {
    for (int run = 0; run < distances_.run_count(); ++run) {
      const FrameSpan range = distances_.run_frames(run);
      if (frame < range.first || frame >= range.last) continue;
      return distances_.run_first_pixel(run) + static_cast<double>(frame - range.first) / distances_.stride();
    }
    return -1;
  }

  void draw_marks(const std::vector<PosturePath>& paths) {
    const int width = std::max(1, image_.size() / 450);
    for (const PosturePath& path : paths) {
      for (const PathPoint& point : path.points) image_.mark(point.i, point.j, path_colour, width);
    }
    for (const RepeatClip& clip : analysis_.clips) {
      if (clip.group != group_) continue;
      for (std::size_t f = 0; f < clip.reference.size(); ++f) {
        const double a = pixel_of(clip.first + static_cast<std::int64_t>(f)), b = pixel_of(clip.reference[f]);
        if (a >= 0 && b >= 0) image_.mark(std::min(a, b), std::max(a, b), reference_colour, width + 1);
      }
    }
    for (int p = 0; p < distances_.size(); ++p) image_.mark(p, p, diagonal_colour, width);
  }

  void draw_bars() {
    for (const RepeatClip& clip : analysis_.clips) {
      const double first = clip.group == group_ ? pixel_of(clip.first) : -1;
      if (first < 0) continue;
      const double begin = image_.place(first);
      const double length =
          image_.place(static_cast<double>(clip.frames()) / distances_.stride()) - (image_.size() > 400 ? 0.8 : 0.4);
      svg_.rectangle(corner() + Point(begin, -bar - gap), Point(std::max(length, 0.4), bar), colour_of(clip.kind));
      svg_.rectangle(corner() + Point(-bar - gap, begin), Point(bar, std::max(length, 0.4)), colour_of(clip.kind));
    }
  }

  void draw_axis() {
    const double seconds = distances_.size() / distances_.pixel_rate_hz();
    double step = 0.1;
    for (const double next : {0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0}) {
      if (seconds / step > 12) step = next;
    }
    for (int k = 0; k * step <= seconds; ++k) {
      const double at = image_.place(k * step * distances_.pixel_rate_hz());
      const std::string words = fmt::format("{:.6g}", k * step);
      svg_.line(corner() + Point(at, -bar - gap - 7), corner() + Point(at, -bar - gap - 2), "#444444", 1);
      svg_.label(corner() + Point(at, -bar - gap - 11), words, "middle", 12, "#444444");
      svg_.line(corner() + Point(-bar - gap - 7, at), corner() + Point(-bar - gap - 2, at), "#444444", 1);
      svg_.label(corner() + Point(-bar - gap - 11, at + 4), words, "end", 12, "#444444");
    }
    svg_.label(corner() + Point(image_.size(), -bar - gap - 26), "s", "end", 12, "#444444");
  }

  void draw_head() {
    std::int64_t frames = 0, repeated = 0;
    int primaries = 0;
    for (const RepeatClip& clip : analysis_.clips) {
      if (clip.group != group_) continue;
      frames += clip.frames();
      if (clip.kind == RepeatClip::Kind::repeated) repeated += clip.frames();
      if (clip.kind == RepeatClip::Kind::primary) ++primaries;
    }
    svg_.label(
        Point(margin, 28),
        fmt::format("Group {} of {}: {:.1f} s, {} primary clips, {:.0f} % of the frames repeated", group_ + 1,
                    analysis_.grouping.groups, static_cast<double>(frames) / rate_hz_, primaries,
                    100.0 * static_cast<double>(repeated) / static_cast<double>(std::max<std::int64_t>(frames, 1))),
        "start", 17, "#111111");
    struct Entry {
      const char* colour;
      const char* words;
    };
    double x = margin;
    for (const Entry& entry : {Entry{"#2b62c4", "primary"}, Entry{"#2aa55a", "repeated"}, Entry{"#e58bb1", "unique"},
                               Entry{"#f08c1e", "similar-posture path"}, Entry{"#14a046", "reference"}}) {
      svg_.rectangle(Point(x, 44), Point(14, 14), entry.colour);
      svg_.label(Point(x + 20, 56), entry.words, "start", 13, "#333333");
      x += 44 + 7.5 * static_cast<double>(std::string_view(entry.words).size());
    }
  }

  double rate_hz_;
  int group_;
  const RepeatAnalysis& analysis_;
  SelfDistance distances_;
  TableImage image_;
  Svg svg_;
};

}  // namespace

void RepeatPictureOptions::validate() const {
  require_option("group", group, -1, 1e6);
  require_option("size_px", size_px, 200, 4000);
}

std::string repeat_picture_svg(const FrameTable& table, const RepeatAnalysis& analysis, const RepeatOptions& options,
                               const RepeatPictureOptions& picture) {
  picture.validate();
  table.validate();
  const std::int64_t covered = analysis.clips.empty() ? 0 : analysis.clips.back().last;
  if (covered != table.frames || picture.group >= analysis.grouping.groups) {
    throw Error(ErrorKind::usage,
                {.found = fmt::format("group {} of an analysis of {} frames in {} groups", picture.group, covered,
                                      analysis.grouping.groups),
                 .expected = fmt::format("a group of the analysis of these {} frames", table.frames)});
  }
  const int group = picture.group >= 0 ? picture.group : largest_group(table, analysis);
  const auto parts = table_parts(analysis.grouping.ranges(group, table), table, options);
  return RepeatPicture(table, analysis, options, group, parts.front(), picture.size_px).finish();
}

}  // namespace kinespace
