#include "codecs/rma/posture_paths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "codecs/rma/option_range.h"
#include "codecs/rma/path_bridges.h"
#include "codecs/rma/table_minima.h"

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
    for (const auto& [i, index] : seeds()) {
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
  // Row and index of the 2D minima, the nearest postures first.
  [[nodiscard]] std::vector<std::pair<int, std::size_t>> seeds() const {
    std::vector<std::pair<int, std::size_t>> out;
    for (int i = 0; i < table_.size(); ++i) {
      const auto begin = minima_.row_begin[static_cast<std::size_t>(i)];
      const auto end = minima_.row_begin[static_cast<std::size_t>(i) + 1];
      for (std::size_t p = begin; p < end; ++p) {
        if (minima_.pixels[p].both) out.emplace_back(i, p);
      }
    }
    std::sort(out.begin(), out.end(), [this](const auto& a, const auto& b) {
      return std::tie(minima_.pixels[a.second].square, a.second) < std::tie(minima_.pixels[b.second].square, b.second);
    });
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

}  // namespace

void PathOptions::validate() const {
  require_option("threshold", threshold, 1e-6, 2);
  require_option("bridge_s", bridge_s, 0, 10);
  require_option("length_s", length_s, 0.05, 60);
  require_option("lag_s", lag_s, 1e-6, 60);
}

std::vector<PosturePath> find_posture_paths(const SelfDistance& table, const PathOptions& options) {
  options.validate();
  const double frame_rate = table.pixel_rate_hz() * table.stride();
  const auto lag = std::max<std::int64_t>(1, std::llround(options.lag_s * frame_rate));
  const TableMinima minima = find_minima(table, options.threshold * table.typical(), lag);
  std::vector<PosturePath> paths = PathTracer(table, minima).trace();
  const auto pixels = [&](double seconds) { return static_cast<int>(std::lround(seconds * table.pixel_rate_hz())); };
  paths = bridge_paths(table, std::move(paths), pixels(options.bridge_s));
  std::erase_if(paths, [&](const PosturePath& path) { return manhattan(path) < pixels(options.length_s); });
  std::sort(paths.begin(), paths.end(), [](const PosturePath& a, const PosturePath& b) {
    const PathPoint &p = a.points.front(), &q = b.points.front();
    return std::tie(p.i, p.j) < std::tie(q.i, q.j);
  });
  return paths;
}

}  // namespace kinespace
