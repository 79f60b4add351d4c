// Sample motions with known faults put in, and how well contacts agree with the truth.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "examples/contact_training.h"
#include "kinespace/footskate/cleanup.h"
#include "kinespace/footskate/skate_measures.h"

namespace kinespace::test {

// The root path scaled along the ground, rotations unchanged: planted feet slide by a known share of its speed.
inline Clip with_path_scaled(Clip clip, double scale) {
  for (Eigen::Vector3d& p : clip.require_translation_track(clip.skeleton.travel_root()).values) {
    p.x() *= scale;
    p.z() *= scale;
  }
  return clip;
}

inline Clip raised(Clip clip, double by_cm) {
  for (Eigen::Vector3d& p : clip.require_translation_track(clip.skeleton.travel_root()).values) p.y() += by_cm;
  return clip;
}

// The whole clip turned about X by a slope: Z rises.
inline Clip on_slope(Clip clip, double rise) {
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(-std::atan(rise), Eigen::Vector3d::UnitX()));
  const int root = clip.skeleton.travel_root();
  for (Eigen::Vector3d& p : clip.require_translation_track(root).values) p = tilt * p;
  for (int f = 0; f < clip.frames; ++f) clip.set_rotation(root, f, tilt * clip.rotation(root, f));
  return clip;
}

inline std::vector<SampleMotion> unseen_motions(double rate_hz = 60, double height_cm = 165) {
  return sample_library({.seed = 4711, .takes = 1, .rate_hz = rate_hz, .height_cm = height_cm});
}

struct Agreement {
  int both = 0;
  int only_found = 0;
  int only_true = 0;

  void add(const FootContacts& found, const FootContacts& truth, int frames) {
    for (int slot = 0; slot < 4; ++slot) {
      const auto a = planted_frames(found, slot, frames);
      const auto b = planted_frames(truth, slot, frames);
      for (int f = 0; f < frames; ++f) {
        both += a[f] != 0 && b[f] != 0 ? 1 : 0;
        only_found += a[f] != 0 && b[f] == 0 ? 1 : 0;
        only_true += a[f] == 0 && b[f] != 0 ? 1 : 0;
      }
    }
  }
  [[nodiscard]] double f1() const { return 2.0 * both / (2.0 * both + only_found + only_true); }
};

}  // namespace kinespace::test
