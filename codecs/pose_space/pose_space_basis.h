// What motion-space streams leave out when both sides have it: skeletons, the reference pose, the basis across joints,
// and where the coder's models start. Learned once from clips of a kind (a library's), it makes the stream of a single
// clip three to five times smaller, which is otherwise mostly these tables.
//
// One rung for each of a ladder of quantiser steps, a square root of two apart: what is worth keeping depends on the
// step. Streams name the basis by its id and cannot be decoded without it.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/codecs/pose_space/pose_space_tables.h"
#include "kinespace/motion/clip.h"

namespace kinespace {

class PoseSpaceBasis {
 public:
  // From clips of one tree; some ten thousand frames are enough. Throws Error as PoseSpaceCodec::encode does.
  [[nodiscard]] static PoseSpaceBasis learn(std::span<const Clip> clips, const Progress& progress = {});

  [[nodiscard]] Bytes pack() const;
  // Throws Error{bad_input} naming `source`.
  [[nodiscard]] static PoseSpaceBasis unpack(std::span<const std::byte> bytes, const std::string& source);

  // 16 hexadecimal digits: of the packed bytes.
  [[nodiscard]] const std::string& id() const { return id_; }
  // Of the clips it was learned from; streams of the same persons need not tell them again.
  [[nodiscard]] const std::vector<Skeleton>& skeletons() const { return skeletons_; }
  // By step, the finest first; the finest keeps every component, so that any motion can be told.
  [[nodiscard]] const std::vector<PoseSpaceTables>& rungs() const { return rungs_; }
  // Whose step is nearest, in proportion.
  [[nodiscard]] int rung_for(double step) const;
  [[nodiscard]] const ReferencePose& reference() const { return rungs_.front().reference; }

 private:
  PoseSpaceBasis(std::vector<Skeleton> skeletons, std::vector<PoseSpaceTables> rungs);

  std::vector<Skeleton> skeletons_;
  std::vector<PoseSpaceTables> rungs_;
  std::string id_;
};

}  // namespace kinespace
