#include "codecs/rma/path_bridges.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace kinespace {
namespace {

struct Begin {
  int i = 0;
  int j = 0;
  int path = 0;
};

bool before(const Begin& a, const Begin& b) {
  return std::tie(a.i, a.j, a.path) < std::tie(b.i, b.j, b.path);
}

class Bridges {
 public:
  Bridges(const SelfDistance& table, std::span<const PosturePath> paths, int longest)
      : table_(table), paths_(paths), longest_(longest), next_(paths.size(), -1), reached_(paths.size(), false) {
    for (std::size_t p = 0; p < paths.size(); ++p) {
      begins_.push_back({paths[p].points.front().i, paths[p].points.front().j, static_cast<int>(p)});
    }
    std::sort(begins_.begin(), begins_.end(), before);
    std::vector<int> order(paths.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return paths[static_cast<std::size_t>(a)].points.size() > paths[static_cast<std::size_t>(b)].points.size();
    });
    for (const int p : order) link(p);
  }

  [[nodiscard]] bool reached(std::size_t path) const { return reached_[path]; }

  [[nodiscard]] PosturePath chain(std::size_t first) const {
    PosturePath out;
    for (int p = static_cast<int>(first); p >= 0; p = next_[static_cast<std::size_t>(p)]) {
      const auto& points = paths_[static_cast<std::size_t>(p)].points;
      if (!out.points.empty()) fill(out.points, points.front());
      out.points.insert(out.points.end(), points.begin(), points.end());
    }
    return out;
  }

 private:
  // The nearest begin to the lower right of the end of path p.
  void link(int p) {
    const PathPoint end = paths_[static_cast<std::size_t>(p)].points.back();
    int best = -1, best_length = 2 * longest_ + 1;
    for (int di = 0; di <= longest_ && di < best_length; ++di) {
      auto at = std::lower_bound(begins_.begin(), begins_.end(), Begin{end.i + di, end.j, -1}, before);
      for (; at != begins_.end() && at->i == end.i + di && at->j - end.j <= longest_; ++at) {
        if (at->path == p || reached_[static_cast<std::size_t>(at->path)]) continue;
        if (table_.run(at->i) != table_.run(end.i) || table_.run(at->j) != table_.run(end.j)) continue;
        const int length = di + at->j - end.j;
        if (length < best_length) {
          best = at->path;
          best_length = length;
        }
        break;
      }
    }
    if (best < 0) return;
    next_[static_cast<std::size_t>(p)] = best;
    reached_[static_cast<std::size_t>(best)] = true;
  }

  void fill(std::vector<PathPoint>& points, const PathPoint& to) const {
    const PathPoint from = points.back();
    const int count = std::max(to.i - from.i, to.j - from.j);
    for (int k = 1; k < count; ++k) {
      const int i = from.i + (to.i - from.i) * k / count, j = from.j + (to.j - from.j) * k / count;
      points.push_back({i, j, table_.at(i, j)});
    }
  }

  const SelfDistance& table_;
  std::span<const PosturePath> paths_;
  int longest_;
  std::vector<Begin> begins_;
  std::vector<int> next_;
  std::vector<bool> reached_;
};

}  // namespace

std::vector<PosturePath> bridge_paths(const SelfDistance& table, std::vector<PosturePath> paths, int longest) {
  if (longest <= 0) return paths;
  const Bridges bridges(table, paths, longest);
  std::vector<PosturePath> out;
  for (std::size_t p = 0; p < paths.size(); ++p) {
    if (!bridges.reached(p)) out.push_back(bridges.chain(p));
  }
  return out;
}

}  // namespace kinespace
