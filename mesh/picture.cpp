#include "kinespace/mesh/picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/base/png.h"
#include "kinespace/mesh/mesh_error.h"

namespace kinespace {
namespace {

using Colour = Eigen::Vector3d;  // 0 to 1

const Colour paper(1, 1, 1);
const Colour clay(0.72, 0.72, 0.75);

// Blue, white, red.
Colour error_colour(double share) {
  const Colour blue(0.15, 0.25, 0.85), white(0.93, 0.93, 0.93), red(0.85, 0.1, 0.1);
  const double t = std::clamp(share, 0.0, 1.0);
  return t < 0.5 ? Colour(blue + (white - blue) * (2 * t)) : Colour(white + (red - white) * (2 * t - 1));
}

void paint(std::uint8_t* pixel, const Colour& colour) {
  for (int c = 0; c < 3; ++c) pixel[c] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(colour[c], 0.0, 1.0)));
}

// From the mesh's space to pixels, z towards the viewer in pixels too.
class Camera {
 public:
  Camera(const Points& frame_of, int width, int height, const PictureOptions& options) {
    constexpr double degree = std::numbers::pi / 180;
    turn_ = (Eigen::AngleAxisd(options.tilt_degrees * degree, Eigen::Vector3d::UnitX()) *
             Eigen::AngleAxisd(options.turn_degrees * degree, Eigen::Vector3d::UnitY()))
                .toRotationMatrix();
    const Points seen = frame_of * turn_.transpose();
    const Eigen::RowVector3d low = seen.colwise().minCoeff(), high = seen.colwise().maxCoeff();
    middle_ = (low + high).transpose() / 2;
    const double w = std::max(high[0] - low[0], 1e-30), h = std::max(high[1] - low[1], 1e-30);
    scale_ = 0.9 * std::min(width / w, height / h);
    centre_ = {width / 2.0, height / 2.0, 0};
  }

  [[nodiscard]] Points project(const Points& points) const {
    Points out = ((points * turn_.transpose()).rowwise() - middle_.transpose()) * scale_;
    out.col(1) = -out.col(1);
    return out.rowwise() + centre_.transpose();
  }

 private:
  Eigen::Matrix3d turn_;
  Eigen::Vector3d middle_, centre_;
  double scale_ = 1;
};

Points vertex_normals(const Points& points, std::span<const Triangle> triangles) {
  Points out = Points::Zero(points.rows(), 3);
  for (const Triangle& t : triangles) {
    const Eigen::Vector3d a = points.row(t[0]), b = points.row(t[1]), c = points.row(t[2]);
    const Eigen::RowVector3d n = (b - a).cross(c - a).transpose();
    for (const std::int32_t v : t) out.row(v) += n;
  }
  for (Eigen::Index v = 0; v < out.rows(); ++v) {
    const double length = out.row(v).norm();
    if (length > 0) out.row(v) /= length;
  }
  return out;
}

// A triangle at a time, pixel by pixel, the nearest wins.
class Canvas {
 public:
  Canvas(int width, int height)
      : picture_{width, height,
                 std::vector<std::uint8_t>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3)},
        depth_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
               -std::numeric_limits<double>::infinity()) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) paint(picture_.at(x, y), paper);
    }
  }

  struct Corner {
    Eigen::Vector3d at, normal;
    Colour colour;
  };
  void triangle(const std::array<Corner, 3>& t) {
    const auto cross = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double x, double y) {
      return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
    };
    const double area = cross(t[0].at, t[1].at, t[2].at[0], t[2].at[1]);
    if (!(std::abs(area) > 1e-12)) return;
    const auto [low_x, high_x] = range(t, 0, picture_.width);
    const auto [low_y, high_y] = range(t, 1, picture_.height);
    for (int y = low_y; y <= high_y; ++y) {
      for (int x = low_x; x <= high_x; ++x) {
        const double px = x + 0.5, py = y + 0.5;
        const double a = cross(t[1].at, t[2].at, px, py) / area, b = cross(t[2].at, t[0].at, px, py) / area;
        const double c = 1 - a - b;
        if (a < 0 || b < 0 || c < 0) continue;
        const double z = a * t[0].at[2] + b * t[1].at[2] + c * t[2].at[2];
        double& nearest = depth_[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture_.width) +
                                 static_cast<std::size_t>(x)];
        if (z <= nearest) continue;
        nearest = z;
        const Eigen::Vector3d normal = a * t[0].normal + b * t[1].normal + c * t[2].normal;
        const Colour colour = a * t[0].colour + b * t[1].colour + c * t[2].colour;
        paint(picture_.at(x, y), colour * light(normal));
      }
    }
  }

  Picture take() && { return std::move(picture_); }

 private:
  // Pixels are counted from the top, so y of the normals looks down.
  static double light(const Eigen::Vector3d& normal) {
    const double length = normal.norm();
    if (!(length > 0)) return 0.5;
    const Eigen::Vector3d from = Eigen::Vector3d(-0.4, -0.6, 1).normalized();
    return 0.3 + 0.75 * std::abs(normal.dot(from)) / length;
  }

  static std::pair<int, int> range(const std::array<Corner, 3>& t, int axis, int size) {
    const double low = std::min({t[0].at[axis], t[1].at[axis], t[2].at[axis]});
    const double high = std::max({t[0].at[axis], t[1].at[axis], t[2].at[axis]});
    return {static_cast<int>(std::clamp(std::floor(low), 0.0, static_cast<double>(size))),
            static_cast<int>(std::clamp(std::floor(high), -1.0, size - 1.0))};
  }

  Picture picture_;
  std::vector<double> depth_;
};

