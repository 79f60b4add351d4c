// Fills a clip's tracks block by block of frames, as a reader meets them. For the readers only.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "kinespace/motion/clip.h"

namespace kinespace {

// Tracks that vary by no more are rounding of the program that wrote the file: the joint keeps its place. For a
// skeleton smaller than a person (a file in metres), as much less.
inline constexpr double still_cm = 0.01;
inline constexpr double still_of_reach = 1e-4;  // of the farthest joint's distance from the root

// One joint's translation: a track only if it varies, so a constant one costs no memory.
class TranslationBuilder {
 public:
  TranslationBuilder(int joint, int frames) : joint_(joint), frames_(frames) {}

  void append(const Eigen::Vector3d& value) {
    if (count_ == 0) low_ = high_ = value;
    if (values_.empty() && value != low_) {
      values_.reserve(static_cast<std::size_t>(frames_));
      values_.assign(static_cast<std::size_t>(count_), low_);
    }
    if (!values_.empty()) {
      values_.push_back(value);
      low_ = low_.cwiseMin(value);
      high_ = high_.cwiseMax(value);
    }
    ++count_;
  }

  [[nodiscard]] int joint() const { return joint_; }
  // The middle of where it goes; `offset` while that is no farther off than rounding.
  [[nodiscard]] Eigen::Vector3d middle(const Eigen::Vector3d& offset) const {
    const bool within = (offset.array() >= low_.array()).all() && (offset.array() <= high_.array()).all();
    if (count_ == 0 || within) return offset;
    return low_ + (high_ - low_) / 2;
  }

  // Hands the track, or what is constant to within `tolerance` cm as the joint's offset, to the clip. Joints in
  // ascending order.
  void finish(Clip& clip, double tolerance) && {
    if (!values_.empty() && (high_ - low_).maxCoeff() > tolerance) {
      clip.translations.push_back({joint_, std::move(values_)});
    } else {
      auto& offset = clip.skeleton.joints[static_cast<std::size_t>(joint_)].offset;
      offset = middle(offset);
    }
  }

 private:
  int joint_;
  int frames_;
  int count_ = 0;
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero(), high_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> values_;  // empty while there is one value
};

// All of a clip's tracks, joints in ascending order.
inline void finish_translations(std::vector<TranslationBuilder> builders, Clip& clip) {
  const auto& joints = clip.skeleton.joints;
  std::vector<Eigen::Vector3d> place(joints.size(), Eigen::Vector3d::Zero());  // from the root
  double reach = 0;
  auto next = builders.begin();
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const bool built = next != builders.end() && static_cast<std::size_t>(next->joint()) == j;
    const Eigen::Vector3d offset = built ? next->middle(joints[j].offset) : joints[j].offset;
    if (built) ++next;
    if (joints[j].parent >= 0) place[j] = place[static_cast<std::size_t>(joints[j].parent)] + offset;
    reach = std::max(reach, (place[j] + joints[j].end_site.value_or(Eigen::Vector3d::Zero())).norm());
  }
  const double tolerance = std::min(still_cm, still_of_reach * reach);
  for (TranslationBuilder& builder : builders) std::move(builder).finish(clip, tolerance);
}

// Columns of numbers for a block of frames: column c holds frames [0, rows) at data(c).
class ColumnBlock {
 public:
  // About 64 KiB, so that a block is read again from the cache.
  explicit ColumnBlock(std::size_t columns)
      : rows_(static_cast<int>(std::clamp<std::size_t>(8192 / std::max<std::size_t>(columns, 1), 8, 256))),
        values_(columns * static_cast<std::size_t>(rows_)) {}

  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] double* data(std::size_t column) { return values_.data() + column * static_cast<std::size_t>(rows_); }
  [[nodiscard]] const double* data(std::size_t column) const {
    return values_.data() + column * static_cast<std::size_t>(rows_);
  }

 private:
  int rows_;
  std::vector<double> values_;
};

}  // namespace kinespace
