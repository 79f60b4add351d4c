// The motion space of a library: function sets for the kinds of sequences that registration makes (fpca/sequences.h).
//
// A sequence of three cycles needs other functions than one of a cycle, or one that was cut at rests: over whole cycles
// the harmonics of the cycle are orthogonal and nothing else is needed, so that three cycles take little more than one.
// Mixed in one set, each kind would pay for the functions of the others. So every kind has a motion space of its own,
// and a sequence says which it is in. All share skeleton, references, grouping and options.
//
// Level of detail n is n numbers a curve for a sequence that was cut at rests (0.8 to 1.2 s), n for each cycle else:
// about as many a second.
#pragma once

#include <string>
#include <vector>

#include "kinespace/fpca/motion_space.h"

namespace kinespace {

class RegisteredSpace {
 public:
  // One set for all sequences, of whatever kind.
  RegisteredSpace(MotionSpace plain);  // NOLINT(google-explicit-constructor): a motion space is one of these
  // sets[c] is that of sequences of c whole cycles, sets[0] of the others; those made of no curves are of no use.
  explicit RegisteredSpace(std::vector<MotionSpace> sets);

  // The set of sequences that were cut at rests.
  [[nodiscard]] const MotionSpace& plain() const { return sets_.front(); }
  // Whether sequences of so many cycles can be described, and by which set.
  [[nodiscard]] bool has(int cycles) const;
  [[nodiscard]] const MotionSpace& of(int cycles) const;
  [[nodiscard]] const std::vector<MotionSpace>& sets() const { return sets_; }

  // Whether sequences that were cut at rests have warps (fpca/alignment.h).
  [[nodiscard]] bool warped() const { return warped_; }
  void set_warped(bool warped) { warped_ = warped; }

  // Over all sets: the level that has all functions, the most functions of a set, their sum, the share of variance.
  [[nodiscard]] int levels() const;
  [[nodiscard]] int functions() const;
  [[nodiscard]] int function_count() const;
  [[nodiscard]] double variance_covered() const;
  [[nodiscard]] double movement_covered() const;

  // What all sets share.
  [[nodiscard]] const Skeleton& skeleton() const { return plain().skeleton(); }
  [[nodiscard]] const CurveLayout& layout() const { return plain().layout(); }
  [[nodiscard]] const MotionSpaceOptions& options() const { return plain().options(); }
  [[nodiscard]] int curves() const { return plain().curves(); }
  [[nodiscard]] const Eigen::Matrix4Xd& references() const { return plain().references(); }
  void apply_references(SampleMatrix& values) const { plain().apply_references(values); }

 private:
  template <typename Covered>
  [[nodiscard]] double mean_by_curves(const Covered& covered) const;

  std::vector<MotionSpace> sets_;
  bool warped_ = false;
};

// library/detail/space_codec.h
[[nodiscard]] Bytes pack_space(const RegisteredSpace& space);
[[nodiscard]] RegisteredSpace unpack_registered_space(std::span<const std::byte> bytes, const std::string& source);

}  // namespace kinespace
