// Line plots as SVG, for the figures of the benches.
#pragma once

#include <string>
#include <vector>

namespace kinespace {

struct PlotSeries {
  struct Point {
    double x = 0;
    double y = 0;
  };
  std::string name;
  std::vector<Point>
      points;        // drawn in this order; points that an axis cannot show (<= 0 where logarithmic) are left out
  bool dots = true;  // at the points; curves of many points are better without
};

struct PlotAxis {
  std::string label;
  bool logarithmic = false;
};

struct Plot {
  std::string title;
  PlotAxis x;
  PlotAxis y;
  std::vector<PlotSeries> series;
};

// Equal plots give equal text.
[[nodiscard]] std::string to_svg(const Plot& plot);

}  // namespace kinespace
