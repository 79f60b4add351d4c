// A clip in a motion space: from its curves to the vectors of its sequences, and back at any level of detail.
//
// Each sequence is described by the function set of its kind (fpca/registered_space.h), independently of the others; on
// the way back they are joined so that nothing jumps at a cut: neighbours meet at the mean of their two ends (which are
// equal where ends are kept), and where the change of slope at the cut is larger than what the sequences show
// inside, the excess is taken out, both by corrections that fade within `blend` of a sequence.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "kinespace/footskate/kept_feet.h"
#include "kinespace/fpca/registered_space.h"
#include "kinespace/fpca/sequences.h"
#include "kinespace/fpca/warp.h"
#include "kinespace/motion/curves.h"
#include "kinespace/storage/bitstream.h"

namespace kinespace {

inline constexpr int most_extra_detail = 240;

struct EncodedSequence {
  int first = 0;  // frames of the clip, both included
  int last = 0;
  int cycles = 0;  // whole cycles that it holds; 0: it was cut at rests
  Warp warp;
  Eigen::Vector3f travel =
      Eigen::Vector3f::Zero();  // metres from the first to the last frame, heading 0 frame of the clip
  ScoreMatrix scores;           // MotionSpace::rows() x C, of the set of its cycles; 0 behind what it needs (encode)
  int extra_detail = 0;         // 0 .. 240: fast motion takes more numbers at a level of detail (fpca/level_errors.h)

  // The level of its function set that it has at level of detail n of the clip: (1 + extra_detail / 16) n, rounded up.
  [[nodiscard]] int level(int n) const {
    constexpr int most = 1 << 20;  // all of any set
    return n <= 0 ? n : static_cast<int>(std::min<std::int64_t>(most, n + (std::int64_t{n} * extra_detail + 15) / 16));
  }
};

struct EncodedRun {
  Eigen::Vector3f start = Eigen::Vector3f::Zero();  // metres: the root at the run's first frame, in the clip's frame
  std::vector<EncodedSequence> sequences;           // neighbours share a frame
};

// How far the joints are from those of the clip as it was read, at a level of detail.
struct LevelError {
  int level = 0;
  MeasuredError error;
};

// Everything of a clip but its skeleton.
struct EncodedClip {
  std::string name;
  double rate_hz = 0;
  int frames = 0;
  Placement placement;
  std::vector<SideTrack> side_tracks;
  std::vector<EncodedRun> runs;
  MeasuredError error;             // of decoding with all functions, where it was measured
  std::vector<LevelError> levels;  // of some levels, ascending, where they were measured
  std::optional<KeptFeet> feet;    // when and where feet stood, where that is known: encode() does not look for them

  [[nodiscard]] int sequence_count() const;
};

struct JoinOptions {
  double blend = 0.13;       // of a sequence's length, (0, 0.5]
  double free_change = 0.3;  // how much of the typical change of slope inside (rms) may stay at a cut; >= 0. Of spaces
                             // that are not pinned; the others know what change there was (fpca/left_out.h)
};

// The curves of a run as splines, ready to be sampled sequence by sequence.
//
// A run of more than 10 000 frames is not held as one spline, which would take twice the memory of its frames: for each
// stretch that is sampled a spline is laid through it and 40 frames to both sides. A frame's weight in a spline falls
// to 0.27 of what it was from one frame to the next, so the two agree to the last digits of a double.
class RunSampler {
 public:
  // `values`: all frames of the clip; they must outlive the sampler.
  RunSampler(const SampleMatrix& values, const Run& run, double rate_hz);
  RunSampler(SampleMatrix&& values, const Run& run, double rate_hz) = delete;
  // T x C at the T points of the warped sequence time: velocity in m/s, quaternions.
  [[nodiscard]] SampleMatrix sample(int first, int last, const Warp& warp, int points) const;

 private:
  [[nodiscard]] UniformSpline spline_around(int first, int last) const;
  void sample_point(const UniformSpline& spline, double x, Eigen::Ref<Eigen::RowVectorXd> out) const;

  const SampleMatrix& values_;
  std::optional<UniformSpline> whole_;  // of a run that is not long
  int start_;                           // of the run; frames of the clip
  int end_;                             // its last frame
  double rate_hz_;
};

// `curves` must be on the space's side (MotionSpace::apply_references). One warp a sequence, in order; none:
// identities. Where a share of the variance was asked for, each sequence has as many functions as it needs for it, and 0
// behind them (MotionSpace::drop_needless): a body at rest few, a blow many.
[[nodiscard]] EncodedClip encode(const RegisteredSpace& space, const ClipCurves& curves, const std::vector<Run>& runs,
                                 const std::vector<Warp>& warps = {}, const Compute& compute = {});

// Many clips at once: the sequences of all of them go through each set's functions together, which is what a device is
// for. All their samples are in memory at once, about a kilobyte a curve and second.
struct ClipToEncode {
  const ClipCurves* curves = nullptr;
  std::vector<Run> runs;
  std::vector<Warp> warps;
};
[[nodiscard]] std::vector<EncodedClip> encode(const RegisteredSpace& space, std::span<const ClipToEncode> clips,
                                              const Compute& compute = {});

// At level of detail n (all when n < 0).
[[nodiscard]] ClipCurves decode(const RegisteredSpace& space, const EncodedClip& clip, int n = -1,
                                const JoinOptions& options = {});

// The same, sequence by sequence, for what must not hold all of a long clip: hands over the first frame and the values
// of the frames from there on (ClipCurves::values), every frame once, ascending.
void decode_in_parts(const RegisteredSpace& space, const EncodedClip& clip, int n, const JoinOptions& options,
                     const std::function<void(int first, const Eigen::Ref<const SampleMatrix>& rows)>& visit);

// The same for many clips or levels of one space, which must outlive it: what needs the space alone is made once.
class LeftOut;
class ClipDecoder {
 public:
  explicit ClipDecoder(const RegisteredSpace& space);
  explicit ClipDecoder(RegisteredSpace&&) = delete;
  ~ClipDecoder();
  ClipDecoder(ClipDecoder&&) noexcept;
  ClipDecoder& operator=(ClipDecoder&&) = delete;
  ClipDecoder(const ClipDecoder&) = delete;
  ClipDecoder& operator=(const ClipDecoder&) = delete;

  [[nodiscard]] ClipCurves decode(const EncodedClip& clip, int n = -1, const JoinOptions& options = {}) const;
  void decode_in_parts(const EncodedClip& clip, int n, const JoinOptions& options,
                       const std::function<void(int first, const Eigen::Ref<const SampleMatrix>& rows)>& visit) const;

 private:
  const RegisteredSpace& space_;
  std::unique_ptr<const LeftOut> left_out_;  // of a pinned space
};

// A clip outside the library, into the space: curves, sides, cuts, vectors. Throws Error{bad_input} for another
// skeleton.
[[nodiscard]] EncodedClip encode_clip(const RegisteredSpace& space, const Clip& clip,
                                      const SequenceOptions& sequences = {}, const Compute& compute = {});

}  // namespace kinespace
