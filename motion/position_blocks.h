// World positions of a long clip, some frames at a time: all of them take 24 bytes a joint and frame.
#pragma once

#include <functional>

#include "kinespace/motion/kinematics.h"

namespace kinespace {

// Frames that are worked on together: what they take stays in the caches.
inline constexpr int position_block_frames = 512;

// The positions of the frames [first, first + count), as joint_positions gives them; `out` keeps its memory.
void positions_of_frames(const Clip& clip, int first, int count, JointPositions& out);

// Hands over the positions block by block: the first frame, and the positions from there on. Each block begins with the
// last `overlap` frames of the one before.
void for_each_position_block(const Clip& clip, int overlap,
                             const std::function<void(int first, const JointPositions&)>& visit);

}  // namespace kinespace
