#include "kinespace/motion/strip_svg.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "kinespace/motion/text.h"

namespace kinespace {
namespace {

// Text for XML: control characters and bytes that are not UTF-8 (any above ASCII that do not form a sequence) go.
std::string escaped(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const std::size_t more = c >= 0xF0 && c < 0xF5 ? 3 : c >= 0xE0 && c < 0xF0 ? 2 : c >= 0xC2 && c < 0xE0 ? 1 : 0;
    bool sequence = more > 0 && i + more < text.size();
    for (std::size_t k = 1; sequence && k <= more; ++k) {
      sequence = (static_cast<unsigned char>(text[i + k]) & 0xC0U) == 0x80U;
    }
    if (sequence) {
      out += text.substr(i, more + 1);
      i += more;
    } else if (c == '<' || c == '>' || c == '&' || c == '"') {
      out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : "&quot;";
    } else {
      out += c < 0x20 || c >= 0x7F ? '?' : static_cast<char>(c);
    }
  }
  return out;
}

// Appends ` name="value"`.
void attribute(std::string& out, std::string_view name, std::string_view value) {
  out += ' ';
  out += name;
  out += "=\"";
  out += value;
  out += '"';
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8U | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) out += k <= count ? digits[group >> (18 - 6 * k) & 63U] : '=';
  }
  return out;
}

void attribute(std::string& out, std::string_view name, double value) {
  attribute(out, name, svg_number(value));
}

}  // namespace

std::string svg_number(double value) {
  std::string out;
  append_fixed(out, std::round(value * 100) / 100);
  return out;
}

Svg::Svg(double width, double height) : text_("<svg xmlns=\"http://www.w3.org/2000/svg\"") {
  attribute(text_, "width", width);
  attribute(text_, "height", height);
  std::string box = "0 0 ";
  box.append(svg_number(width)).append(" ").append(svg_number(height));
  attribute(text_, "viewBox", box);
  attribute(text_, "font-family", "Helvetica, Arial, 'DejaVu Sans', sans-serif");
  text_ += ">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n";
}

void Svg::polyline(const std::vector<Point>& points, std::string_view colour, double width) {
  text_ += "<polyline points=\"";
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i > 0) text_ += ' ';
    text_ += svg_number(points[i].x()) + ',' + svg_number(points[i].y());
  }
  text_ += "\" fill=\"none\"";
  attribute(text_, "stroke", colour);
  attribute(text_, "stroke-width", width);
  text_ += " stroke-linejoin=\"round\"/>\n";
}

void Svg::line(const Point& a, const Point& b, std::string_view colour, double width) {
  text_ += "<line";
  attribute(text_, "x1", a.x());
  attribute(text_, "y1", a.y());
  attribute(text_, "x2", b.x());
  attribute(text_, "y2", b.y());
  attribute(text_, "stroke", colour);
  attribute(text_, "stroke-width", width);
  text_ += " stroke-linecap=\"round\"/>\n";
}

void Svg::circle(const Point& middle, double radius, std::string_view fill, std::string_view stroke, double width) {
  text_ += "<circle";
  attribute(text_, "cx", middle.x());
  attribute(text_, "cy", middle.y());
  attribute(text_, "r", radius);
  attribute(text_, "fill", fill);
  attribute(text_, "stroke", stroke);
  attribute(text_, "stroke-width", width);
  text_ += "/>\n";
}

void Svg::rectangle(const Point& corner, const Point& size, std::string_view fill) {
  text_ += "<rect";
  attribute(text_, "x", corner.x());
  attribute(text_, "y", corner.y());
  attribute(text_, "width", size.x());
  attribute(text_, "height", size.y());
  attribute(text_, "rx", 2);
  attribute(text_, "fill", fill);
  text_ += "/>\n";
}

void Svg::label(const Point& at, std::string_view words, std::string_view anchor, double size,
                std::string_view colour) {
  text_ += "<text";
  attribute(text_, "x", at.x());
  attribute(text_, "y", at.y());
  attribute(text_, "font-size", size);
  attribute(text_, "text-anchor", anchor);
  attribute(text_, "fill", colour);
  text_.append(">").append(escaped(words)).append("</text>\n");
}

void Svg::image(const Point& corner, const Point& size, std::string_view png) {
  text_ += "<image";
  attribute(text_, "x", corner.x());
  attribute(text_, "y", corner.y());
  attribute(text_, "width", size.x());
  attribute(text_, "height", size.y());
  attribute(text_, "style", "image-rendering:pixelated");
  attribute(text_, "href", "data:image/png;base64," + base64(png));
  text_ += "/>\n";
}

std::string Svg::finish() && {
  text_ += "</svg>\n";
  return std::move(text_);
}

}  // namespace kinespace
