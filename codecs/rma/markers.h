// Postures as points in space, and the way back to joint rotations: the compact virtual markers of lin2011, section 3
// (figure 2), after arikan 2006.
//
// In positions postures add up better than in angles, and a distance is what a viewer sees. Each rotating joint j at
// p_j with world rotation R_j carries two markers,
//
//   along   p_j + R_j a_j    a_j: where its child is (the farthest point that turns with it and no other rotation: a
//                            child, a child beyond joints without rotation). Where that is nearer than 2 cm, as is
//                            every end of a leaf, the same direction at 5 cm: the paper's marker b for short bones
//   across  p_j + R_j c_j    c_j: off the axis of a_j, so that the twist is kept: the child farthest off the axis, at
//                            least 5 cm off it
//
// behind the place of the root itself, all in the frame of alignment (root_alignment.h), in cm:
//
//   0 1 2       the root: what its alignment did not take out
//   3 + 6 j ..  along, then across of rotating joint j
//
// The way back goes from the root outwards: a joint stands where its parents put it, points exactly at its marker
// `along` and turns so that `across` lies on its side of it. Bone lengths come from the skeleton alone, so markers that
// bones cannot meet (decoded ones) are aimed at, and no error piles up along a limb. Short bones (below 22 cm, wholly
// below 10 cm) take their direction from where the markers have the joint: it would be lost in the joint's own error.
// Round trip: < 1e-6 rad, twist included. What it does not do: translations of joints other than the travel root (side
// tracks carry them).
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "kinespace/codecs/rma/root_alignment.h"
#include "kinespace/codecs/stream/pose_vectors.h"
#include "kinespace/motion/clip.h"
#include "kinespace/repeats/frame_table.h"

namespace kinespace {

// The markers of one skeleton.
class MarkerRig {
 public:
  explicit MarkerRig(const Skeleton& skeleton);

  [[nodiscard]] int joint_count() const { return static_cast<int>(bones_.size()); }
  [[nodiscard]] int dimensions() const { return 3 + 6 * joint_count(); }

  // What both ways need for one posture, kept by the caller from one to the next.
  struct Scratch {
    std::vector<Eigen::Matrix3d> turn;  // by rotating joint: how it is turned,
    std::vector<Eigen::Vector3d> at;    // where it is
  };

  // Markers of a posture: where the root is, its rotation and the local rotations of the other rotating joints
  // (Skeleton::rotating_joints()), in the frame of alignment. `own`: where the joints are, [joint][x y z], if wanted.
  void place(const Eigen::Vector3d& root, std::span<const Eigen::Quaterniond> rotations, Scratch& scratch,
             std::span<double> markers, std::span<double> own = {}) const;

  // The rotations that markers show, likewise. Same bits on every machine; markers that show none (all in one point)
  // leave the joint at rest. `own`, if given: where the markers have the joints; they then tell directions from there.
  void rotations(std::span<const double> markers, Scratch& scratch, std::span<Eigen::Quaterniond> rotations,
                 std::span<const double> own = {}) const;

 private:
  struct Bone {
    int parent = -1;  // rotating joint
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    Eigen::Vector3d along = Eigen::Vector3d::Zero();
    Eigen::Vector3d across = Eigen::Vector3d::Zero();
    double trust = 0;  // how much its direction is told from where the markers, not the bones, have the joint
    Eigen::Matrix3d back = Eigen::Matrix3d::Identity();  // from the bone's own axes to (along, across, both)
  };
  std::vector<Bone> bones_;
};

// Clips as the analysis wants them: pose vectors, how each is aligned, and the markers' rigs by skeleton.
struct AlignedClips {
  ReferencePose reference;
  std::vector<PoseVectors> vectors;  // by clip
  std::vector<int> degrees;          // by clip: 4 or 6
  std::vector<MarkerRig> rigs;
  std::vector<int> rig;  // by clip
  double rate_hz = 0;    // of the first clip
  std::vector<double> rates_hz;
};
// Throws Error{bad_input} for values that are no numbers, Error{usage} for clips of different trees.
[[nodiscard]] AlignedClips align_clips(std::span<const Clip> clips);

// The markers of frames [first, first + count) of one clip, [frame][dimension], in the frames that an alignment gives
// (that of the decoder, say). `with_joints`: behind them, in each frame, where the rotating joints are.
void clip_markers(const AlignedClips& clips, std::size_t clip, const RootAlignment& alignment, int first, int count,
                  double* out, bool with_joints = false);

// The markers of all clips, one after the other, aligned exactly.
[[nodiscard]] FrameTable marker_table(const AlignedClips& clips);
[[nodiscard]] FrameTable marker_table(std::span<const Clip> clips);

}  // namespace kinespace