// Smooth edges: every pixel is the mean of 2 x 2.
Picture halved(const Picture& large) {
  Picture out{large.width / 2, large.height / 2, {}};
  out.pixels.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height) * 3);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const int sum = large.at(2 * x, 2 * y)[c] + large.at(2 * x + 1, 2 * y)[c] + large.at(2 * x, 2 * y + 1)[c] +
                        large.at(2 * x + 1, 2 * y + 1)[c];
        out.at(x, y)[c] = static_cast<std::uint8_t>((sum + 2) / 4);
      }
    }
  }
  return out;
}

void copy_into(Picture& to, const Picture& from, int left) {
  for (int y = 0; y < from.height; ++y) {
    std::copy_n(from.at(0, y), static_cast<std::size_t>(from.width) * 3, to.at(left, y));
  }
}

double percentile_99(std::vector<double> values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

void PictureOptions::validate() const {
  const auto fail = [](const char* field, double value, const char* range) {
    throw Error(ErrorKind::usage, {.found = fmt::format("{} = {}", field, value), .expected = range});
  };
  if (panel_width < 16 || panel_width > 8192) fail("panel_width", panel_width, "16 to 8192");
  if (panel_height < 16 || panel_height > 8192) fail("panel_height", panel_height, "16 to 8192");
  if (!(std::abs(turn_degrees) <= 360)) fail("turn_degrees", turn_degrees, "-360 to 360");
  if (!(std::abs(tilt_degrees) <= 90)) fail("tilt_degrees", tilt_degrees, "-90 to 90");
  if (worst && !(*worst > 0 && std::isfinite(*worst))) fail("worst", *worst, "above 0");
}

Picture draw_mesh(const Points& points, std::span<const Triangle> triangles, const Points& frame_of,
                  std::span<const double> colour_by, double worst, const PictureOptions& options) {
  options.validate();
  const int width = 2 * options.panel_width, height = 2 * options.panel_height;
  const Points at = Camera(frame_of, width, height, options).project(points);
  const Points normals = vertex_normals(at, triangles);
  const auto corner = [&](std::int32_t v) {
    const double share = colour_by.empty() ? 0 : worst > 0 ? colour_by[static_cast<std::size_t>(v)] / worst : 0;
    return Canvas::Corner{at.row(v), normals.row(v), colour_by.empty() ? clay : error_colour(share)};
  };
  Canvas canvas(width, height);
  for (const Triangle& t : triangles) canvas.triangle({corner(t[0]), corner(t[1]), corner(t[2])});
  return halved(std::move(canvas).take());
}

ComparisonPicture draw_comparison(const MeshSequence& original, const MeshSequence& decoded, int frame,
                                  PictureError error, const PictureOptions& options) {
  if (frame < 0 || frame >= original.frames) {
    throw Error(ErrorKind::usage,
                {.found = fmt::format("frame {}", frame), .expected = fmt::format("0 to {}", original.frames - 1)});
  }
  const std::vector<double> errors = error == PictureError::distance ? vertex_errors(original, decoded, frame)
                                                                     : vertex_rigidity_errors(original, decoded, frame);
  ComparisonPicture out;
  out.worst = options.worst.value_or(percentile_99(errors));
  const Points a = frame_points(original, frame), b = frame_points(decoded, frame);
  constexpr int bar = 24;
  out.picture = {3 * options.panel_width + bar, options.panel_height, {}};
  out.picture.pixels.resize(static_cast<std::size_t>(out.picture.width) * static_cast<std::size_t>(out.picture.height) *
                            3);
  copy_into(out.picture, draw_mesh(a, original.triangles, a, {}, 1, options), 0);
  copy_into(out.picture, draw_mesh(b, original.triangles, a, {}, 1, options), options.panel_width);
  copy_into(out.picture, draw_mesh(b, original.triangles, a, errors, out.worst, options), 2 * options.panel_width);
  for (int y = 0; y < options.panel_height; ++y) {
    const Colour colour = error_colour(1 - (y + 0.5) / options.panel_height);
    for (int x = 0; x < bar; ++x) paint(out.picture.at(3 * options.panel_width + x, y), x < 4 ? paper : colour);
  }
  return out;
}

std::string format_png(const Picture& picture) {
  return format_png(picture.width, picture.height, picture.pixels);
}

void write_png(const std::filesystem::path& path, const Picture& picture) {
  write_file_atomically(path, format_png(picture));
}

}  // namespace kinespace
