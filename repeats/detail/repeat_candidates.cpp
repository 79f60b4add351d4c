#include "kinespace/repeats/detail/repeat_candidates.h"

#include <algorithm>
#include <cstdint>

namespace kinespace {
namespace {

// Intervals of this many neighbouring cuts.
constexpr int spans[] = {1, 2, 3, 4, 6, 8, 12, 16, 24};

// How many path ends fall on each border between pixels (border p: before pixel p).
std::vector<int> count_ends(std::span<const PosturePath> paths, int pixels) {
  std::vector<int> out(static_cast<std::size_t>(pixels) + 1, 0);
  for (const PosturePath& path : paths) {
    const PathPoint &begin = path.points.front(), &end = path.points.back();
    for (const int border : {begin.i, begin.j, end.i + 1, end.j + 1}) ++out[static_cast<std::size_t>(border)];
  }
  return out;
}

// The cuts of one run, its ends included: the busiest first, none nearer than `shortest` to one that stays.
std::vector<int> cuts_of_run(const std::vector<int>& ends, int first, int last, int shortest) {
  const auto support = [&](int border) {
    int sum = 0;
    for (int p = std::max(first, border - shortest / 2); p <= std::min(last, border + shortest / 2); ++p) {
      sum += ends[static_cast<std::size_t>(p)];
    }
    return sum;
  };
  std::vector<std::pair<int, int>> order;  // -support, border
  for (int p = first + 1; p < last; ++p) {
    if (ends[static_cast<std::size_t>(p)] > 0) order.emplace_back(-support(p), p);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::uint8_t> near(static_cast<std::size_t>(last - first) + 1, 0);
  std::vector<int> out{first, last};
  const auto keep = [&](int border) {
    for (int p = std::max(first, border - shortest + 1); p <= std::min(last, border + shortest - 1); ++p) {
      near[static_cast<std::size_t>(p - first)] = 1;
    }
  };
  keep(first);
  keep(last);
  for (const auto& [support_of, border] : order) {
    if (near[static_cast<std::size_t>(border - first)] != 0) continue;
    out.push_back(border);
    keep(border);
  }
  std::sort(out.begin(), out.end());
  return out;
}

// Cuts no further apart than `most`.
std::vector<int> with_more_cuts(const std::vector<int>& cuts, int most) {
  std::vector<int> out(cuts.begin(), cuts.begin() + 1);
  for (std::size_t c = 1; c < cuts.size(); ++c) {
    const int length = cuts[c] - cuts[c - 1], parts = (length + most - 1) / most;
    for (int part = 1; part <= parts; ++part) {
      out.push_back(cuts[c - 1] + static_cast<int>(static_cast<std::int64_t>(length) * part / parts));
    }
  }
  return out;
}

}  // namespace

std::vector<PixelInterval> candidate_intervals(const SelfDistance& table, std::span<const PosturePath> paths,
                                               int shortest, int longest) {
  const std::vector<int> ends = count_ends(paths, table.size());
  std::vector<PixelInterval> out;
  for (int run = 0; run < table.run_count(); ++run) {
    const int first = table.run_first_pixel(run);
    int last = first;
    while (last < table.size() && table.run(last) == run) ++last;
    const std::vector<int> cuts =
        with_more_cuts(cuts_of_run(ends, first, last, shortest), std::max(shortest, longest / 2));
    for (std::size_t c = 0; c + 1 < cuts.size(); ++c) {
      for (const int span : spans) {
        if (c + static_cast<std::size_t>(span) >= cuts.size()) break;
        const int length = cuts[c + static_cast<std::size_t>(span)] - cuts[c];
        if (length < shortest || length > longest) continue;
        out.push_back({cuts[c], cuts[c] + length});
      }
    }
  }
  return out;
}

std::vector<float> references(const PathSide& part, int first, int last, int least, int most) {
  std::vector<float> out(static_cast<std::size_t>(last - first));
  std::vector<int> known;  // pixels with points, ascending
  for (std::size_t p = 0; p < part.size();) {
    const int pixel = part.to(p);
    std::size_t best = p;
    for (; p < part.size() && part.to(p) == pixel; ++p) {
      if (part.points[p].distance < part.points[best].distance) best = p;
    }
    out[static_cast<std::size_t>(pixel - first)] = static_cast<float>(part.from(best));
    known.push_back(pixel);
  }
  const auto value = [&](int pixel) -> float& { return out[static_cast<std::size_t>(pixel - first)]; };
  for (int p = first; p < known.front(); ++p) value(p) = value(known.front()) - static_cast<float>(known.front() - p);
  for (int p = known.back() + 1; p < last; ++p) value(p) = value(known.back()) + static_cast<float>(p - known.back());
  for (std::size_t k = 0; k + 1 < known.size(); ++k) {
    const float pace = (value(known[k + 1]) - value(known[k])) / static_cast<float>(known[k + 1] - known[k]);
    for (int p = known[k] + 1; p < known[k + 1]; ++p)
      value(p) = value(known[k]) + pace * static_cast<float>(p - known[k]);
  }
  for (float& r : out) r = std::clamp(r, static_cast<float>(least), static_cast<float>(most - 1));
  return out;
}

}  // namespace kinespace
