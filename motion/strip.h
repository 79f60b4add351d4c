// A motion as one picture: stick figures of a clip at regular times, side by side, as SVG.
//
// What it shows: bones by straight lines (left limbs red, right limbs blue, the trunk grey), seen from the side or from
// the front without perspective, up is up; the floor; times in seconds; and, when asked for, plants under the feet, a
// second clip behind the first (before and after), and stretches of time that matter (a seam, a gap).
//
// Two layouts. Along the path every figure stands where it stood, so a planted foot is one spot; that wants travel, in
// one direction. In time the figures stand at equal distances with the travel of the root along the picture taken out.
// One clip and one set of options give one text, byte for byte. What it does not do: joints' orientations, depth.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "kinespace/motion/clip.h"

namespace kinespace {

enum class StripLayout : std::uint8_t {
  automatic,  // along the path where figures would stand at least 0.3 body heights apart, else in time
  path,
  time,
};

// For the time layout; a path is always seen from its side, and leads to the right.
enum class StripView : std::uint8_t {
  automatic,  // the one that shows more of the motion
  side,       // the body faces right
  front,      // the body faces the reader
};

// A time a joint is held at one place, e.g. a planted foot: a dot there, and in the time layout a bar under the axis.
struct StripMark {
  int joint = 0;
  int first_frame = 0;
  int last_frame = 0;  // included
  // World, cm; none: the mean of the joint's positions over the frames.
  std::optional<Eigen::Vector3d> position_cm = std::nullopt;
};

// A stretch of time to stand out, e.g. a seam: a coloured band behind the figures.
struct StripBand {
  int first_frame = 0;
  int last_frame = 0;  // included
  std::string label = {};
};

struct StripOptions {
  int figures = 12;     // 1 to 200; fewer when the clip has fewer frames
  int width_px = 1200;  // 300 to 10000
  int first_frame = 0;  // what of the clip is drawn,
  int last_frame = -1;  // included; -1: up to its end
  double floor_cm = 0;  // the height of the floor line; finite
  StripLayout layout = StripLayout::automatic;
  StripView view = StripView::automatic;
  std::string title = {};
  std::string clip_label = {};         // legend of the clip; shown beside a ghost
  const Clip* ghost = nullptr;         // another clip drawn in grey behind, at the same times; may be shorter, at
                                       // another rate and of another skeleton
  std::string ghost_label = "before";  // its legend
  std::vector<StripMark> marks = {};
  std::vector<StripBand> bands = {};

  // Throws Error{usage} naming field, value and legal range; frames and joints must be those of the clip.
  void validate(const Clip& clip) const;
};

// The picture as SVG text.
[[nodiscard]] std::string strip_svg(const Clip& clip, const StripOptions& options = {});

// The same into a file; it is whole or not there. Throws Error.
void write_strip(const std::filesystem::path& path, const Clip& clip, const StripOptions& options = {});

// Which side of the body a joint is on, by its name: left when the name with left for right ("Left", "L_", "_L", a
// leading "l") is another joint's of the skeleton; children go with their parents. One entry a joint.
enum class BodySide : std::uint8_t { middle, left, right };
[[nodiscard]] std::vector<BodySide> body_sides(const Skeleton& skeleton);

}  // namespace kinespace
