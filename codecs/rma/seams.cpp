#include "kinespace/codecs/rma/seams.h"

#include <algorithm>
#include <utility>

namespace kinespace {

SeamSmoother::SeamSmoother(int dimensions, int frames, std::span<const int> seams, double reach, Raw raw,
                           std::span<const int> breaks)
    : raw_(std::move(raw)), loaded_(seams.size()) {
  for (std::vector<double>* one : {&gap_, &slope_, &left_, &right_, &beyond_}) {
    one->resize(static_cast<std::size_t>(dimensions));
  }
  for (std::size_t s = 0; s < seams.size(); ++s) {
    const int seam = seams[s];
    const auto next_break = std::ranges::upper_bound(breaks, seam);
    const int broken_before = next_break == breaks.begin() ? 0 : *(next_break - 1);
    const int broken_after = next_break == breaks.end() ? frames : *next_break;
    const bool shared_before = s > 0 && seams[s - 1] > broken_before;
    const bool shared_after = s + 1 < seams.size() && seams[s + 1] < broken_after;
    const int before = seam - (shared_before ? seams[s - 1] : broken_before);
    const int after = (shared_after ? seams[s + 1] : broken_after) - seam;
    seams_.push_back({.frame = seam,
                      .left = std::min(reach, (shared_before ? 0.5 : 1.0) * before),
                      .right = std::min(reach, (shared_after ? 0.5 : 1.0) * after),
                      .one_left = before < 2,
                      .one_right = after < 2});
  }
}

void SeamSmoother::load(const Seam& seam) {
  raw_(seam.frame - 1, left_);
  raw_(seam.frame, right_);
  std::ranges::fill(slope_, 0.0);
  std::ranges::fill(gap_, 0.0);
  const bool one_sided = seam.one_left || seam.one_right;
  // gap_ collects the sum of both speeds first.
  if (!seam.one_left) {
    raw_(seam.frame - 2, beyond_);
    for (std::size_t k = 0; k < gap_.size(); ++k) {
      const double speed = left_[k] - beyond_[k];
      gap_[k] += one_sided ? 2 * speed : speed;
      if (!one_sided) slope_[k] -= speed;
    }
  }
  if (!seam.one_right) {
    raw_(seam.frame + 1, beyond_);
    for (std::size_t k = 0; k < gap_.size(); ++k) {
      const double speed = beyond_[k] - right_[k];
      gap_[k] += one_sided ? 2 * speed : speed;
      if (!one_sided) slope_[k] += speed;
    }
  }
  for (std::size_t k = 0; k < gap_.size(); ++k) gap_[k] = right_[k] - left_[k] - 0.5 * gap_[k];
}

bool SeamSmoother::touches(int frame) const {
  for (std::size_t s = next_; s < seams_.size() && seams_[s].frame - 0.5 - seams_[s].left < frame; ++s) {
    if (frame < seams_[s].frame - 0.5 + seams_[s].right) return true;
  }
  return false;
}

void SeamSmoother::apply(int frame, std::span<double> values) {
  while (next_ < seams_.size() && seams_[next_].frame - 0.5 + seams_[next_].right <= frame) ++next_;
  if (next_ == seams_.size()) return;
  const Seam& seam = seams_[next_];
  const double distance = frame - (seam.frame - 0.5);
  const bool is_right = distance > 0;
  const double tau = is_right ? distance : -distance;
  const double reach = is_right ? seam.right : seam.left;
  if (tau >= reach) return;
  if (loaded_ != next_) load(seam);
  loaded_ = next_;
  const double u = tau / reach;
  const double fall = (1 - u) * (1 - u);
  const double gap = (is_right ? -0.5 : 0.5) * fall * (1 + 2 * u);
  const double slope = -0.5 * tau * fall;
  for (std::size_t k = 0; k < values.size(); ++k) values[k] += gap * gap_[k] + slope * slope_[k];
}

}  // namespace kinespace
