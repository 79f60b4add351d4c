// The curves of a clip (yoo2019, section 5.1): the travel of the root and one unit quaternion per rotating joint.
//
// The clip is turned about the vertical so that its first frame has heading 0 and starts at the origin; where it stood
// and looked is kept beside the curves (Placement). What the curves do not carry - joints above the travel root, and
// translations of other joints - is kept as side tracks, so that the way back gives the whole clip.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "kinespace/base/bytes.h"
#include "kinespace/motion/clip.h"
#include "kinespace/motion/uniform_spline.h"

namespace kinespace {

// Which curve is which: 0, 1, 2 the root's travel along X, Y, Z; then w, x, y, z of each rotating joint, the root
// first.
struct CurveLayout {
  std::vector<int> joints;  // Skeleton::rotating_joints()

  [[nodiscard]] int joint_count() const { return static_cast<int>(joints.size()); }
  [[nodiscard]] int curve_count() const { return 3 + 4 * joint_count(); }
  // The seven components of the paper: 0..2 velocity, 3..6 quaternion w x y z.
  [[nodiscard]] static int component(int curve) { return curve < 3 ? curve : 3 + (curve - 3) % 4; }
};
[[nodiscard]] CurveLayout curve_layout(const Skeleton& skeleton);

// Where a clip stood and looked at its first frame.
struct Placement {
  Eigen::Vector3d start_cm = Eigen::Vector3d::Zero();  // world position of the travel root
  double heading_rad = 0;                              // turn about +Y from heading 0
};

// A piecewise linear track of something the curves do not carry, in its parent's frame.
struct SideTrack {
  int joint = 0;
  int dimensions = 3;          // 3: translation in cm; 4: rotation w x y z
  std::vector<int> frames;     // knots, ascending, first 0 and last frames - 1
  std::vector<double> values;  // [knot][dimension]
};

struct ClipCurves {
  std::string name;
  double rate_hz = 0;
  Placement placement;
  // [frame][curve]: columns 0..2 the root's position in metres from the start, in the turned frame; then the
  // quaternions, continuous in time (no sign flips within the clip).
  SampleMatrix values;
  std::vector<SideTrack> side_tracks;

  [[nodiscard]] int frames() const { return static_cast<int>(values.rows()); }
};

// Side tracks keep to these: 1e-4 cm for translations, 1e-7 for quaternions.
[[nodiscard]] ClipCurves clip_curves(const Clip& clip);
// The same of a clip that is needed no more: its rotations, most of a long one, go as its curves come.
[[nodiscard]] ClipCurves clip_curves(Clip&& clip);

// The way back; quaternions are renormalised. `skeleton` must be that of the clip (or one of the same tree: the motion
// on other bones).
[[nodiscard]] Clip clip_from_curves(const ClipCurves& curves, const Skeleton& skeleton);
// A part of it, from frame `first` on: `rows` stand for the values of those frames, all else is that of `curves`.
[[nodiscard]] Clip clip_of_frames(const ClipCurves& curves, const Eigen::Ref<const SampleMatrix>& rows, int first,
                                  const Skeleton& skeleton);

// Those of a clip alone: joints above the root, then translations, as clip_curves has them.
[[nodiscard]] std::vector<SideTrack> side_tracks_of(const Clip& clip);

// Puts a side track onto a clip that holds the frames from `first` on of the clip that it was made for.
void apply_side_track(const SideTrack& track, int first, Clip& clip);

// The heading of an orientation: the angle of its twist about +Y (swing-twist), in (-pi, pi]; 0 where it has none.
[[nodiscard]] double heading_of(const Eigen::Quaterniond& q);

// Side tracks as bytes for storage, and back (throws Error{bad_input} naming `source`).
[[nodiscard]] Bytes pack_side_tracks(const std::vector<SideTrack>& tracks);
[[nodiscard]] std::vector<SideTrack> unpack_side_tracks(std::span<const std::byte> bytes, int frames,
                                                        const Skeleton& skeleton, const std::string& source);

}  // namespace kinespace
