// The motion-space codec: clips as sums of a few functions of time times a few poses, quantised for joint positions.
//
//   clip -> pose vectors (pose_vectors.h): root position, heading, a rotation vector a joint
//        -> windows of 0.5 to 4 s, cut where it saves bits (time_blocks.h)
//        -> natural functions of time (natural_functions.h), the FPCA functions of smooth motion
//        -> a Karhunen-Loeve basis across the joints in the metric of joint positions (joint_basis.h)
//        -> one quantiser step for all: noise is then equal, in cm of joint position, in every direction; each value is
//           chosen by squared error + lambda * bits
//        -> the context-modelled range coder (coefficient_coder.h)
//
// All clips of a stream share skeletons, basis, spectrum and the start of the models. Functions are ordered from slow
// to fast in five layers over all clips: a prefix of the stream is the same motion with less detail
// (StreamReader::levels). Windows are coded in groups of about 4096 frames, so that one clip or a part of it is decoded
// without the rest.
//
// Targets: mean_error_cm is met within 2 % from below; max_error_cm by making the step finer in the windows that need
// it; bytes by the step. The shell error (hands, toes, turns of limbs about themselves) is held to settings.shell_ratio
// times the mean joint error by its weight in the metric.
//
// What it does not do: keep a skeleton's offsets to more than 32-bit floats, rotations to more than 1e-6 rad or so (the
// finest step), or jump-free seams between windows: the two sides of a seam are off as much as frames elsewhere are.
#pragma once

#include "kinespace/codecs/pose_space/pose_space_basis.h"
#include "kinespace/codecs/stream/codec.h"

namespace kinespace {

class PoseSpaceCodec final : public Codec {
 public:
  [[nodiscard]] std::string_view name() const override { return "motion-space"; }
  [[nodiscard]] std::span<const CodecSetting> settings() const override;
  [[nodiscard]] bool takes_basis() const override { return true; }
  [[nodiscard]] Bytes encode(std::span<const Clip> clips, const CodecOptions& options) const override;
  [[nodiscard]] std::unique_ptr<StreamReader> open(Bitstream stream) const override;

  // With tables that a library has instead of tables of the stream's own (CodecOptions::basis). The shell error is then
  // what the basis gives: near shell_ratio times the mean, but not held to it. `basis` must outlive the call only.
  // Throws Error{usage} when the stream was made with another basis, or the basis is missing.
  [[nodiscard]] std::unique_ptr<StreamReader> open_with(const PoseSpaceBasis* basis, Bitstream stream) const override;
};

}  // namespace kinespace
