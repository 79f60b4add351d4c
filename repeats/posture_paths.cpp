#include "kinespace/repeats/posture_paths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "kinespace/repeats/detail/option_range.h"
#include "kinespace/repeats/detail/path_bridges.h"
#include "kinespace/repeats/detail/table_minima.h"

namespace kinespace {
namespace {

// Steps to the lower right, the short ones first.
constexpr std::array<std::array<std::pair<int, int>, 3>, 2> steps{
    {{{{1, 1}, {1, 0}, {0, 1}}}, {{{2, 2}, {2, 1}, {1, 2}}}}};

constexpr std::size_t none = static_cast<std::size_t>(-1);

// Steps 3 to 5.
class PathTracer {
 public:
  PathTracer(const SelfDistance& table, const TableMinima& minima)
      : table_(table), minima_(minima), taken_(minima.pixels.size(), false) {}

  std::vector<PosturePath> trace() {
    std::vector<PosturePath> out;
    for (const auto& [square, i, index] : seeds()) {
      if (taken_[index]) continue;
      taken_[index] = true;
      const PathPoint seed = point(i, index);
      PosturePath path;
      explore(seed, -1, path.points);
      std::reverse(path.points.begin(), path.points.end());
      path.points.push_back(seed);
      explore(seed, 1, path.points);
      out.push_back(std::move(path));
    }
    return out;
  }

 private:
  struct Seed {
    float square = 0;
    int i = 0;
    std::size_t index = 0;  // into the labelled pixels
    bool operator<(const Seed& other) const { return std::tie(square, index) < std::tie(other.square, other.index); }
  };

  // The 2D minima, the nearest postures first.
  [[nodiscard]] std::vector<Seed> seeds() const {
    std::vector<Seed> out;
    for (int i = 0; i < table_.size(); ++i) {
      const auto begin = minima_.row_begin[static_cast<std::size_t>(i)];
      const auto end = minima_.row_begin[static_cast<std::size_t>(i) + 1];
      for (std::size_t p = begin; p < end; ++p) {
        if (minima_.pixels[p].both) out.push_back({minima_.pixels[p].square, i, p});
      }
    }
    std::sort(out.begin(), out.end());
    return out;
  }

  [[nodiscard]] PathPoint point(int i, std::size_t index) const {
    const TableMinima::Pixel& pixel = minima_.pixels[index];
    return {i, pixel.column, std::sqrt(pixel.square)};
  }

  // The free labelled pixel at (i, j), in the runs of `from`.
  [[nodiscard]] std::size_t find(int i, int j, const PathPoint& from) const {
    if (i < 0 || j < 0 || i >= table_.size() || j >= table_.size()) return none;
    if (table_.run(i) != table_.run(from.i) || table_.run(j) != table_.run(from.j)) return none;
    const auto row = minima_.row(i);
    const auto at = std::lower_bound(row.begin(), row.end(), j,
                                     [](const TableMinima::Pixel& p, int column) { return p.column < column; });
    if (at == row.end() || at->column != j) return none;
    const auto index = minima_.row_begin[static_cast<std::size_t>(i)] + static_cast<std::size_t>(at - row.begin());
    return taken_[index] ? none : index;
  }

  void explore(PathPoint at, int direction, std::vector<PathPoint>& out) {
    for (;;) {
      std::size_t best = none;
      int best_row = 0;
      for (const auto& ring : steps) {
        for (const auto& [di, dj] : ring) {
          const std::size_t next = find(at.i + direction * di, at.j + direction * dj, at);
          if (next == none || (best != none && minima_.pixels[next].square >= minima_.pixels[best].square)) continue;
          best = next;
          best_row = at.i + direction * di;
        }
        if (best != none) break;
      }
      if (best == none) return;
      taken_[best] = true;
      at = point(best_row, best);
      out.push_back(at);
    }
  }

  const SelfDistance& table_;
  const TableMinima& minima_;
  std::vector<bool> taken_;
};

int manhattan(const PosturePath& path) {
  return path.points.back().i - path.points.front().i + path.points.back().j - path.points.front().j;
}

// The longest paths, as long as they have a pixel on either axis that fewer than `crowd` paths have.
std::vector<PosturePath> without_crowds(std::vector<PosturePath> paths, int pixels, int crowd) {
  std::stable_sort(paths.begin(), paths.end(),
                   [](const PosturePath& a, const PosturePath& b) { return manhattan(a) > manhattan(b); });
  std::vector<int> count(static_cast<std::size_t>(pixels), 0);
  std::erase_if(paths, [&](const PosturePath& path) {
    const PathPoint &begin = path.points.front(), &end = path.points.back();
    const auto axis = [&](int first, int last) { return std::span(count).subspan(first, last - first + 1); };
    const auto crowded = [crowd](int c) { return c >= crowd; };
    const auto i = axis(begin.i, end.i), j = axis(begin.j, end.j);
    if (std::all_of(i.begin(), i.end(), crowded) && std::all_of(j.begin(), j.end(), crowded)) return true;
    for (int& c : i) ++c;
    for (int& c : j) ++c;
    return false;
  });
  return paths;
}

}  // namespace

void PathOptions::validate() const {
  require_option("threshold", threshold, 1e-6, 2);
  require_option("bridge_s", bridge_s, 0, 10);
  require_option("length_s", length_s, 0.05, 60);
  require_option("crowd", crowd, 1, 100'000);
  require_option("lag_s", lag_s, 1e-6, 60);
}

std::vector<PosturePath> find_posture_paths(const SelfDistance& table, const PathOptions& options) {
  options.validate();
  const double frame_rate = table.pixel_rate_hz() * table.stride();
  const auto lag = std::max<std::int64_t>(1, std::llround(options.lag_s * frame_rate));
  const TableMinima minima = find_minima(table, options.threshold * table.typical(), lag);
  std::vector<PosturePath> paths = PathTracer(table, minima).trace();
  const auto pixels = [&](double seconds) { return static_cast<int>(std::lround(seconds * table.pixel_rate_hz())); };
  // What is much too short is chance, and there is much of it.
  std::erase_if(paths, [&](const PosturePath& path) { return manhattan(path) < pixels(options.length_s) / 4; });
  paths = bridge_paths(table, std::move(paths), pixels(options.bridge_s));
  std::erase_if(paths, [&](const PosturePath& path) { return manhattan(path) < pixels(options.length_s); });
  paths = without_crowds(std::move(paths), table.size(), options.crowd);
  std::sort(paths.begin(), paths.end(), [](const PosturePath& a, const PosturePath& b) {
    const PathPoint &p = a.points.front(), &q = b.points.front();
    return std::tie(p.i, p.j) < std::tie(q.i, q.j);
  });
  return paths;
}

}  // namespace kinespace
