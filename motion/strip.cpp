#include "kinespace/motion/strip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/motion/detail/strip_body.h"
#include "kinespace/motion/kinematics.h"
#include "kinespace/motion/strip_svg.h"

namespace kinespace {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double margin_px = 24;
constexpr double header_px = 34;
constexpr double axis_px = 30;  // under the floor: time labels
constexpr double row_px = 14;   // under these: one row a marked joint
constexpr double tallest_figure_px = 190;
constexpr const char* ghost_colour = "#bdbdbd";
constexpr const char* text_colour = "#333333";

const char* colour_of(BodySide side) {
  constexpr std::array<const char*, 3> colours = {"#4a4a4a", "#d1495b", "#2e78ab"};
  return colours[static_cast<std::size_t>(side)];
}

Vector3d flat(const Vector3d& v) {
  return {v.x(), 0, v.z()};
}

struct Figure {
  int frame = 0;
  std::vector<Vector3d> points;
  std::vector<Vector3d> ghost;  // empty: the ghost has no such time
};

class Strip {
 public:
  Strip(const Clip& clip, const StripOptions& options)
      : clip_(clip), options_(options), body_(stick_body(clip.skeleton)), last_(last_frame(clip, options)) {
    if (options.ghost != nullptr) ghost_body_ = stick_body(options.ghost->skeleton);
    choose_figures();
    choose_view();
    choose_scale();
  }

  static int last_frame(const Clip& clip, const StripOptions& options) {
    return options.last_frame < 0 ? clip.frames - 1 : options.last_frame;
  }

  std::string draw() {
    const double height = base_px_ + axis_px + row_px * static_cast<double>(rows_.size());
    Svg svg(options_.width_px, height);
    draw_bands(svg);
    svg.line({margin_px / 2, floor_px_}, {options_.width_px - margin_px / 2, floor_px_}, "#9a9a9a", 1);
    for (const Figure& figure : figures_) {
      if (!figure.ghost.empty()) draw_body(svg, ghost_body_, figure.ghost, figure.frame, true);
    }
    if (along_path_) draw_plants(svg, nullptr);
    for (const Figure& figure : figures_) {
      draw_body(svg, body_, figure.points, figure.frame, false);
      if (!along_path_) draw_plants(svg, &figure);
    }
    draw_times(svg);
    draw_rows(svg);
    draw_header(svg);
    return std::move(svg).finish();
  }

 private:
  void choose_figures() {
    const int span = last_ - options_.first_frame;
    const int count = std::min(options_.figures, span + 1);
    for (int i = 0; i < count; ++i) {
      const double share = count > 1 ? static_cast<double>(i) / (count - 1) : 0.5;
      Figure figure{.frame = options_.first_frame + static_cast<int>(std::lround(share * span))};
      figure.points = stick_points(clip_, body_, figure.frame);
      if (options_.ghost != nullptr) {
        const auto frame = std::lround(figure.frame / clip_.rate_hz * options_.ghost->rate_hz);
        if (frame < options_.ghost->frames) {
          figure.ghost = stick_points(*options_.ghost, ghost_body_, static_cast<int>(frame));
        }
      }
      figures_.push_back(std::move(figure));
    }
  }

  [[nodiscard]] const Vector3d& root_at(const Figure& figure) const {
    return figure.points[static_cast<std::size_t>(body_.root)];
  }

  // From right to left through the body, by the joints that have sides; zero when none has or the body turns.
  [[nodiscard]] Vector3d lateral() const {
    Vector3d out = Vector3d::Zero();
    for (const Figure& figure : figures_) {
      for (std::size_t j = 0; j < body_.sides.size(); ++j) {
        const Vector3d across = flat(figure.points[j] - root_at(figure));
        if (body_.sides[j] == BodySide::left) out += across;
        if (body_.sides[j] == BodySide::right) out -= across;
      }
      if (out.norm() > 0.05 * body_.height) return out.normalized();
    }
    return Vector3d::Zero();
  }

