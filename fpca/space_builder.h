// From clips to a motion space: cut, align, analyse.
//
// Clips are read one at a time from a source, as often as there are rounds, so memory does not grow with their number
// beyond what the source keeps: moments (T x T), a few numbers a sequence, and the clip in hand.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "kinespace/base/progress.h"
#include "kinespace/fpca/alignment.h"
#include "kinespace/fpca/encoding.h"
#include "kinespace/fpca/registration.h"
#include "kinespace/fpca/sequences.h"

namespace kinespace {

// A clip made ready: its curves, and where it is cut.
struct PreparedClip {
  Skeleton skeleton;
  ClipCurves curves;
  std::vector<Run> runs;
};
[[nodiscard]] PreparedClip prepare(const Clip& clip, const SequenceOptions& options = {});
// The same of a clip that is needed no more (clip_curves).
[[nodiscard]] PreparedClip prepare(Clip&& clip, const SequenceOptions& options = {});

// A clip made ready as bytes, in parts of 65 536 frames, so that no long one is held twice. Part 0 has all but the
// values of the others; `part_of` gives them by number, nullopt for one that is not there: then the clip is not,
// either. Throws Error{bad_input} naming `source`.
[[nodiscard]] int prepared_parts(const PreparedClip& clip);
[[nodiscard]] Bytes pack_prepared(const PreparedClip& clip, int part);
[[nodiscard]] std::optional<PreparedClip> unpack_prepared(const std::function<std::optional<Bytes>(int part)>& part_of,
                                                          const std::string& source);

// Clips by number. `load` may be called from several threads.
struct PreparedSource {
  int count = 0;
  std::function<PreparedClip(int)> load;
};
[[nodiscard]] PreparedSource source_of(const std::vector<PreparedClip>& clips);

struct SpaceBuildOptions {
  MotionSpaceOptions space{.pinned = true};  // `cycles` and `pace` are each set's own; what is smoothed is not pinned
  SequenceOptions sequences;
  AlignmentOptions alignment;
  bool align = true;

  void validate() const;
};

struct BuiltSpace {
  RegisteredSpace space;
  std::vector<RestChoice> at_rests;      // for each clip, which stretches of cycles are cut at rests after all
  std::vector<std::vector<Warp>> warps;  // for each clip, one a sequence of its chosen runs

  // The runs of clip i as they were chosen, from those that it was made ready with.
  [[nodiscard]] std::vector<Run> runs_of(int i, const std::vector<Run>& runs) const {
    return apply_choice(runs, at_rests[static_cast<std::size_t>(i)]);
  }
};

// All clips must have the tree of the first; throws Error{bad_input} naming the two that differ, and Error{usage} for
// no clips. The result does not depend on threads.
[[nodiscard]] BuiltSpace build_space(const PreparedSource& clips, const SpaceBuildOptions& options,
                                     const Compute& compute = {}, const Progress& progress = {});

// The space with more clips in it: the moments of the new clips (aligned to the functions that are there) are merged
// into the space's own, exactly, and the functions found anew. Grid, references, grouping and options stay those of
// `space`.
[[nodiscard]] BuiltSpace extend_space(const RegisteredSpace& space, const PreparedSource& clips,
                                      const SpaceBuildOptions& options, const Compute& compute = {},
                                      const Progress& progress = {});

// The main axis of sum q q' for each joint (markley 2007), canonical sign: largest entry positive. 4 x J.
class OrientationMoments {
 public:
  explicit OrientationMoments(int joints);
  void add(const SampleMatrix& values);  // curves of a clip
  void merge(const OrientationMoments& other);
  [[nodiscard]] Eigen::Matrix4Xd references() const;

 private:
  std::vector<Eigen::Matrix4d> sums_;
};

}  // namespace kinespace
