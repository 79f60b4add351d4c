#include "kinespace/repeats/detail/path_index.h"

#include <algorithm>

namespace kinespace {
namespace {

// The first point from which on `value` is not below `least`.
template <class Value>
std::size_t first_not_below(std::size_t size, int least, const Value& value) {
  std::size_t low = 0, high = size;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (value(middle) < least) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

}  // namespace

PathSide PathSide::part_from(int first, int last) const {
  const auto value = [this](std::size_t p) { return from(p); };
  const std::size_t begin = first_not_below(size(), first, value), end = first_not_below(size(), last, value);
  return {points.subspan(begin, end - begin), swapped};
}

PathSide PathSide::part_to(int first, int last) const {
  const auto value = [this](std::size_t p) { return to(p); };
  const std::size_t begin = first_not_below(size(), first, value), end = first_not_below(size(), last, value);
  return {points.subspan(begin, end - begin), swapped};
}

PathIndex::PathIndex(std::span<const PosturePath> paths, int pixels)
    : paths_(paths), begin_(bucket(std::max(pixels - 1, 0)) + 2, 0) {
  const auto for_each_entry = [&](const auto& use) {
    for (std::size_t p = 0; p < paths.size(); ++p) {
      for (const bool swapped : {false, true}) {
        const PathSide whole{paths[p].points, swapped};
        const Entry entry{static_cast<std::uint32_t>(p), swapped, whole.from(0), whole.from(whole.size() - 1)};
        for (std::size_t b = bucket(entry.first); b <= bucket(entry.last); ++b) use(b, entry);
      }
    }
  };
  for_each_entry([&](std::size_t b, const Entry& /*entry*/) { ++begin_[b + 1]; });
  for (std::size_t b = 1; b < begin_.size(); ++b) begin_[b] += begin_[b - 1];
  entries_.resize(begin_.back());
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  for_each_entry([&](std::size_t b, const Entry& entry) { entries_[next[b]++] = entry; });
}

}  // namespace kinespace