  // How much the body moves along a direction, its travel apart.
  [[nodiscard]] double motion_along(const Vector3d& direction) const {
    const std::size_t joints = body_.sides.size();
    double out = 0;
    for (auto j = static_cast<std::size_t>(body_.root); j < joints; ++j) {
      double sum = 0;
      double squares = 0;
      for (const Figure& figure : figures_) {
        const double x = direction.dot(figure.points[j] - root_at(figure));
        sum += x;
        squares += x * x;
      }
      out += squares - sum * sum / static_cast<double>(figures_.size());
    }
    return out;
  }

  void choose_view() {
    const Vector3d travel = flat(root_at(figures_.back()) - root_at(figures_.front()));
    const double spacing = travel.norm() / std::max<double>(1, static_cast<double>(figures_.size()) - 1);
    along_path_ = options_.layout == StripLayout::path ||
                  (options_.layout == StripLayout::automatic && spacing >= 0.3 * body_.height);
    if (travel.norm() < 1e-6) along_path_ = false;
    if (along_path_) {
      right_ = travel.normalized();
      return;
    }
    Vector3d left = lateral();
    if (left.isZero()) left = Vector3d::UnitX();
    const Vector3d forward = left.cross(Vector3d::UnitY());
    const bool front = options_.view == StripView::front ||
                       (options_.view == StripView::automatic && motion_along(left) > motion_along(forward));
    right_ = front ? left : forward;
  }

  // Where the picture's middle of a frame is along right_, in cm; along a path there is one for all.
  [[nodiscard]] double origin_cm(int frame) const {
    if (along_path_) return 0;
    std::vector<JointFrame> frames;
    world_frames(clip_, frame, frames);
    return right_.dot(frames[static_cast<std::size_t>(body_.root)].position);
  }

  void choose_scale() {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    double top = options_.floor_cm + body_.height;
    double bottom = options_.floor_cm;
    for (const Figure& figure : figures_) {
      const double origin = origin_cm(figure.frame);
      // Joints above the travel root stand at the origin of the file, wherever the body is.
      for (const Vector3d& p : std::span(figure.points).subspan(static_cast<std::size_t>(body_.root))) {
        low = std::min(low, right_.dot(p) - origin);
        high = std::max(high, right_.dot(p) - origin);
        top = std::max(top, p.y());
        bottom = std::min(bottom, p.y());
      }
    }
    const double room = options_.width_px - 2 * margin_px;
    const double across = std::max(high - low, 0.1 * body_.height);
    pitch_px_ = room / static_cast<double>(figures_.size());
    scale_ = std::min((along_path_ ? room : 1.1 * pitch_px_) / across, tallest_figure_px / body_.height);
    // A body that climbs far above its own height must not make the picture endless.
    scale_ = std::min(scale_, 3 * tallest_figure_px / (top - bottom));
    if (along_path_) middle_cm_ = (low + high) / 2;
    list_rows();
    floor_px_ = margin_px + header_px + (top - options_.floor_cm) * scale_ + (options_.bands.empty() ? 4 : row_px);
    base_px_ = floor_px_ + (options_.floor_cm - bottom) * scale_;
  }

  void list_rows() {
    if (along_path_) return;
    for (const StripMark& mark : options_.marks) {
      if (std::ranges::find(rows_, mark.joint) == rows_.end()) rows_.push_back(mark.joint);
    }
  }

  // Time on the picture, in the time layout: figures stand in the middles of equal slots.
  [[nodiscard]] double time_px(double frame) const {
    const double span = std::max(1, figures_.back().frame - figures_.front().frame);
    const double slots = static_cast<double>(figures_.size()) - 1;
    return margin_px + pitch_px_ * (0.5 + slots * (frame - figures_.front().frame) / span);
  }

  [[nodiscard]] double middle_px(int frame) const { return along_path_ ? options_.width_px / 2.0 : time_px(frame); }
  [[nodiscard]] Vector2d on_picture(const Vector3d& p, double origin, double middle) const {
    return {middle + (right_.dot(p) - origin - middle_cm_) * scale_, floor_px_ - (p.y() - options_.floor_cm) * scale_};
  }
  [[nodiscard]] double frame_px(int frame) const {
    if (!along_path_) return time_px(frame);
    const Vector3d root = stick_points(clip_, body_, frame)[static_cast<std::size_t>(body_.root)];
    return on_picture(root, 0, middle_px(frame)).x();
  }

