// Pictures as SVG text: lines, circles, rectangles, labels and images. For the library's own pictures.
//
// Coordinates are pixels, x to the right, y down, written with two decimals, so that equal pictures are equal texts.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace kinespace {

// With at most two decimals.
[[nodiscard]] std::string svg_number(double value);

class Svg {
 public:
  using Point = Eigen::Vector2d;

  Svg(double width, double height);  // white
  void line(const Point& a, const Point& b, std::string_view colour, double width);
  void polyline(const std::vector<Point>& points, std::string_view colour, double width);
  void circle(const Point& middle, double radius, std::string_view fill, std::string_view stroke, double width);
  void rectangle(const Point& corner, const Point& size, std::string_view fill);
  // `anchor`: start, middle or end. What XML cannot hold (control characters, bytes that are not UTF-8) becomes '?'.
  void label(const Point& at, std::string_view words, std::string_view anchor, double size, std::string_view colour);
  // A PNG file, stretched over the rectangle.
  void image(const Point& corner, const Point& size, std::string_view png);
  [[nodiscard]] std::string finish() &&;

 private:
  std::string text_;
};

}  // namespace kinespace
