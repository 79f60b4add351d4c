#include "kinespace/synthesis/filling_gap.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "kinespace/base/error.h"

namespace kinespace {
namespace {

bool finite_frame(const Clip& clip, int frame) {
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    if (!clip.rotation(j, frame).coeffs().allFinite()) return false;
  }
  return std::ranges::all_of(clip.translations,
                             [&](const auto& t) { return t.values[static_cast<std::size_t>(frame)].allFinite(); });
}

bool same_frame(const Clip& clip, int a, int b) {
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    if (clip.rotation(j, a).coeffs() != clip.rotation(j, b).coeffs()) return false;
  }
  return std::ranges::all_of(clip.translations, [&](const auto& t) {
    return t.values[static_cast<std::size_t>(a)] == t.values[static_cast<std::size_t>(b)];
  });
}

bool zero_frame(const Clip& clip, int frame) {
  for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
    if (!(clip.rotation(j, frame).vec().norm() < 1e-12)) return false;
  }
  const int root = clip.skeleton.travel_root();
  const Eigen::Vector3d at = clip.translation(root, frame);
  return at.isZero(1e-12) || at == clip.skeleton.joints[static_cast<std::size_t>(root)].offset;
}

[[noreturn]] void fail(const Clip& clip, std::string found, std::string expected, std::string remedy = {}) {
  throw Error(
      ErrorKind::bad_input,
      {.file = clip.name, .found = std::move(found), .expected = std::move(expected), .remedy = std::move(remedy)});
}

}  // namespace

std::vector<FrameRange> missing_frames(const Clip& clip, int least) {
  std::vector<FrameRange> out;
  const auto add = [&](int first, int last) {
    if (!out.empty() && out.back().last_frame >= first - 1) {
      out.back().last_frame = last;
    } else {
      out.push_back({first, last});
    }
  };
  for (int f = 0; f < clip.frames;) {
    int end = f + 1;
    if (!finite_frame(clip, f)) {
      while (end < clip.frames && !finite_frame(clip, end)) ++end;
      add(f, end - 1);
    } else {
      while (end < clip.frames && same_frame(clip, f, end)) ++end;
      const bool zero = zero_frame(clip, f);
      const int first = zero ? f : f + 1;
      const bool still = f == 0 && end == clip.frames;
      if (!still && end - first >= least) add(first, end - 1);
    }
    f = end;
  }
  return out;
}

Clip interpolate_gap(Clip clip, FrameRange gap) {
  const int a = gap.first_frame - 1;
  const int b = gap.last_frame + 1;
  for (int f = gap.first_frame; f <= gap.last_frame; ++f) {
    const double t = static_cast<double>(f - a) / (b - a);
    for (int j = 0; j < clip.skeleton.joint_count(); ++j) {
      clip.set_rotation(j, f, clip.rotation(j, a).slerp(t, clip.rotation(j, b)));
    }
    for (auto& track : clip.translations) {
      const auto at = [&](int frame) -> Eigen::Vector3d& { return track.values[static_cast<std::size_t>(frame)]; };
      at(f) = (1 - t) * at(a) + t * at(b);
    }
  }
  return clip;
}

void require_fillable(const Clip& clip, const std::vector<FrameRange>& gaps) {
  constexpr int least = 2;  // seen frames on each side: a place and a speed
  int seen = 0;             // the first frame after the last gap
  const auto check_seen = [&](int from, int to) {
    for (int f = from; f < to; ++f) {
      if (!finite_frame(clip, f))
        fail(clip, fmt::format("a number that is not finite in frame {}", f), "finite numbers outside the gaps",
             "name these frames as a gap too");
    }
  };
  for (const FrameRange& gap : gaps) {
    if (gap.first_frame < 0 || gap.last_frame >= clip.frames || gap.count() < 1) {
      fail(clip, fmt::format("a gap of frames {} to {}", gap.first_frame, gap.last_frame),
           fmt::format("frames of the clip, 0 to {}, in order", clip.frames - 1));
    }
    if (gap.first_frame - seen < least) {
      fail(clip, fmt::format("{} seen frames before the gap at frame {}", gap.first_frame - seen, gap.first_frame),
           fmt::format("at least {} on each side", least), "a gap at an end has to be cut off instead");
    }
    check_seen(seen, gap.first_frame);
    seen = gap.last_frame + 1;
  }
  if (!gaps.empty() && clip.frames - seen < least) {
    fail(clip, fmt::format("{} seen frames after the gap that ends at frame {}", clip.frames - seen, seen - 1),
         fmt::format("at least {} on each side", least), "a gap at an end has to be cut off instead");
  }
  check_seen(seen, clip.frames);
}

}  // namespace kinespace
