#include "kinespace/fpca/registration_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/motion/strip_svg.h"

namespace kinespace {
namespace {

using Point = Svg::Point;

constexpr double wide = 960, left_margin = 56, right_margin = 24, curves_top = 84, curves_height = 220;
constexpr double overlay_top = 386, overlay_height = 200, overlay_gap = 64;
constexpr int overlay_points = 101;
constexpr std::array curve_colours{"#0072b2", "#d55e00", "#009e73"};  // told apart by the colour-blind too
constexpr const char* ink = "#333333";
constexpr const char* component_names = "wxyz";

// The curve of a joint's rotation that moves most within the sequences that can be laid over each other (all, where
// there are no whole cycles), and the next ones, of other joints.
std::vector<int> most_moving(const ClipCurves& curves, const std::vector<PicturedSequence>& sequences,
                             std::size_t count) {
  const bool cyclic = std::ranges::any_of(sequences, [](const PicturedSequence& s) { return s.cycles > 0; });
  std::vector<std::pair<double, int>> by_movement;
  for (Eigen::Index c = 3; c < curves.values.cols(); ++c) {
    double movement = 0;
    for (const PicturedSequence& s : sequences) {
      if (cyclic && s.cycles == 0) continue;
      const Eigen::VectorXd part = curves.values.col(c).segment(s.first, s.last - s.first + 1);
      movement += (part.array() - part.mean()).square().sum();
    }
    by_movement.emplace_back(-movement, static_cast<int>(c));
  }
  std::ranges::sort(by_movement);
  std::vector<int> out;
  for (const auto& [movement, c] : by_movement) {
    const bool joint_is_there = std::ranges::any_of(out, [c](int other) { return (other - 3) / 4 == (c - 3) / 4; });
    if (!joint_is_there && out.size() < count) out.push_back(c);
  }
  return out;
}

std::string curve_name(const Skeleton& skeleton, int curve) {
  const int joint = curve_layout(skeleton).joints[static_cast<std::size_t>((curve - 3) / 4)];
  return fmt::format("{} {}", skeleton.joints[static_cast<std::size_t>(joint)].name,
                     component_names[static_cast<std::size_t>((curve - 3) % 4)]);
}

// Values to pixels of a panel, which the range fills.
struct Scale {
  Scale(double low, double high, double top, double height)
      : low_(low), per_value_(height / std::max(high - low, 1e-9)), bottom_(top + height) {}
  [[nodiscard]] double y(double value) const { return bottom_ - (value - low_) * per_value_; }

 private:
  double low_;
  double per_value_;
  double bottom_;
};

// A curve from one frame to another, at `overlay_points` times.
Eigen::VectorXd stretch(const Eigen::VectorXd& curve, double from, double to) {
  Eigen::VectorXd out(overlay_points);
  const auto last = static_cast<double>(curve.size() - 1);
  for (int i = 0; i < overlay_points; ++i) {
    const double x = std::clamp(from + (to - from) * i / (overlay_points - 1), 0.0, last);
    const auto at = std::min(static_cast<Eigen::Index>(x), std::max<Eigen::Index>(0, curve.size() - 2));
    const double part = x - static_cast<double>(at);
    out(i) = part > 0 ? (1 - part) * curve(at) + part * curve(at + 1) : curve(at);
  }
  return out;
}

using Stretches = std::vector<Eigen::VectorXd>;

double spread(const Stretches& stretches) {
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(overlay_points);
  for (const Eigen::VectorXd& s : stretches) mean += s / static_cast<double>(stretches.size());
  double square = 0;
  for (const Eigen::VectorXd& s : stretches) square += (s - mean).squaredNorm();
  return std::sqrt(square / (overlay_points * static_cast<double>(stretches.size())));
}

class RegistrationPicture {
 public:
  RegistrationPicture(const ClipCurves& curves, const Skeleton& skeleton,
                      const std::vector<PicturedSequence>& sequences)
      : curves_(curves),
        skeleton_(skeleton),
        sequences_(sequences),
        svg_(wide, 640),
        shown_(most_moving(curves, sequences, 3)) {
    for (const PicturedSequence& s : sequences) {
      cycles_ += s.cycles;
      if (s.cycles > 0) cyclic_frames_ += s.last - s.first;
    }
    draw_head();
    draw_sequences();
    draw_time_axis();
    for (std::size_t i = 0; i < shown_.size(); ++i) draw_curve(shown_[i], curve_colours[i]);
    draw_overlays();
  }
  std::string finish() && { return std::move(svg_).finish(); }

 private:
  [[nodiscard]] double seconds() const { return (curves_.frames() - 1) / curves_.rate_hz; }
  [[nodiscard]] double x_of(double frame) const {
    return left_margin + (wide - left_margin - right_margin) * frame / std::max(1, curves_.frames() - 1);
  }

  void draw_head() {
    const std::string cycles = cycles_ == 0
                                   ? "no whole cycles found"
                                   : fmt::format("{} whole cycle{} of {:.2f} s, {:.0f} % of its time", cycles_,
                                                 cycles_ == 1 ? "" : "s", cyclic_frames_ / curves_.rate_hz / cycles_,
                                                 100.0 * cyclic_frames_ / std::max(1, curves_.frames() - 1));
    svg_.label({left_margin, 28}, fmt::format("{}: {}", curves_.name, cycles), "start", 17, "#111111");
    double x = left_margin;
    const auto entry = [&](const char* colour, const std::string& words) {
      svg_.rectangle({x, 44}, {14, 14}, colour);
      svg_.label({x + 20, 56}, words, "start", 13, ink);
      x += 44 + 7.5 * static_cast<double>(words.size());
    };
    entry("#cfe3f3", "sequence of whole cycles");
    entry("#e4e4e4", "cut at rests");
    for (std::size_t i = 0; i < shown_.size(); ++i) entry(curve_colours[i], curve_name(skeleton_, shown_[i]));
  }

