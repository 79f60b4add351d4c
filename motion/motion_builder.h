// Fills a clip's tracks block by block of frames, as a reader meets them. For the readers only.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "motion/clip.h"

namespace kinespace {

// One joint's translation: a track only if it varies, so a constant one costs no memory.
class TranslationBuilder {
 public:
  TranslationBuilder(int joint, int frames) : joint_(joint), frames_(frames) {}

  void append(const Eigen::Vector3d& value) {
    if (count_ == 0) first_ = value;
    if (values_.empty() && value != first_) {
      values_.reserve(static_cast<std::size_t>(frames_));
      values_.assign(static_cast<std::size_t>(count_), first_);
    }
    if (!values_.empty()) values_.push_back(value);
    ++count_;
  }

  // Hands the track, or the constant as the joint's offset, to the clip. Joints in ascending order.
  void finish(Clip& clip) && {
    if (!values_.empty()) {
      clip.translations.push_back({joint_, std::move(values_)});
    } else if (count_ > 0) {
      clip.skeleton.joints[static_cast<std::size_t>(joint_)].offset = first_;
    }
  }

 private:
  int joint_;
  int frames_;
  int count_ = 0;
  Eigen::Vector3d first_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> values_;
};

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
