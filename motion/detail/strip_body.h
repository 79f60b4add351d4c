// What of a skeleton a picture of it shows: bones with their sides, and a head. Private to this folder.
#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

#include "kinespace/motion/clip.h"
#include "kinespace/motion/strip.h"

namespace kinespace {

struct StickBone {
  int from = 0, to = 0;  // points
  BodySide side = BodySide::middle;
};

// What of a skeleton is drawn. Points are the joints, then the end sites.
struct StickBody {
  std::vector<StickBone> bones;
  std::vector<std::pair<int, Eigen::Vector3d>> ends;  // joint, offset
  std::vector<BodySide> sides;
  int root = 0;
  int head = -1, crown = -1;  // the head joint and its end, when they are known
  double height = 1;          // cm, > 0
};

[[nodiscard]] StickBody stick_body(const Skeleton& skeleton);

// World positions of the points at a frame, cm.
[[nodiscard]] std::vector<Eigen::Vector3d> stick_points(const Clip& clip, const StickBody& body, int frame);

}  // namespace kinespace