  void draw_sequences() {
    bool dark = false;
    for (const PicturedSequence& s : sequences_) {
      dark = !dark;
      const char* colour = s.cycles > 0 ? (dark ? "#cfe3f3" : "#b5d3ea") : (dark ? "#e4e4e4" : "#f0f0f0");
      svg_.rectangle({x_of(s.first), curves_top}, {x_of(s.last) - x_of(s.first), curves_height}, colour);
      for (int k = 1; k < s.cycles; ++k) {
        const double x = x_of(s.first + static_cast<double>(k) * (s.last - s.first) / s.cycles);
        svg_.line({x, curves_top}, {x, curves_top + curves_height}, "#7aa7c7", 1);
      }
    }
  }

  void draw_time_axis() {
    double step = 0.1;
    for (const double next : {0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0}) {
      if (seconds() / step > 14) step = next;
    }
    const double y = curves_top + curves_height;
    for (int k = 0; k * step <= seconds(); ++k) {
      const double x = x_of(k * step * curves_.rate_hz);
      svg_.line({x, y}, {x, y + 5}, ink, 1);
      svg_.label({x, y + 19}, fmt::format("{:.6g}", k * step), "middle", 12, ink);
    }
    svg_.label({wide - right_margin, y + 36}, "time, s", "end", 12, ink);
  }

  // Each fills the panel by itself: curves of different joints have nothing else in common.
  void draw_curve(int curve, const char* colour) {
    const Eigen::VectorXd values = curves_.values.col(curve);
    const Scale scale(values.minCoeff(), values.maxCoeff(), curves_top + 8, curves_height - 16);
    const int step = std::max(1, curves_.frames() / 2000);
    std::vector<Point> points;
    for (int f = 0; f < curves_.frames(); f += step) points.emplace_back(x_of(f), scale.y(values(f)));
    svg_.polyline(points, colour, 1.4);
  }

  void draw_overlays() {
    if (cycles_ < 2 || shown_.empty()) {
      svg_.label({left_margin, overlay_top}, "Fewer than two whole cycles: there is nothing to lay over each other.",
                 "start", 14, ink);
      return;
    }
    const Eigen::VectorXd curve = curves_.values.col(shown_.front());
    Stretches before;
    Stretches after;
    const double window = static_cast<double>(curves_.frames() - 1) / cycles_;
    for (int k = 0; k < cycles_; ++k) before.push_back(stretch(curve, k * window, (k + 1) * window));
    for (const PicturedSequence& s : sequences_) {
      const double cycle = s.cycles > 0 ? static_cast<double>(s.last - s.first) / s.cycles : 0;
      for (int k = 0; k < s.cycles; ++k)
        after.push_back(stretch(curve, s.first + k * cycle, s.first + (k + 1) * cycle));
    }
    const Scale scale(curve.minCoeff(), curve.maxCoeff(), overlay_top + 8, overlay_height - 16);
    const double width = (wide - left_margin - right_margin - overlay_gap) / 2;
    draw_overlay(before, scale, left_margin, width,
                 fmt::format("before: {} equal windows of {:.2f} s", cycles_, window / curves_.rate_hz));
    draw_overlay(after, scale, left_margin + width + overlay_gap, width,
                 fmt::format("after: {} whole cycles, time linear in each", cycles_));
  }

  void draw_overlay(const Stretches& stretches, const Scale& scale, double left, double width,
                    const std::string& title) {
    svg_.rectangle({left, overlay_top}, {width, overlay_height}, "#f7f7f7");
    svg_.label({left, overlay_top - 10}, title, "start", 14, ink);
    constexpr std::size_t most_drawn = 200;  // evenly chosen
    const std::size_t step = (stretches.size() + most_drawn - 1) / most_drawn;
    for (std::size_t k = 0; k < stretches.size(); k += step) {
      const Eigen::VectorXd& s = stretches[k];
      std::vector<Point> points;
      for (int i = 0; i < overlay_points; ++i) {
        points.emplace_back(left + width * i / (overlay_points - 1), scale.y(s(i)));
      }
      svg_.polyline(points, curve_colours[0], 0.8);
    }
    svg_.label(
        {left, overlay_top + overlay_height + 20},
        fmt::format("{}, {:.3f} from their mean (rms)", curve_name(skeleton_, shown_.front()), spread(stretches)),
        "start", 13, ink);
    svg_.label({left + width, overlay_top + overlay_height + 20}, "phase, 0 to 1", "end", 12, ink);
  }

  const ClipCurves& curves_;
  const Skeleton& skeleton_;
  const std::vector<PicturedSequence>& sequences_;
  Svg svg_;
  std::vector<int> shown_;
  int cycles_ = 0;
  int cyclic_frames_ = 0;
};

}  // namespace

std::vector<PicturedSequence> pictured(const EncodedClip& clip) {
  std::vector<PicturedSequence> out;
  for (const EncodedRun& run : clip.runs) {
    for (const EncodedSequence& s : run.sequences) out.push_back({s.first, s.last, s.cycles});
  }
  return out;
}

std::vector<PicturedSequence> pictured(const std::vector<Run>& runs) {
  std::vector<PicturedSequence> out;
  for (const Run& run : runs) {
    for (int i = 0; i < run.sequence_count(); ++i) {
      out.push_back({run.first_frame(i), run.last_frame(i), run.cycles_of(i)});
    }
  }
  return out;
}

std::string registration_picture_svg(const ClipCurves& curves, const Skeleton& skeleton,
                                     const std::vector<PicturedSequence>& sequences) {
  return RegistrationPicture(curves, skeleton, sequences).finish();
}

}  // namespace kinespace
