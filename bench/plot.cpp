#include "bench/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include "kinespace/motion/strip_svg.h"

namespace kinespace {
namespace {

constexpr double width = 760;
constexpr double height = 460;
constexpr double left = 70;
constexpr double right = 150;  // where the names stand
constexpr double top = 40;
constexpr double bottom = 55;

// Distinct for colour-blind eyes too (okabe and ito).
constexpr std::array<std::string_view, 9> colours{"#000000", "#d55e00", "#0072b2", "#009e73", "#cc79a7",
                                                  "#e69f00", "#56b4e9", "#8c564b", "#7f7f7f"};

// One axis: from values to pixels.
class Scale {
 public:
  Scale(const PlotAxis& axis, double first_pixel, double last_pixel)
      : logarithmic_(axis.logarithmic), first_(first_pixel), last_(last_pixel) {}

  [[nodiscard]] bool shows(double value) const { return std::isfinite(value) && (!logarithmic_ || value > 0); }
  void include(double value) {
    if (!shows(value)) return;
    low_ = std::min(low_, on_axis(value));
    high_ = std::max(high_, on_axis(value));
  }
  void settle() {
    if (!(low_ <= high_)) low_ = 0, high_ = 1;
    const double margin = std::max(0.04 * (high_ - low_), 1e-3);
    low_ -= margin;
    high_ += margin;
  }
  [[nodiscard]] double pixel(double value) const {
    return first_ + (on_axis(value) - low_) / (high_ - low_) * (last_ - first_);
  }
  [[nodiscard]] std::vector<double> ticks() const {
    std::vector<double> out;
    if (logarithmic_) {
      const bool few = high_ - low_ > 3;
      for (int e = static_cast<int>(std::floor(low_)); e <= static_cast<int>(std::ceil(high_)); ++e) {
        for (const int digit : {1, 2, 5}) {
          const double at = digit * std::pow(10.0, e);
          if (inside(at) && (digit == 1 || !few)) out.push_back(at);
        }
      }
      return out;
    }
    const double rough = (high_ - low_) / 6;
    const double power = std::pow(10.0, std::floor(std::log10(rough)));
    const double step = power * (rough / power > 5 ? 10 : rough / power > 2 ? 5 : rough / power > 1 ? 2 : 1);
    for (double at = std::ceil(low_ / step) * step; at <= high_; at += step)
      out.push_back(std::abs(at) < 1e-12 ? 0 : at);
    return out;
  }

 private:
  [[nodiscard]] double on_axis(double value) const { return logarithmic_ ? std::log10(value) : value; }
  [[nodiscard]] bool inside(double value) const { return on_axis(value) >= low_ && on_axis(value) <= high_; }

  bool logarithmic_;
  double first_;
  double last_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

void draw_axes(const Plot& plot, const Scale& x, const Scale& y, Svg& svg) {
  constexpr std::string_view grid = "#e4e4e4";
  constexpr std::string_view ink = "#333333";
  const double floor = height - bottom;
  for (const double tick : x.ticks()) {
    svg.line({x.pixel(tick), top}, {x.pixel(tick), floor}, grid, 1);
    svg.label({x.pixel(tick), floor + 18}, fmt::format("{:.3g}", tick), "middle", 12, ink);
  }
  for (const double tick : y.ticks()) {
    svg.line({left, y.pixel(tick)}, {width - right, y.pixel(tick)}, grid, 1);
    svg.label({left - 8, y.pixel(tick) + 4}, fmt::format("{:.3g}", tick), "end", 12, ink);
  }
  svg.line({left, floor}, {width - right, floor}, ink, 1);
  svg.line({left, top}, {left, floor}, ink, 1);
  svg.label({(left + width - right) / 2, height - 14}, plot.x.label, "middle", 13, ink);
  svg.label({left - 55, top - 8}, plot.y.label, "start", 13, ink);
  svg.label({(left + width - right) / 2, 18}, plot.title, "middle", 14, ink);
}

}  // namespace

std::string to_svg(const Plot& plot) {
  Scale x(plot.x, left, width - right);
  Scale y(plot.y, height - bottom, top);
  for (const PlotSeries& series : plot.series) {
    for (const auto& point : series.points) {
      if (!x.shows(point.x) || !y.shows(point.y)) continue;
      x.include(point.x);
      y.include(point.y);
    }
  }
  x.settle();
  y.settle();
  Svg svg(width, height);
  draw_axes(plot, x, y, svg);
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    const std::string_view colour = colours[s % colours.size()];
    const PlotSeries::Point* before = nullptr;
    for (const auto& point : plot.series[s].points) {
      if (!x.shows(point.x) || !y.shows(point.y)) continue;
      const Svg::Point at(x.pixel(point.x), y.pixel(point.y));
      if (before != nullptr) svg.line({x.pixel(before->x), y.pixel(before->y)}, at, colour, 1.8);
      if (plot.series[s].dots) svg.circle(at, 2.6, colour, colour, 1);
      before = &point;
    }
    const double row = top + 10 + 20 * static_cast<double>(s);
    svg.line({width - right + 15, row - 4}, {width - right + 40, row - 4}, colour, 2.5);
    svg.label({width - right + 46, row}, plot.series[s].name, "start", 12, "#333333");
  }
  return std::move(svg).finish();
}

}  // namespace kinespace