  void draw_body(Svg& svg, const StickBody& body, const std::vector<Vector3d>& points, int frame, bool ghost) const {
    const double origin = origin_cm(frame);
    const double middle = middle_px(frame);
    const Vector3d towards = right_.cross(Vector3d::UnitY());
    std::vector<StickBone> bones = body.bones;
    const auto depth = [&](const StickBone& bone) { return towards.dot(points[bone.from] + points[bone.to]); };
    std::ranges::stable_sort(bones, {}, depth);
    const double width = std::clamp(0.019 * body.height * scale_, 1.2, 3.2);
    for (const StickBone& bone : bones) {
      const Vector2d a = on_picture(points[bone.from], origin, middle);
      const Vector2d b = on_picture(points[bone.to], origin, middle);
      if ((a - b).norm() > 0.05) svg.line(a, b, ghost ? ghost_colour : colour_of(bone.side), width);
    }
    if (body.head < 0) return;
    const Vector3d& neck = points[static_cast<std::size_t>(body.head)];
    const Vector3d& crown = points[static_cast<std::size_t>(body.crown < 0 ? body.head : body.crown)];
    const char* colour = ghost ? ghost_colour : colour_of(BodySide::middle);
    svg.circle(on_picture((neck + crown) / 2, origin, middle), 0.05 * body.height * scale_, ghost ? "none" : "#ffffff",
               colour, width);
  }

  [[nodiscard]] Vector3d place_of(const StripMark& mark) const {
    if (mark.position_cm) return *mark.position_cm;
    Vector3d sum = Vector3d::Zero();
    std::vector<JointFrame> frames;
    for (int f = mark.first_frame; f <= mark.last_frame; ++f) {
      world_frames(clip_, f, frames);
      sum += frames[static_cast<std::size_t>(mark.joint)].position;
    }
    return sum / (mark.last_frame - mark.first_frame + 1);
  }

  // The plants of one figure; of the whole path without one.
  void draw_plants(Svg& svg, const Figure* figure) const {
    for (const StripMark& mark : options_.marks) {
      if (mark.last_frame < options_.first_frame || mark.first_frame > last_) continue;
      if (figure != nullptr && (figure->frame < mark.first_frame || figure->frame > mark.last_frame)) continue;
      const int frame = figure != nullptr ? figure->frame : mark.first_frame;
      const char* colour = colour_of(body_.sides[static_cast<std::size_t>(mark.joint)]);
      svg.circle(on_picture(place_of(mark), origin_cm(frame), middle_px(frame)), 4, "none", colour, 1.6);
    }
  }

  void draw_bands(Svg& svg) const {
    for (const StripBand& band : options_.bands) {
      const int first = std::max(band.first_frame, options_.first_frame);
      const int last = std::min(band.last_frame, last_);
      if (first > last) continue;
      const auto [low, high] = std::minmax({frame_px(first), frame_px(last)});
      const double top = margin_px + header_px - 8;
      svg.rectangle({low, top}, {high - low, floor_px_ - top}, "#fdf0c4");
      constexpr double character_px = 5.5;  // of the label's size, about
      if (character_px * static_cast<double>(band.label.size()) > high - low)
        continue;  // it would cover its neighbours
      svg.label({(low + high) / 2, top + 11}, band.label, "middle", 11, "#8a6d00");
    }
  }

  void draw_times(Svg& svg) const {
    double free = -1e9;
    for (const Figure& figure : figures_) {
      const double x = frame_px(figure.frame);
      if (std::abs(x - free) < 38) continue;
      free = x;
      svg.line({x, base_px_}, {x, base_px_ + 4}, "#9a9a9a", 1);
      svg.label({x, base_px_ + 17}, svg_number(figure.frame / clip_.rate_hz) + " s", "middle", 11, text_colour);
    }
  }

