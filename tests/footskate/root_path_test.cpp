// The root's path of a long clip, solved part by part.
#include "kinespace/footskate/detail/root_path.h"

#include <gtest/gtest.h>

#include "tests/footskate/skating.h"

namespace kinespace {
namespace {

// The tracks of a walk over and over, a stride's way further each time.
FootTracks walk_on(const FootTracks& once, int frames) {
  FootTracks out{.feet = once.feet, .frames = frames, .rate_hz = once.rate_hz};
  const auto repeat = [&](const Path& path, Path& to) {
    if (path.empty()) return;
    for (int f = 0; f < frames; ++f) {
      const int turn = f / once.frames;
      to.push_back(path[f % once.frames] + turn * (once.root.back() - once.root.front()));
    }
  };
  for (std::size_t slot = 0; slot < 4; ++slot) repeat(once.at[slot], out.at[slot]);
  for (std::size_t leg = 0; leg < 2; ++leg) {
    repeat(once.hip[leg], out.hip[leg]);
    repeat(once.knee[leg], out.knee[leg]);
  }
  repeat(once.root, out.root);
  out.heading.assign(frames, 0);
  return out;
}

std::array<FootTask, 2> wishes(int frames) {
  std::array<FootTask, 2> out;
  for (int leg = 0; leg < 2; ++leg) {
    FootTask& task = out[leg];
    for (int f = 0; f < frames; ++f) {
      task.planted.push_back((f / 40 + leg) % 3 == 0 ? 1 : 0);
      task.displacement.emplace_back(std::sin(0.003 * f), 0.1 * (f % 40 > 20), std::cos(0.011 * f) + leg);
    }
    task.flat = task.planted;
    task.turn.assign(frames, Eigen::Vector3d::Zero());
  }
  return out;
}

TEST(RootPath, of_a_long_clip_is_that_of_its_stretches) {
  constexpr int frames = 26'000;  // four parts
  const SampleMotion walk = make_walk();
  const FootTracks tracks = walk_on(foot_tracks(walk.clip, require_feet(walk.clip)), frames);
  const auto shift = root_shift(tracks, wishes(frames));
  ASSERT_EQ(shift.size(), static_cast<std::size_t>(frames));
  // A stretch that has both borders of a part in it, short enough to be solved at once; its ends are not the clip's.
  constexpr int first = 7500, count = 9000, end = 1000;
  FootTracks some = tracks;
  some.frames = count;
  const auto cut = [&](auto& values) {
    if (values.empty()) return;
    values.erase(values.begin() + first + count, values.end());
    values.erase(values.begin(), values.begin() + first);
  };
  for (Path& path : some.at) cut(path);
  for (std::size_t leg = 0; leg < 2; ++leg) {
    cut(some.hip[leg]);
    cut(some.knee[leg]);
  }
  cut(some.root);
  cut(some.heading);
  std::array<FootTask, 2> tasks = wishes(frames);
  for (FootTask& task : tasks) {
    cut(task.planted);
    cut(task.flat);
    cut(task.turn);
    cut(task.displacement);
  }
  const auto of_some = root_shift(some, tasks);
  for (int f = end; f < count - end; ++f) {
    ASSERT_LT((of_some[f] - shift[first + f]).norm(), 1e-7) << f;
  }
}

}  // namespace
}  // namespace kinespace
