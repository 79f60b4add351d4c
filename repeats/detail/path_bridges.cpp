#include "kinespace/repeats/detail/path_bridges.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <span>
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
      part_.push_back({0, paths[p].points.size()});
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
      const auto points = kept(p);
      if (!out.points.empty()) fill(out.points, points.front());
      out.points.insert(out.points.end(), points.begin(), points.end());
    }
    return out;
  }

 private:
  struct Part {
    std::size_t begin = 0;
    std::size_t end = 0;
  };
  struct Link {
    int to = -1;
    int length = std::numeric_limits<int>::max();
    std::size_t end = 0;    // of the path that goes on
    std::size_t begin = 0;  // of the path it goes on in
  };

  [[nodiscard]] std::span<const PathPoint> kept(int p) const {
    const Part& part = part_[static_cast<std::size_t>(p)];
    return std::span(paths_[static_cast<std::size_t>(p)].points).subspan(part.begin, part.end - part.begin);
  }

  // The nearest begin to the lower right of the end of path p.
  void link(int p) {
    const PathPoint end = kept(p).back();
    Link best;
    for (int i = end.i - 2 * longest_; i <= end.i + longest_; ++i) {
      auto at = std::lower_bound(begins_.begin(), begins_.end(), Begin{i, end.j - 2 * longest_, -1}, before);
      for (; at != begins_.end() && at->i == i && at->j <= end.j + longest_; ++at) {
        if (at->path == p || reached_[static_cast<std::size_t>(at->path)]) continue;
        if (table_.run(at->i) != table_.run(end.i) || table_.run(at->j) != table_.run(end.j)) continue;
        const Link link = link_between(p, at->path);
        if (link.to >= 0 && link.length < best.length) best = link;
      }
    }
    if (best.to < 0) return;
    next_[static_cast<std::size_t>(p)] = best.to;
    reached_[static_cast<std::size_t>(best.to)] = true;
    part_[static_cast<std::size_t>(p)].end = best.end;
    part_[static_cast<std::size_t>(best.to)].begin = best.begin;
  }

  // Where a valley ends a path often goes on along one axis for a bit: such ends are taken off, the less like one
  // first, until the one path begins to the lower right of the other. None when too much would go.
  [[nodiscard]] Link link_between(int p, int q) const {
    const auto from = kept(p), to = kept(q);
    std::size_t end = from.size(), begin = 0;
    while (to[begin].i < from[end - 1].i || to[begin].j < from[end - 1].j) {
      if (from[end - 1].distance >= to[begin].distance) {
        if (--end == 0) return {};
      } else if (++begin == to.size()) {
        return {};
      }
      if (from.size() - end + begin > 2 * static_cast<std::size_t>(longest_)) return {};
    }
    const int di = to[begin].i - from[end - 1].i, dj = to[begin].j - from[end - 1].j;
    if (std::max(di, dj) > longest_) return {};
    return {q, di + dj, part_[static_cast<std::size_t>(p)].begin + end,
            part_[static_cast<std::size_t>(q)].begin + begin};
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
  std::vector<Part> part_;  // of each path: the points that are kept
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