  // When each marked joint is held: bars over the axis of time.
  void draw_rows(Svg& svg) const {
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      const double y = base_px_ + axis_px + row_px * static_cast<double>(row);
      const auto joint = static_cast<std::size_t>(rows_[row]);
      const char* colour = colour_of(body_.sides[joint]);
      for (const StripMark& mark : options_.marks) {
        const int first = std::max(mark.first_frame, options_.first_frame);
        const int last = std::min(mark.last_frame, last_);
        if (mark.joint != rows_[row] || first > last) continue;
        svg.rectangle({time_px(first), y - 5}, {time_px(last) - time_px(first), 6}, colour);
      }
      svg.label({4, y}, clip_.skeleton.joints[joint].name, "start", 9, colour);
    }
  }

  void draw_header(Svg& svg) const {
    svg.label({margin_px, margin_px}, options_.title, "start", 15, text_colour);
    double x = options_.width_px - margin_px;
    const auto entry = [&](std::string_view words, std::string_view colour, bool dot) {
      if (words.empty()) return;
      const double length = 6.2 * static_cast<double>(words.size()) + 10;
      svg.label({x, margin_px}, words, "end", 11, text_colour);
      x -= length;
      if (dot) {
        svg.circle({x - 4, margin_px - 4}, 4, "none", colour, 1.6);
      } else {
        svg.line({x - 16, margin_px - 4}, {x, margin_px - 4}, colour, 3);
      }
      x -= 30;
    };
    if (!options_.marks.empty()) entry("planted", text_colour, true);
    if (options_.ghost != nullptr) entry(options_.ghost_label, ghost_colour, false);
    if (options_.ghost != nullptr) entry(options_.clip_label, text_colour, false);
    if (std::ranges::find(body_.sides, BodySide::left) == body_.sides.end()) return;
    entry("right", colour_of(BodySide::right), false);
    entry("left", colour_of(BodySide::left), false);
  }

  const Clip& clip_;
  const StripOptions& options_;
  StickBody body_;
  StickBody ghost_body_;
  int last_;
  std::vector<Figure> figures_;
  bool along_path_ = false;
  Vector3d right_ = Vector3d::UnitX();  // across the picture
  double scale_ = 1;                    // pixels a cm
  double pitch_px_ = 0;
  double middle_cm_ = 0;  // along a path: what stands in the picture's middle
  double floor_px_ = 0;
  double base_px_ = 0;  // below every figure: the times hang from here
  std::vector<int> rows_;
};

[[noreturn]] void refuse(const std::string& field, const std::string& found, const std::string& expected) {
  throw Error(ErrorKind::usage, {.found = "StripOptions." + field + " = " + found, .expected = expected});
}

void require_range(const std::string& field, std::int64_t value, std::int64_t low, std::int64_t high) {
  if (value >= low && value <= high) return;
  refuse(field, std::to_string(value), std::to_string(low) + " to " + std::to_string(high));
}

}  // namespace

void StripOptions::validate(const Clip& clip) const {
  require_range("figures", figures, 1, 200);
  require_range("width_px", width_px, 300, 10000);
  const int end = clip.frames - 1;
  require_range("first_frame", first_frame, 0, end);
  if (last_frame != -1) require_range("last_frame", last_frame, first_frame, end);
  if (!std::isfinite(floor_cm)) refuse("floor_cm", "no number", "a height in cm");
  for (const StripMark& mark : marks) {
    require_range("marks.joint", mark.joint, 0, clip.skeleton.joint_count() - 1);
    require_range("marks.first_frame", mark.first_frame, 0, end);
    require_range("marks.last_frame", mark.last_frame, mark.first_frame, end);
  }
  for (const StripBand& band : bands) {
    require_range("bands.first_frame", band.first_frame, 0, end);
    require_range("bands.last_frame", band.last_frame, band.first_frame, end);
  }
}

std::string strip_svg(const Clip& clip, const StripOptions& options) {
  options.validate(clip);
  return Strip(clip, options).draw();
}

void write_strip(const std::filesystem::path& path, const Clip& clip, const StripOptions& options) {
  write_file_atomically(path, strip_svg(clip, options));
}

}  // namespace kinespace
