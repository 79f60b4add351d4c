#include "codecs/rma/seams.h"

#include <algorithm>
#include <utility>

namespace kinespace {

SeamSmoother::SeamSmoother(int dimensions, int frames, std::span<const int> seams, double reach, Raw raw)
    : raw_(std::move(raw)), loaded_(seams.size()) {
  for (std::vector<double>* one : {&gap_, &slope_, &left_, &right_, &beyond_}) {
    one->resize(static_cast<std::size_t>(dimensions));
  }
  for (std::size_t s = 0; s < seams.size(); ++s) {
    const bool last = s + 1 == seams.size();
    const int before = seams[s] - (s > 0 ? seams[s - 1] : 0);
    const int after = (last ? frames : seams[s + 1]) - seams[s];
    seams_.push_back({.frame = seams[s],
                      .left = std::min(reach, (s > 0 ? 0.5 : 1.0) * before),
                      .right = std::min(reach, (last ? 1.0 : 0.5) * after),
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
